"""What a record says: the probabilities of the hypotheses, and the conclusion that they allow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...effects import find_effect
from ..discrimination.effect_columns import sensitivities
from ..discrimination.predicted_isolability import isolability
from ..discrimination.rival_hypotheses import make_hypotheses
from ..discrimination.simulated_scores import scores_of_records
from ..estimation.held_out import fits_without_held_out
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import amplitudes
from ..estimation.worker_pool import WorkerPool
from ..hypotheses import Hypothesis, IsolabilityMatrix
from ..inference.evidence import Evidence
from .averaged_intervals import Rival, rivals_of
from .calibration import probabilities
from .decision import Conclusion, conclude
from .hypothesis_table import hypothesis_table
from .priors import NO_PRIORS, Priors
from .typical_sizes import typical_sizes

N_RECORDS = 100
"""Simulated records from which the isolability is computed. With four traces of an effect, the standard error of a
probability is below 5 percentage points."""


@dataclass(frozen=True)
class Assessment:
    """hypotheses: with probabilities that sum to 1; conclusion: from them; rivals: explanations other than its chosen
    one that share effects with it; held_out: fits without effects and of the named ones that leave runs out, none
    without effects; sizes: typical ones of effects, SI, by `effect.parameter`."""

    hypotheses: tuple[Hypothesis, ...]
    conclusion: Conclusion
    rivals: Sequence[Rival]
    held_out: Sequence[Fit]
    sizes: Mapping[str, float]


def assess(evidence: Evidence, priors: Priors = NO_PRIORS, pool: WorkerPool | None = None) -> Assessment:
    """The assessment of one record's evidence; priors: of a user; pool: of processes that have its problem, this one if
    None."""
    problem, base = evidence.problem, evidence.search.base
    rows = hypothesis_table(evidence, stated_sizes(problem, priors), pool)
    hypotheses = probabilities(rows, priors)
    conclusion = conclude(evidence, rows, hypotheses)
    held_out = fits_without_held_out(problem, (base, conclusion.chosen)) if conclusion.chosen.names else ()
    rivals = rivals_of(problem, conclusion.chosen, rows, hypotheses)
    return Assessment(hypotheses, conclusion, rivals, held_out, record_sizes(problem, priors))


def record_sizes(problem: Problem, priors: Priors = NO_PRIORS) -> dict[str, float]:
    """Typical sizes of the effects in the gear and the record of a problem, SI, by `effect.parameter`; nominal ones,
    which are mere units of a fit, of effects that have none."""
    effects = [find_effect(name) for name in problem.candidates]
    nominal = {f"{e.name}.{e.parameters[k].name}": e.parameters[k].nominal for e in effects for k in amplitudes(e)}
    return nominal | stated_sizes(problem, priors)


def stated_sizes(problem: Problem, priors: Priors = NO_PRIORS) -> dict[str, float]:
    """Those typical sizes that the gear, the record or a user states; a user's before the others."""
    base, seconds = problem.base, float(problem.trace.time[-1] - problem.trace.time[0])
    clearance = 0.0
    if base.drive is not None:
        clearance = base.drive.tolerances["gear"].sigma
    elif problem.scatter is not None:
        clearance = problem.scatter.clearance_deviation
    return typical_sizes(base.full_torque, base.max_twist, max(seconds, 1e-9), clearance, base.ratio) | dict(
        priors.sizes
    )


def record_isolability(problem: Problem, base: Fit, chosen: Fit, sizes: Mapping[str, float]) -> IsolabilityMatrix:
    """Probability that effect j is named while effect i is true at its typical size, along this record.

    base: the fit without effects, about which the effects are linearised; chosen: the fit whose covariance holds, but
    for the gain of the scatter by its effects.
    Laws, covariance and base curve are taken as known, so that the probabilities are upper bounds.
    """
    if not problem.candidates:
        return IsolabilityMatrix((), ())
    columns = sensitivities(problem, base, sizes)
    single = make_hypotheses(columns, [(name,) for name in problem.candidates])
    weights = chosen.weighting.with_gain(1 / chosen.prediction.contacts.gain)
    found = isolability(scores_of_records(columns, weights, N_RECORDS, 0), single, single)
    return IsolabilityMatrix(found.true, tuple(tuple(float(p) for p in row[:-1]) for row in found.matrix[1:]))
