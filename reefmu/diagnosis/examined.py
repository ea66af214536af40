"""A diagnosis with everything behind it, as the report and the corrected model take it."""

from __future__ import annotations

from dataclasses import dataclass

from ..record import Record
from .identify import Search
from .isolate import Isolability
from .result import Diagnosis
from .study import Study
from .thresholds import Thresholds
from .verdict import Finding


@dataclass(frozen=True)
class Examined:
    """Everything behind a diagnosis, for the report and the corrected model."""

    record: Record
    study: Study
    search: Search
    thresholds: Thresholds
    finding: Finding
    isolability: Isolability
    diagnosis: Diagnosis
