"""What a record says beyond the verdict: probabilities of the hypotheses, the fit of the chosen one, isolability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...effects import find_effect
from ..discrimination.effect_columns import information_under, sensitivities
from ..discrimination.predicted_isolability import isolability
from ..discrimination.rival_hypotheses import make_hypotheses
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import amplitudes
from ..hypotheses import Hypothesis, IsolabilityMatrix
from ..inference.evidence import Evidence
from ..inference.verdict import Conclusion
from .calibration import probabilities, verdict_of
from .goodness_of_fit import global_p
from .hypothesis_table import hypothesis_table
from .priors import NO_PRIORS, Priors
from .typical_sizes import typical_sizes


@dataclass(frozen=True)
class Assessment:
    """hypotheses: with probabilities that sum to 1; global_p: of the chosen model; isolability: of the effects that the
    record can show."""

    hypotheses: tuple[Hypothesis, ...]
    global_p: float
    isolability: IsolabilityMatrix


def assess(evidence: Evidence, conclusion: Conclusion, priors: Priors = NO_PRIORS) -> Assessment:
    """The assessment of one record's evidence beside the conclusion that was drawn from it; priors: of a user."""
    problem, chosen = evidence.problem, conclusion.chosen
    sizes = record_sizes(problem, priors)
    rows = hypothesis_table(evidence, chosen, sizes)
    verdict = verdict_of(conclusion.verdict, chosen.names, conclusion.alternatives)
    return Assessment(
        probabilities(rows, verdict, priors),
        global_p(problem, chosen),
        record_isolability(problem, evidence.search.base, chosen, sizes),
    )


def record_sizes(problem: Problem, priors: Priors = NO_PRIORS) -> dict[str, float]:
    """Typical sizes of the effects in the gear and the record of a problem; nominal ones of effects that have none;
    those of a user before all."""
    base, seconds = problem.base, float(problem.trace.time[-1] - problem.trace.time[0])
    clearance = 0.0
    if base.drive is not None:
        clearance = base.drive.tolerances["gear"].sigma
    elif problem.scatter is not None:
        clearance = problem.scatter.clearance_deviation
    effects = [find_effect(name) for name in problem.candidates]
    nominal = {f"{e.name}.{e.parameters[k].name}": e.parameters[k].nominal for e in effects for k in amplitudes(e)}
    typical = typical_sizes(base.full_torque, base.max_twist, max(seconds, 1e-9), clearance, base.ratio)
    return nominal | typical | dict(priors.sizes)


def record_isolability(problem: Problem, base: Fit, chosen: Fit, sizes: Mapping[str, float]) -> IsolabilityMatrix:
    """Probability that effect j is named while effect i is true at its typical size, along this record.

    base: the fit without effects, about which the effects are linearised; chosen: the fit whose covariance holds.
    Laws, covariance and base curve are taken as known, so that the probabilities are upper bounds.
    """
    if not problem.candidates:
        return IsolabilityMatrix((), ())
    columns = sensitivities(problem, base, sizes)
    single = make_hypotheses(columns, [(name,) for name in problem.candidates])
    found = isolability(information_under(columns, chosen.weighting), single, single, sizes=())
    return IsolabilityMatrix(found.true, tuple(tuple(float(p) for p in row[:-1]) for row in found.matrix[1:]))
