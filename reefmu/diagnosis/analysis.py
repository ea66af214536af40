"""A diagnosis with everything behind it, as the report and the corrected model take it."""

from __future__ import annotations

from dataclasses import dataclass

from ..record import Record
from .estimation.problem import Problem
from .estimation.search import Search
from .inference.isolability import Isolability
from .inference.thresholds import Thresholds
from .inference.verdict import Conclusion
from .schema import Diagnosis


@dataclass(frozen=True)
class Analysis:
    """Everything behind a diagnosis, for the report and the corrected model."""

    record: Record
    problem: Problem
    search: Search
    thresholds: Thresholds
    conclusion: Conclusion
    isolability: Isolability
    diagnosis: Diagnosis
