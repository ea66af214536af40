"""Names of records in tables and of their folders."""

from __future__ import annotations

import os
from pathlib import Path


def record_stem(record: str | os.PathLike[str]) -> str:
    """The name of a record's file without its extensions.

    >>> record_stem("loops/cold.csv.gz")
    'cold'
    """
    name = Path(record).name.removesuffix(".gz")
    return name.rpartition(".")[0] or name
