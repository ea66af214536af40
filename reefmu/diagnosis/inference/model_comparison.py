"""Named effects compared with nonparametric terms, where the best named set leaves something unexplained.

Terms are considered only where the best set leaves more than noise and the error of its laws could make. Then every
fitted set is compared again with a term beside it, and the smallest set that is as good as the best keeps its names: a
name that a term replaces had only absorbed something else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...effects import EFFECTS, Place, ToleranceSignature
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from ..estimation.score_test import absorbing_basis
from ..estimation.search import Search, is_degenerate, restrict_fit
from ..estimation.weighting import MEAN_DRIVE_SIZE, SCATTER_SIZES
from .individual_drive import LAW_ERROR, crank_stands, population_deviations
from .nonparametric import CURVE, NonparametricTerm, TermFit, curve_over_torque, fit_terms

SIGNIFICANT_GAIN = 30.0
"""Gain of a term that noise does not reach: simulated records without effects stay below 7, and 15 in its place changes
no verdict (ablation)."""
SIGNIFICANT_SHARE = 0.0015
"""Share of the named effects' gain that a term must also reach, because a law with one relaxation time or one
presliding twist leaves a residual where the material has several. Chosen on simulated records; without it one of 136
verdicts changes (ablation)."""
REPLACEMENT_GAIN, REPLACEMENT_SHARE = 20.0, 0.1
"""Gain that a named effect must bring beside a term, absolutely and as a share of the term's gain beside the best set.
The first was chosen on simulated records and matters: at 0, 20 of 136 verdicts become worse (ablation). The second is
chosen by judgement."""
CURVATURE_SHARE, CURVE_GAIN = 0.003, 100.0
"""Gain of a curve beside named static effects, as a share of theirs, that is more than an error of their law, and the
gain by which the curve alone may be worse than the effects and yet replace them. Chosen on simulated records; without
them 5 of 136 verdicts become worse (ablation)."""
SETS_PER_SIZE = 3
"""Sets of every size, the best of them, that are compared with terms; chosen by judgement to bound the time."""
STATIC_EFFECTS = frozenset(
    e.name
    for e in EFFECTS.values()
    if e.identification.tolerance_signature is ToleranceSignature.CURVE and e.place is not Place.SENSOR
)
"""Effects that change only the drive's own curve of torque over twist."""
MAX_CURVE_DEVIATIONS = 1.8
"""Standard deviations of the population within which a deviation of the curve counts as tolerance: a scale at the limit
of its tolerance together with a change of curvature reaches 1.6. It matters: at 0, 14 of 136 verdicts become worse
(ablation)."""
MAX_EVEN_SHARE = 0.1
"""Mean square of the even part of a curve, over that of the odd part, up to which tolerances make it, unless it is
noise; tolerances act alike on both flanks. Chosen by judgement."""


@dataclass(frozen=True)
class Comparison:
    """fit: of the named effects that remain, without any if none does; unnamed: the term beside them, None if nothing
    is left; within_tolerances: whether that term is a curve that individuals of the population also have."""

    fit: Fit
    unnamed: TermFit | None
    within_tolerances: bool = False


def as_mean_drive(problem: Problem, fit: Fit) -> Fit:
    """The fit under the hypothesis of the mean drive, if that with a curve beside it is likelier than scatter; else the
    fit.

    Where the crank stands, the curve of an individual is as smooth, so that nothing can be concluded.
    """
    if fit.weighting.size <= MEAN_DRIVE_SIZE or crank_stands(problem):
        return fit
    mean_drive = problem.fit_from(fit.names, fit.parameters, problem.weights.for_mean_drive())
    curve = fit_terms(problem, mean_drive, [NonparametricTerm(CURVE, curve_over_torque)])[0]
    is_likelier = mean_drive.cost - curve.gain < fit.cost - SIGNIFICANT_GAIN
    return mean_drive if is_likelier and _is_significant(problem, mean_drive, curve, SIGNIFICANT_GAIN) else fit


def compare_models(problem: Problem, search: Search, best: Fit) -> Comparison:
    """Compare the best set of named effects, and the other fitted sets, with nonparametric terms beside them."""
    base = search.base if best.names else best
    gain = max(base.cost - best.cost, 0.0)
    if (tolerance := _as_tolerance_of_the_curve(problem, base, best)) is not None:
        return tolerance
    beside_best = fit_terms(problem, best)
    if not beside_best or not _is_significant(
        problem, best, beside_best[0], max(SIGNIFICANT_GAIN, SIGNIFICANT_SHARE * gain)
    ):
        return Comparison(best, None)
    left = beside_best[0].gain
    terms = [found.term for found in beside_best[:4]]
    alone = fit_terms(problem, base) if best.names else beside_best
    coordinates = {term.coordinate for term in terms}
    terms += [found.term for found in alone[:2] if found.term.coordinate not in coordinates]
    pairs = [_with_best_term(problem, fit, terms) for fit in _sets_to_compare(problem, search, best)]
    margin = max(REPLACEMENT_GAIN, REPLACEMENT_SHARE * left)
    lowest = min(_cost(pair) for pair in pairs)
    equivalent = [pair for pair in pairs if _cost(pair) < lowest + margin]
    # The smallest of them; among those of one size the set that was best without a term comes first.
    kept, unnamed = min(equivalent, key=lambda pair: (len(pair[0].names), pair[0].names != best.names, _cost(pair)))
    if unnamed.term.coordinate == CURVE:
        return _compare_with_curve(problem, base, kept, unnamed, CURVATURE_SHARE * gain < left)
    # A term that contains a named effect as a special case is never worse: it may replace the effect only where the
    # effect leaves more than an error of its law.
    if left < LAW_ERROR * gain:
        kept, unnamed = next(pair for pair in pairs if pair[0].names == best.names)
    return Comparison(kept, unnamed)


def _cost(pair: tuple[Fit, TermFit]) -> float:
    """Cost of a set with a term beside it."""
    return pair[0].cost - pair[1].gain


def _as_tolerance_of_the_curve(problem: Problem, base: Fit, best: Fit) -> Comparison | None:
    """The set without its static effects, if these only make a curve that individuals of the population have.

    Several static effects give way to a curve that is about as good, a single one to a curve that is better.
    """
    static = STATIC_EFFECTS & set(best.names)
    if not static:
        return None
    margin = CURVE_GAIN if len(static) > 1 else 0.0
    others = _without_static_effects(problem, base, best)
    fit, curve = pair = _with_best_term(problem, others, [NonparametricTerm(CURVE, curve_over_torque)])
    is_as_good = _cost(pair) < best.cost + margin
    return Comparison(others, curve, True) if is_as_good and is_within_tolerances(problem, fit, curve) else None


def _compare_with_curve(problem: Problem, base: Fit, kept: Fit, unnamed: TermFit, is_curved: bool) -> Comparison:
    """The comparison where the term is a curve; is_curved: whether it is more than an error of the static effects' law.

    If it is, all of the curve may be a tolerance, or an effect without a name that bends it.
    """
    others, curve = pair = _with_best_term(problem, _without_static_effects(problem, base, kept), [unnamed.term])
    is_as_good = _cost(pair) < kept.cost - unnamed.gain + CURVE_GAIN
    is_tolerance = not kept.names or (is_as_good and is_curved)
    if is_tolerance and is_within_tolerances(problem, others, curve):
        return Comparison(others, curve, True)
    # Two static effects for one curve, which alone explains more than both.
    if len(kept.names) - len(others.names) > 1 and _cost(pair) < kept.cost:
        return Comparison(others, curve)
    return Comparison(kept, unnamed)


def _with_best_term(problem: Problem, fit: Fit, terms: Sequence[NonparametricTerm]) -> tuple[Fit, TermFit]:
    """A set with the term that gains most beside it.

    With a term beside it the set may be likelier under the hypothesis of the mean drive than it was without.
    """
    pairs = [(fit, fit_terms(problem, fit, terms)[0])]
    if fit.weighting.size > SCATTER_SIZES[0]:
        mean_drive = problem.fit_from(fit.names, fit.parameters, problem.weights.for_mean_drive(), options=HELD_SIZE)
        pairs.append((mean_drive, fit_terms(problem, mean_drive, terms)[0]))
    return min(pairs, key=_cost)


def _without_static_effects(problem: Problem, base: Fit, fit: Fit) -> Fit:
    """The set refitted without its static effects."""
    others = frozenset(fit.names) - STATIC_EFFECTS
    return problem.fit_from(*restrict_fit(problem, fit, others)) if others else base


def _is_significant(problem: Problem, fit: Fit, term: TermFit, least_gain: float) -> bool:
    """Whether a term gains enough, also where the noise is larger than estimated."""
    if term.gain < least_gain:
        return False
    dispersion = estimate_overdispersion(problem, fit, problem.torque - fit.prediction.torque - term.torque)
    return term.gain > SIGNIFICANT_GAIN * dispersion


def _sets_to_compare(problem: Problem, search: Search, best: Fit) -> list[Fit]:
    """The set without effects, the best set, all of its subsets that were fitted, and the best few of every size."""
    sets = [best, search.base]
    for size in range(1, len(best.names) + 1):
        fits = [fit for fit in search.best.get(size, []) if not is_degenerate(problem, fit)]
        sets += [fit for k, fit in enumerate(fits) if k < SETS_PER_SIZE or set(fit.names) < set(best.names)]
    return list({frozenset(fit.names): fit for fit in reversed(sets)}.values())


def is_within_tolerances(problem: Problem, fit: Fit, curve: TermFit) -> bool:
    """Whether a curve over the torque is as small, and as odd, as those of individuals of the population."""
    torque, part = problem.torque, curve.torque
    order = np.argsort(torque)
    mirrored = np.interp(-torque, torque[order], part[order])
    inside = (-torque > torque.min()) & (-torque < torque.max())
    if not len(problem.individuals) or not inside.any():
        return False
    even = np.where(inside, (part + mirrored) / 2, 0.0)
    even_share = float(np.mean(even[inside] ** 2)) / max(float(np.mean((part - even)[inside] ** 2)), 1e-300)
    seen = fit.weighting.whiten(even)
    basis = absorbing_basis(fit.weighting, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    seen = seen - basis @ (basis.T @ seen)
    is_odd = even_share < MAX_EVEN_SHARE or float((seen**2).sum()) < SIGNIFICANT_GAIN
    return is_odd and population_deviations(problem, fit, part) < MAX_CURVE_DEVIATIONS
