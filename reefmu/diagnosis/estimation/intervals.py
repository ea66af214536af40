"""Errors of the parameters of a fit, bounds that stopped them, and bounds of what a record resolves.

A model never has quite the true form, and the misfit it leaves is correlated over a loop: it does not average out like
noise. Two covariances of the parameters are therefore computed, one from the curvature of the fit and one from the
misfit itself, summed over segments of the record (the cluster-robust sandwich estimator: Cameron and Miller, J. Human
Resources 50, 2015). Where cycles repeat in torque but not in time, a third interval comes from leaving cycles out, with
the quantile of Student's distribution for its few degrees of freedom. All three estimate the same error, each misses a
part of it, and the widest interval counts.

Cycles of one kind are replicates of one measurement. Each is left out in turn and the model fitted again; what the
estimates differ by holds all in which cycles differ, whatever its correlation within a cycle and whether or not the law
is exact. Kinds (small and large cycles) are strata, so that a systematic difference between them is no error:

    V = sum_h (m_h - 1)/m_h sum_i (theta_(hi) - mean_i theta_(hi))^2

for m_h cycles of kind h (Wolter, Introduction to Variance Estimation, 2nd ed. 2007, section 4.5). Its degrees of
freedom are Satterthwaite's, V^2 / sum_h V_h^2/(m_h - 1) (Biometrics Bulletin 2, 1946): three cycles give two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from stiffness_model.numerics.arrays import Array

from ...effects import Parameter
from .held_out import weights_without
from .least_squares import Fit, FitOptions, is_logarithmic, may_be_infinite, normal_equations
from .problem import Problem
from .residuals import segments

CONFIDENCE, NORMAL_QUANTILE = 0.95, 1.96
"""Confidence of the intervals, and the normal distribution's quantile for it."""
ONE_SIDED_QUANTILE = 1.645
"""The same for an interval that is bounded on one side only."""
REFIT = FitOptions(steps=8, tolerance=1e-2, estimate_size=False)
"""A fit without one cycle, from the parameters with it. Chosen by judgement: a tolerance of a hundredth in -2 log
likelihood is a tenth of a standard error."""
MAX_CYCLES = 24
"""Cycles that are left out at most, to bound the time; of more, every k-th one. Chosen by judgement: 24 give a standard
error within a seventh of its size."""
STEPS_RESOLVED, RECORDS_RESOLVED, SPEEDS_RESOLVED, TWISTS_RESOLVED = 2, 10, 5, 2
"""Time steps above and record lengths, greatest speeds and greatest twists below which a time, a speed or a length is
resolved. Chosen by judgement: beyond them the effect has the form of a simpler one."""


def interval_errors(problem: Problem, fit: Fit) -> Array:
    """(k,) half widths of the 95 % intervals of the fitted variables, over the quantile of a normal distribution."""
    errors = standard_errors(problem, fit)
    by_cycles = leave_cycles_out(problem, fit) if problem.cycle_scatter is not None and fit.names else None
    if by_cycles is None:
        return errors
    quantile = np.asarray(stdtrit(by_cycles.freedom, 0.5 + CONFIDENCE / 2))
    return np.maximum(errors, quantile / NORMAL_QUANTILE * by_cycles.standard_error)


def bound_reached(fit: Fit, index: int, parameter: Parameter | None = None) -> str:
    """The bound, "low" or "high", that stopped a parameter of a fit; "" if none did.

    index: in the vector of the fit; parameter: its declaration, None for the base curve. A parameter that is held at
    one value has no bound, and some bounds are results: a share of 0 or 1, an amplitude or a play of 0, an infinite
    time.
    """
    low, high = float(fit.bounds.low[index]), float(fit.bounds.high[index])
    if not fit.at_bound[index] or low == high:
        return ""
    bound = "low" if fit.parameters[index] - low < high - fit.parameters[index] else "high"
    if parameter is None:
        return "" if bound == "low" and low == 0 else bound
    is_share = (parameter.minimum, parameter.maximum) == (0.0, 1.0)
    is_neutral = parameter.neutral == (parameter.minimum if bound == "low" else parameter.maximum)
    return "" if is_share or parameter.name.startswith("phase") or is_neutral else bound


def is_degenerate(problem: Problem, fit: Fit) -> bool:
    """Whether a time, length or speed lies where the record does not resolve it and a simpler effect does the same."""
    t = problem.trace
    limits = {
        "s": (STEPS_RESOLVED * problem.sampling_interval, RECORDS_RESOLVED * float(t.time[-1] - t.time[0])),
        "rad/s": (0.0, SPEEDS_RESOLVED * float(np.abs(t.output_speed).max())),
        "rad": (0.0, TWISTS_RESOLVED * problem.base.max_twist),
    }
    for at, p in problem.layout(fit.names).effect_parameters():
        low, high = limits.get(p.unit, (0.0, np.inf))
        high = np.inf if may_be_infinite(p) else high
        if is_logarithmic(p) and not low <= fit.parameters[at] <= high:
            return True
    return False


def one_sided_limit(fit: Fit, index: int, error: float, bound: str) -> float:
    """The end, away from the bound, of the one-sided 95 % interval of a parameter at its bound.

    error: standard error of the fitted variable, as of `standard_errors`. The end stays within the other bound.
    """
    step = ONE_SIDED_QUANTILE * error if bound == "low" else -ONE_SIDED_QUANTILE * error
    value, low, high = (float(v[index]) for v in (fit.parameters, fit.bounds.low, fit.bounds.high))
    logarithmic = fit.bounds.logarithmic[index]
    end = (
        value * float(np.exp(np.clip(step, -50, 50))) if logarithmic else value + step * float(fit.bounds.scale[index])
    )
    return float(np.clip(end, low, high))


def standard_errors(problem: Problem, fit: Fit) -> Array:
    """(k,) standard errors of the fitted variables, the greater of curvature and sandwich estimates.

    The curvature is that for an individual whose parts deviate as the drawing says: the size at which its scatter is
    likeliest follows from ripples, and says little of how far a whole drive deviates.
    """
    curvature = _as_drawn(problem, fit) if fit.weighting.is_individual else fit.curvature
    scale = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    correlation = curvature / scale / scale[:, None]
    inverse = np.linalg.pinv(correlation + 1e-10 * np.eye(len(scale)), hermitian=True)
    misfit = max(1.0, fit.chi_square / problem.expected_chi_square(fit.weighting))
    by_curvature = np.maximum(np.diag(inverse), 0.0) * misfit
    residual = fit.weighting.whiten(problem.torque - fit.prediction.torque)
    scores = fit.weighting.whiten(fit.prediction.sensitivities) * fit.bounds.slope(fit.parameters) / scale
    cluster = segments(problem)
    sums = np.stack([np.bincount(cluster, column * residual) for column in scores.T], axis=1)
    count = len(sums)
    sandwich = inverse @ (sums.T @ sums) @ inverse * count / max(count - len(scale), 1)
    return np.sqrt(np.maximum(by_curvature, np.diag(sandwich))) / scale


def _as_drawn(problem: Problem, fit: Fit) -> Array:
    """(k, k), the curvature of a fit of an individual with the scatter at the size of the drawing, 1."""
    weights, prediction, bounds = fit.weighting.with_size(1.0), fit.prediction, fit.bounds
    jacobian = weights.project(prediction.sensitivities * bounds.slope(fit.parameters))
    return normal_equations(jacobian, weights.project(problem.torque - prediction.torque), fit.parameters, bounds)[1]


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
        weights = weights_without(problem, cycles.number == cycle, found.weighting)
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
