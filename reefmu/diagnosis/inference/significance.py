"""What may be called found: significant against individuals of the population, large, and worth its place.

Every effect of a set must be missed when it is left out: by more than a null drive would gain from it under this
very excitation, by a good part of what is still unexplained, and by a visible amount of torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, find_effect
from ..estimation.held_out import shrinks
from ..estimation.least_squares import Fit
from ..estimation.overdispersion import dispersion
from ..estimation.problem import Study
from ..estimation.remainder import comes_again
from ..estimation.search import Search, degenerate, part_of, without
from ..estimation.weighting import INDIVIDUAL, SMALL_SCATTER
from .individual_drive import SCATTER_LIKE, limited_to_tolerances, may_be_individual
from .model_comparison import FORM_ERROR
from .population_spread import population_deviations
from .thresholds import NOISE_GAIN, Thresholds

FIRST_SHARE, FURTHER_SHARE = 0.5, 0.35
"""Share of the excess left without it that an effect must remove: a set's as a whole, and each effect's."""
MATERIAL_FIRST, MATERIAL = 0.0006, 0.002
"""Change of some run, rms, that is worth a name, as a share of full torque: alone, and beside other effects."""
FORM_ERROR_ALL = 0.004
"""Share of the gain of its kin that a further effect of a family must reach where it explains all that was left."""
SEVERAL_TIMES = frozenset(e.name for e in EFFECTS.values() if e.identification.relaxation_spectrum)
"""Effects that materials have with several times and the model with one: the fastest of them look like a spring, which
then explains all that was left."""
GENERAL = frozenset(e.name for e in EFFECTS.values() if e.identification.contains_limit)
"""Effects with a parameter that may run to the limit where another effect takes over; they must be better by
`BETTER`."""
BETTER = 8.0
"""Gain that a further parameter which may run to a limit must bring."""
FARTHER = 1.4
"""Gap of the model alone, over that before, beyond which scatter does what the names should."""
OVER_SCATTER = 2.5
"""Least size of an effect on an individual, in standard deviations of the population along its trace."""
IDLE = 0.9
"""Share of the gap of runs that were not fitted that a name which does what parts do may leave."""


@dataclass(frozen=True)
class SignificanceTest:
    """Whether every effect of a set earns its place; shares: of what is unexplained without it; reasons: why not."""

    fit: Fit
    holds: bool
    shares: Mapping[str, float]
    reasons: Mapping[str, str]


def chance_excess(study: Study) -> float:
    """Excess within which noise alone may lie."""
    ratio = study.block_variance / study.variance
    return 3.0 * float(np.sqrt(2 * (ratio**2).sum()))


def unexplained_excess(study: Study, fit: Fit) -> float:
    """Excess of a fit beyond what chance and a single drive of the population could make.

    What is everywhere and does not come again with the cycles is a noise that is louder than estimated.
    """
    share = float(np.clip((fit.weighting.size - SMALL_SCATTER) / 0.35, 0.0, 1.0))
    excess = study.excess(fit) - chance_excess(study) - share * study.null_excess
    if excess > 0 and not comes_again(study, fit):
        excess -= (dispersion(study, fit) - 1) * study.alone(fit.weighting)
    return max(0.0, excess)


def assess_set(
    study: Study, fit: Fit, base: Fit, thresholds: Thresholds, known: Mapping[frozenset[str], Fit]
) -> SignificanceTest:
    """Leave out each effect in turn, refit, and see whether it is missed."""
    rest, size, overdispersion = unexplained_excess(study, fit), fit.weighting.size, dispersion(study, fit)
    shares, reasons, left_out = {}, {}, {}
    for name in fit.names:
        others = tuple(n for n in fit.names if n != name)
        smaller = left_out[name] = _smaller(study, fit, name, others, known) if others else base
        gain = limited_to_tolerances(study, smaller, fit).cost - fit.cost
        group = find_effect(name).identification.confounding_group
        kin = [other for other in others if group and find_effect(other).identification.confounding_group is group]
        form = FORM_ERROR if rest or SEVERAL_TIMES & set(kin) else FORM_ERROR_ALL
        shares[name] = gain / (gain + rest) if gain > 0 else 0.0
        change = without(study, fit, name) - fit.prediction.torque
        least = thresholds.of(name, size) * overdispersion
        if gain < least:
            reasons[name] = f"gains {gain:.0f}, an individual drive up to {least:.0f}"
        elif kin and gain < form * (_plain(others, kin, base, known).cost - smaller.cost):
            reasons[name] = f"gains {gain:.0f}: so much may the form of {' and '.join(kin)} be wrong"
        elif shares[name] < FURTHER_SHARE:
            reasons[name] = f"removes {100 * shares[name]:.0f} % of what is left without it"
        elif largest_run_rms(study, change) < (MATERIAL if others else MATERIAL_FIRST) * study.base.full_torque:
            reasons[name] = "changes no run visibly"
        elif (
            may_be_individual(study, fit, base, smaller, name, overdispersion)
            and (over := population_deviations(study, fit, change)) < OVER_SCATTER
        ):
            reasons[name] = f"is {over:.1f} times what single drives of the population make of the kind by themselves"
    if not reasons and size >= INDIVIDUAL:
        reasons = _idle(study, fit, {name: left_out[name] for name in fit.names if name in SCATTER_LIKE})
    gain = limited_to_tolerances(study, base, fit).cost - fit.cost
    whole = gain / (gain + rest) if gain > 0 else 0.0
    return SignificanceTest(fit, not reasons and whole >= FIRST_SHARE and _closer(study, fit, base), shares, reasons)


def _plain(names: Sequence[str], kin: Sequence[str], base: Fit, known: Mapping[frozenset[str], Fit]) -> Fit:
    """The fit of a set without the kin of the effect in question, as far as it was made."""
    return known.get(frozenset(names) - frozenset(kin), base)


def _closer(study: Study, fit: Fit, base: Fit) -> bool:
    """Whether the model itself, without what scatter may add to it, stays about as close to the record."""
    before, after = (float(np.sum((study.torque - f.prediction.torque) ** 2)) for f in (base, fit))
    return after < FARTHER**2 * before


def _smaller(study: Study, fit: Fit, name: str, others: tuple[str, ...], known: Mapping[frozenset[str], Fit]) -> Fit:
    """The best fit of a set without one of its effects, from where the set stands and from where it was found."""
    weights = fit.weighting if study.weights_at(fit) is not study.weights else None
    fits = [study.fit_from(*part_of(study, fit, frozenset(others)), weights)]
    if (found := known.get(frozenset(others))) is not None:
        fits.append(found)
    return min(fits, key=lambda f: f.cost)


def largest_run_rms(study: Study, change: Array) -> float:
    """Greatest rms of a change (n,) over a run, N.m."""
    runs = study.trace.run[study.blocks.first]
    return max(float(np.sqrt(np.mean(change[runs == r] ** 2))) for r in np.unique(runs))


def largest_significant_set(
    study: Study, found: Search, thresholds: Thresholds
) -> tuple[SignificanceTest | None, list[SignificanceTest]]:
    """The largest set in which every effect is justified, and what was examined."""
    known = {frozenset(f.names): f for fits in found.best.values() for f in fits}
    examined: list[SignificanceTest] = []
    for size in sorted((k for k in found.best if k), reverse=True):
        for fit in _likeliest(study, found.best[size], thresholds):
            verdict = assess_set(study, fit, found.base, thresholds, known)
            if verdict.holds and not _worth_its_size(study, fit, found):
                verdict = replace(verdict, holds=False, reasons={fit.names[-1]: "a smaller set does as well"})
            examined.append(verdict)
            if verdict.holds:
                return verdict, examined
    return None, examined


def _idle(study: Study, fit: Fit, left_out: Mapping[str, Fit]) -> dict[str, str]:
    """Names that do what parts do, but not in runs that were not fitted; left_out: the fits without each name."""
    shares = {name: shrinks(study, smaller, fit) for name, smaller in left_out.items()}
    return {
        name: f"leaves {100 * share:.0f} % of the gap in runs that were not fitted"
        for name, share in shares.items()
        if share > IDLE
    }


def _worth_its_size(study: Study, fit: Fit, found: Search) -> bool:
    """Whether a set is better than all smaller ones, of whatever names, by more than noise gives."""
    smaller = [f.cost for f in found.best.get(len(fit.names) - 1, []) if not degenerate(study, f)]
    return not smaller or min(smaller) - fit.cost > NOISE_GAIN * dispersion(study, fit)


def _likeliest(study: Study, fits: Sequence[Fit], thresholds: Thresholds) -> list[Fit]:
    """The set that stands out most over what each of its effects would gain on a null drive by chance."""
    fits = [f for f in fits if not degenerate(study, f)] or list(fits)
    return [min(fits, key=lambda f: f.cost + thresholds.total(f) + BETTER * len(GENERAL & set(f.names)))]
