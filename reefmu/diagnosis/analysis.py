"""A diagnosis together with everything it is drawn from."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..record import Record
from .estimation.least_squares import Fit
from .inference.evidence import Evidence
from .inference.isolability import Isolability
from .probabilities.decision import Conclusion
from .schema import Diagnosis


@dataclass(frozen=True)
class ProposedExperiment:
    """A test that was planned to decide what a record leaves open.

    sentence: what it is and what it would bring; protocol: text of a CSV file with its set points, empty where the rig
    of the record allows none that decides.
    """

    sentence: str
    protocol: str


@dataclass(frozen=True)
class WrittenFits:
    """base, corrected: the fits without and with the named effects, with the zero and the base curve of models that are
    written (see `report.corrected_model.written_fit`)."""

    base: Fit
    corrected: Fit


@dataclass(frozen=True)
class Analysis:
    """A diagnosis together with the evidence and the conclusion, from which report and corrected model are made.

    record: as it was diagnosed, a motor's torque without the friction that the drive states. written: the fits of the
    models that are written, to which the gap and the figures refer. proposed: the next experiment, None where none was
    planned. keeps_stated: whether the corrected model contains the friction at the crank that the drive states, which
    is not the case where what was found in the motor's torque contains it.
    """

    record: Record
    evidence: Evidence
    isolability: Isolability
    conclusion: Conclusion
    written: WrittenFits
    diagnosis: Diagnosis
    proposed: ProposedExperiment | None = None
    keeps_stated: bool = True

    def with_proposal(self, proposed: ProposedExperiment | None) -> Analysis:
        """The same analysis whose diagnosis proposes this experiment before all others; unchanged for None."""
        if proposed is None:
            return self
        experiments = (proposed.sentence, *self.diagnosis.next_experiment)
        return replace(self, proposed=proposed, diagnosis=replace(self.diagnosis, next_experiment=experiments))
