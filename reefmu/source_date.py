"""The date that files carry: SOURCE_DATE_EPOCH where it is set (reproducible-builds.org), never the clock's."""

from __future__ import annotations

import os
from datetime import UTC, datetime

from stiffness_model.errors import expect

LATEST = 4354819198
"""s since 1970: the end of 2107, the last date that a zip archive can state (APPNOTE.TXT 4.4.6: 7 bits from 1980)."""


def source_date(default: datetime) -> datetime:
    """The date of SOURCE_DATE_EPOCH, or `default` where it is not set. Raises `InputError` for what is none.

    Commands ask before they load anything: NumPy reads the variable too, and fails on it with a traceback.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch:
        return default
    expect(
        epoch.isascii() and epoch.isdigit() and len(epoch) < 12 and int(epoch) <= LATEST,
        f"seconds since 1970, a whole number up to {LATEST}",
        epoch,
        "SOURCE_DATE_EPOCH",
    )
    return datetime.fromtimestamp(int(epoch), UTC)
