"""A diagnosis together with everything it is drawn from."""

from __future__ import annotations

from dataclasses import dataclass

from ..record import Record
from .inference.evidence import Evidence
from .inference.isolability import Isolability
from .inference.verdict import Conclusion
from .schema import Diagnosis


@dataclass(frozen=True)
class Analysis:
    """A diagnosis together with the evidence and the conclusion, from which report and corrected model are made."""

    record: Record
    evidence: Evidence
    isolability: Isolability
    conclusion: Conclusion
    diagnosis: Diagnosis
