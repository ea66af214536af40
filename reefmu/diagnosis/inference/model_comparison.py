"""Names against anonymous rivals: which names stand where something is left that none explains.

A rival only enters where the best set of names leaves it something beyond what the noise and the form of the named
effects could make. Then every set that was fitted is held up again with the rival beside it, and the smallest set that
is as good as the best keeps its names: a name that the rival replaces was a disguise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...effects import EFFECTS, Place, ToleranceSignature
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from ..estimation.score_test import orthonormal_basis
from ..estimation.search import Search, is_degenerate, restrict_fit
from ..estimation.weighting import MEAN_DRIVE_SIZE, SCATTER_SIZES
from .nonparametric import CURVE, NonparametricTerm, TermFit, curve_over_torque, fit_terms
from .population_spread import population_deviations

SIGNIFICANT = 30.0
"""Gain that noise does not give a rival; simulated and blind clean records stay under 7."""
VISIBLE = 0.0006
"""Rms of a rival's part that is worth a verdict, as a share of full torque."""
FORM = 0.0015
"""Share of the names' gain within which what they leave is an error of their form: a creep with three times for one,
friction with a spread of slip lengths."""
REPLACED, REPLACED_SHARE = 20.0, 0.1
"""A name must be worth more than this beside a rival, and this share of what the rival gains beside the best set."""
FORM_ERROR = 0.01
"""Share of the names' gain by which their form may be wrong: what is left beside them must reach it for a rival to
replace them, or for a further name of the family to stand."""
BEND, CURVED = 0.003, 100.0
"""Share of the gain that a bend takes beside names of the curve to be no error of their form; and how much worse the
curve alone may be."""
FEW = 3
"""Sets of every size that are held up again."""
STATIC = frozenset(
    e.name
    for e in EFFECTS.values()
    if e.identification.tolerance_signature is ToleranceSignature.CURVE and e.place is not Place.SENSOR
)
"""Effects that only change the drive's curve of torque over twist."""
TOLERATED, EVEN_SHARE = 1.8, 0.1
"""Standard deviations of the population, and even over odd part (mean squares) where it is no noise, within which a
curve is no gap: a scale at the edge of its tolerance and a bend make up to 1.6."""


@dataclass(frozen=True)
class Comparison:
    """kept: fit of the names that stand, the base fit if none; rival: what is left beside them, None if nothing;
    tolerated: whether that is a curve such as drives of the population have."""

    kept: Fit
    unnamed: TermFit | None
    within_tolerances: bool = False


def as_mean_drive(problem: Problem, fit: Fit) -> Fit:
    """The fit as one of the mean drive, where that and a curve beside it are likelier than scatter; else as it is.

    Where the crank stands a smooth curve says nothing: an individual's is smooth too.
    """
    if fit.weighting.size <= MEAN_DRIVE_SIZE or crank_stands(problem):
        return fit
    smooth = problem.fit_from(fit.names, fit.parameters, problem.weights.for_mean_drive())
    curve = fit_terms(problem, smooth, [NonparametricTerm(CURVE, curve_over_torque)])
    likelier = smooth.cost - curve[0].gain < fit.cost - SIGNIFICANT
    return smooth if likelier and _stands(problem, smooth, curve, SIGNIFICANT) else fit


def compare_models(problem: Problem, found: Search, best: Fit) -> Comparison:
    """Hold the best set of names against rivals."""
    base = found.base if best.names else best
    gain = max(base.cost - best.cost, 0.0)
    beside = fit_terms(problem, best)
    rest = beside[0].gain if beside else 0.0
    if (base_law := _base_law(problem, base, best)) is not None:
        return base_law
    if not _stands(problem, best, beside, max(SIGNIFICANT, FORM * gain)):
        return Comparison(best, None)
    known: list[NonparametricTerm] = [r.term for r in beside[:4]]
    alone = fit_terms(problem, base) if best.names else beside
    known += [r.term for r in alone[:2] if r.term.coordinate not in {f.coordinate for f in known}]
    margin = max(REPLACED, REPLACED_SHARE * rest)
    sets = _sets(problem, found, best)
    joint = [_joint(problem, f, known) for f in sets]
    top = min(f.cost - r.gain for f, r in joint)
    alike = [(f, r) for f, r in joint if f.cost - r.gain < top + margin]
    # Among those alike the set that stood without a rival comes first.
    kept, unnamed = min(
        alike, key=lambda item: (len(item[0].names), item[0].names != best.names, item[0].cost - item[1].gain)
    )
    if unnamed.term.coordinate != CURVE:
        # A rival that holds a name as a special case is always as good: what is left must be more than a remainder.
        if rest < FORM_ERROR * gain:
            kept, unnamed = next(pair for pair in joint if pair[0].names == best.names)
        return Comparison(kept, unnamed)
    return _curved(problem, base, kept, unnamed, gain, rest)


def _base_law(problem: Problem, base: Fit, best: Fit) -> Comparison | None:
    """The set without its names of the curve, where they only make a curve of the population, whose law may be off by
    that much: several names where a curve of any form does it as well, one where it does it better."""
    static = tuple(n for n in best.names if n in STATIC)
    if not static:
        return None
    worse = CURVED if len(static) > 1 else 0.0
    others = _without(problem, base, best)
    fit, curve = _joint(problem, others, [NonparametricTerm(CURVE, curve_over_torque)])
    alike = fit.cost - curve.gain < best.cost + worse
    return Comparison(others, curve, True) if alike and _tolerated(problem, fit, curve) else None


def _joint(problem: Problem, fit: Fit, known: list[NonparametricTerm]) -> tuple[Fit, TermFit]:
    """A set with the rival that helps it most. With one beside it, the drive may be surer the mean one than without."""
    pairs = [(fit, fit_terms(problem, fit, known)[0])]
    if fit.weighting.size > SCATTER_SIZES[0]:
        sure = problem.fit_from(fit.names, fit.parameters, problem.weights.for_mean_drive(), options=HELD_SIZE)
        pairs.append((sure, fit_terms(problem, sure, known)[0]))
    return min(pairs, key=lambda pair: pair[0].cost - pair[1].gain)


def _without(problem: Problem, base: Fit, fit: Fit) -> Fit:
    """A fit without its names of the curve."""
    others = frozenset(n for n in fit.names if n not in STATIC)
    return problem.fit_from(*restrict_fit(problem, fit, others)) if others else base


def _curved(problem: Problem, base: Fit, kept: Fit, unnamed: TermFit, gain: float, rest: float) -> Comparison:
    """The curve itself is off. A bend that the names of the curve leave is more than their form, so the whole may be
    a tolerance, or something else that bends it."""
    others, curve = _joint(problem, _without(problem, base, kept), [unnamed.term])
    alone = others.cost - curve.gain
    alike = alone < kept.cost - unnamed.gain + CURVED
    if not kept.names and _tolerated(problem, others, curve):
        return Comparison(others, curve, True)
    if alike and rest > BEND * gain and _tolerated(problem, others, curve):
        return Comparison(others, curve, True)
    # Two names for one bend, and the bend itself explains it better than both.
    if len(kept.names) - len(others.names) > 1 and alone < kept.cost:
        return Comparison(others, curve)
    return Comparison(kept, unnamed)


def _stands(problem: Problem, best: Fit, beside: list[TermFit], least: float) -> bool:
    """Whether a rival gains enough, also if the noise is louder than estimated, and can be seen."""
    if not beside or beside[0].gain < least:
        return False
    part = beside[0].torque
    overdispersion = estimate_overdispersion(problem, best, problem.torque - best.prediction.torque - part)
    visible = float(np.sqrt(np.mean(part**2))) > VISIBLE * problem.base.full_torque
    return visible and beside[0].gain > SIGNIFICANT * overdispersion


def _sets(problem: Problem, found: Search, best: Fit) -> list[Fit]:
    """The base, the best set, all of its parts that were fitted, and the best few of every size."""
    sets = [best, found.base]
    for size in range(1, len(best.names) + 1):
        fits = [f for f in found.best.get(size, []) if not is_degenerate(problem, f)]
        sets += [f for k, f in enumerate(fits) if k < FEW or set(f.names) < set(best.names)]
    return list({frozenset(f.names): f for f in reversed(sets)}.values())


def crank_stands(problem: Problem) -> bool:
    """Whether an individual of the population is as smooth as the mean drive, for the crank stands."""
    return problem.scatter is not None and problem.scatter.crank_stands


def _tolerated(problem: Problem, fit: Fit, unnamed: TermFit) -> bool:
    """Whether a curve over the torque is one that drives of the population have: as large, and as odd."""
    torque, part = problem.torque, unnamed.torque
    order = np.argsort(torque)
    other = np.interp(-torque, torque[order], part[order])
    inside = (-torque > torque.min()) & (-torque < torque.max())
    if not len(problem.individuals) or not inside.any():
        return False
    even = np.where(inside, (part + other) / 2, 0.0)
    share = float(np.mean(even[inside] ** 2)) / max(float(np.mean((part - even)[inside] ** 2)), 1e-300)
    seen = fit.weighting.whiten(even)
    basis = orthonormal_basis(fit.weighting, fit.prediction.sensitivities)
    seen = seen - basis @ (basis.T @ seen)
    odd = share < EVEN_SHARE or float((seen**2).sum()) < SIGNIFICANT
    return odd and population_deviations(problem, fit, part) < TOLERATED
