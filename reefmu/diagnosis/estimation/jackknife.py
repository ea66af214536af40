"""Errors of fitted parameters from leaving cycles out: the delete-one jackknife within kinds of cycles.

Cycles of one kind are replicates of one measurement. Each is left out in turn and the model fitted again; what the
estimates differ by holds all in which cycles differ, whatever its correlation within a cycle and whether or not the law
is exact. Kinds (small and large cycles) are strata, so that a systematic difference between them is no error:

    V = sum_h (m_h - 1)/m_h sum_i (theta_(hi) - mean_i theta_(hi))^2

for m_h cycles of kind h (Wolter, Introduction to Variance Estimation, 2nd ed. 2007, section 4.5). Its degrees of
freedom are Satterthwaite's, V^2 / sum_h V_h^2/(m_h - 1) (Biometrics Bulletin 2, 1946): three cycles give two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from .held_out import NO_WEIGHT
from .least_squares import Fit, FitOptions
from .problem import Problem, make_weights

REFIT = FitOptions(steps=8, tolerance=1e-2, estimate_size=False)
"""A fit without one cycle, from the parameters with it. Chosen by judgement: a tolerance of a hundredth in -2 log
likelihood is a tenth of a standard error."""
MAX_CYCLES = 24
"""Cycles that are left out at most, to bound the time; of more, every k-th one. Chosen by judgement: 24 give a standard
error within a seventh of its size."""


@dataclass(frozen=True)
class JackknifeErrors:
    """standard_error, freedom: (k,) of the fitted variables, and the degrees of freedom of these errors."""

    standard_error: Array
    freedom: Array


def leave_cycles_out(problem: Problem, found: Fit) -> JackknifeErrors | None:
    """Errors of a fit from leaving out one cycle at a time; None where no cycles repeat in torque."""
    cycles = problem.cycles
    if cycles is None:
        return None
    ranking, left_out = problem.for_ranking, range(0, len(cycles), -(-len(cycles) // MAX_CYCLES))
    estimates: dict[int, list[Array]] = {}
    for cycle in left_out:
        variance = np.where(cycles.number == cycle, NO_WEIGHT * problem.variance, problem.variance)
        twist = variance if problem.scatter is None else problem.scatter.twist
        weights = make_weights(variance, problem.scatter, twist).with_size(found.weighting.size)
        if problem.is_mean_drive:
            weights = replace(weights, individual=weights.mean)
        refitted = ranking.fit_from(found.names, found.parameters, weights, REFIT)
        estimates.setdefault(int(cycles.kind[cycle]), []).append(found.bounds.to_free(refitted.parameters))
    return stratified_jackknife([np.array(kind) for kind in estimates.values()])


def stratified_jackknife(estimates: list[Array]) -> JackknifeErrors | None:
    """Errors from the estimates (m_h, k) without each of the m_h members of every stratum; None where every stratum has
    one member.

    >>> values = np.array([1.0, 2.0, 4.0])
    >>> means = (values.sum() - values) / 2
    >>> found = stratified_jackknife([means[:, None]])
    >>> bool(np.isclose(found.standard_error[0], values.std(ddof=1) / 3**0.5)), float(found.freedom[0])
    (True, 2.0)
    """
    strata = [part for part in estimates if len(part) > 1]
    if not strata:
        return None
    size = np.array([len(part) for part in strata], float)
    deviations = np.array([((part - part.mean(axis=0)) ** 2).sum(axis=0) for part in strata])
    variance = deviations * ((size - 1) / size)[:, None]
    total = variance.sum(axis=0)
    freedom = total**2 / np.maximum((variance**2 / (size - 1)[:, None]).sum(axis=0), 1e-300)
    return JackknifeErrors(np.sqrt(total), np.maximum(freedom, size.min() - 1))
