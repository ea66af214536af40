"""From fits to a verdict: what is named, what else it could be, what remains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects import find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, is_repeatable, remainder
from ..estimation.search import Search, is_degenerate
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE, SCATTER_SIZES
from .individual_drive import IMPLAUSIBLE_SIZE, SCATTER_LIKE
from .model_comparison import as_mean_drive, compare_models
from .nonparametric import TermFit
from .population_spread import residual_outside_population
from .significance import SignificanceTest, largest_significant_set, unexplained_excess
from .thresholds import Thresholds

ALIKE_SHARE, ALIKE_COST = 0.004, 9.0
"""Other sets as good as this are alternatives: by the share of the gain, and by what chance makes."""
REMAINDER, REMAINDER_INDIVIDUAL = 0.0025, 0.0045
"""Systematic remainder, rms over full torque, that is said to be there: on the mean drive, and beside scatter,
which is not all in the components."""
NOISE_UNCERTAINTY, NOISE_DEVIATIONS = 0.4, 3.0
"""Share of the noise's variance by which its estimate may be off at least, and in standard deviations."""
MOST_HIDDEN = 3
"""Sets that the scatter may hide, the best of them, that are reported."""
REMAINDER_SHARE = 0.08
"""Share of the gain that the remaining excess must reach to count as a remainder."""


@dataclass(frozen=True)
class Conclusion:
    """verdict; chosen: the set named, or the base fit; alternatives: other sets, or those which the scatter may hide
    where the verdict is none, named or unknown; remainder: N.m rms; rival: an anonymous part of it, None if there is
    none to be seen; curve: N.m rms, by which the drive's own curve is off within the tolerances."""

    verdict: str
    chosen: Fit
    shares: dict[str, float]
    alternatives: tuple[tuple[str, ...], ...]
    remainder: float
    examined: tuple[SignificanceTest, ...]
    unnamed: TermFit | None = None
    curve: float = 0.0


def decide(
    problem: Problem, found: Search, thresholds: Thresholds, indistinguishable: Sequence[tuple[str, str]] = ()
) -> tuple[Problem, Conclusion]:
    """The verdict on a search, and the problem that it stands on: of the mean drive where the record shows it to be."""
    best, examined = largest_significant_set(problem, found, thresholds)
    fit = as_mean_drive(problem, found.base if best is None else best.fit)
    if best is None and fit is not found.base and not compare_models(problem, found, fit).within_tolerances:
        # A mean drive after all: then no name can be put down to scatter.
        problem, found = replace(problem, is_mean_drive=True), Search(fit, found.best)
        best, examined = largest_significant_set(problem, found, thresholds)
        fit = fit if best is None else best.fit
    return problem, _finding(problem, found, thresholds, indistinguishable, fit, best, examined)


def _finding(
    problem: Problem,
    found: Search,
    thresholds: Thresholds,
    indistinguishable: Sequence[tuple[str, str]],
    fit: Fit,
    best: SignificanceTest | None,
    examined: Sequence[SignificanceTest],
) -> Conclusion:
    """What is said of the set that is justified, `best` with its fit, or of the base alone."""
    base = found.base
    if fit.weighting.size <= MEAN_DRIVE_SIZE:
        outcome = compare_models(problem, found, fit)
        kept, unnamed = outcome.kept, outcome.unnamed
        if unnamed is not None and outcome.within_tolerances:
            return _within_tolerances(problem, found, thresholds, kept, unnamed, best, examined)
        if unnamed is not None:
            # Beside names that stand, or alone: what is left has a place but no name.
            gain = base.cost - kept.cost
            shares = {} if best is None else {n: best.shares.get(n, gain / (gain + unnamed.gain)) for n in kept.names}
            same = kept.names and kept.names == fit.names
            alternatives = _alternatives(problem, kept, found, thresholds, indistinguishable) if same else ()
            verdict = "ambiguous" if alternatives else "partly" if kept.names else "unknown"
            return Conclusion(verdict, kept, shares, alternatives, remainder(problem, kept), tuple(examined), unnamed)
    if best is None:
        rest = remainder(problem, base)
        something = unexplained_excess(problem, base) > 0 and rest > _visible(problem, base) and _repeats(problem, base)
        # With a scatter that other tolerances could make, what helps may be there as well.
        hidden = () if something else _hidden(problem, base, found, thresholds)
        if not something and (foreign := _foreign(problem, base)) > 0:
            something, rest = True, foreign
        return Conclusion("unknown" if something else "none", base, {}, hidden, rest, tuple(examined))
    gain = base.cost - best.fit.cost
    rest = remainder(problem, best.fit)
    least = _visible(problem, best.fit)
    more = (
        unexplained_excess(problem, best.fit) > 0
        and rest > least
        and _repeats(problem, best.fit)
        and (unexplained_excess(problem, best.fit) > REMAINDER_SHARE * gain or rest > 2 * least)
    )
    if not more and (foreign := _foreign(problem, best.fit)) > 0:
        more, rest = True, foreign
    alternatives = _alternatives(problem, best.fit, found, thresholds, indistinguishable)
    verdict = "ambiguous" if alternatives else "partly" if more else "named"
    if verdict == "named":
        alternatives = _hidden(problem, best.fit, found, thresholds)
    return Conclusion(verdict, best.fit, dict(best.shares), alternatives, rest, tuple(examined))


def _within_tolerances(
    problem: Problem,
    found: Search,
    thresholds: Thresholds,
    kept: Fit,
    unnamed: TermFit,
    best: SignificanceTest | None,
    examined: Sequence[SignificanceTest],
) -> Conclusion:
    """The drive's own curve is off, as those of single drives are: alone that is nothing, beside names it is said to be
    left, for it may as well be an effect without a name."""
    curve = float(np.sqrt(np.mean(unnamed.torque**2)))
    shares = {} if best is None else {n: best.shares.get(n, 0.0) for n in kept.names}
    if kept.names and curve > _visible(problem, kept):
        return Conclusion(
            "partly", kept, shares, (), max(curve, remainder(problem, kept)), tuple(examined), unnamed, curve
        )
    verdict, hidden = "named" if kept.names else "none", _hidden(problem, kept, found, thresholds)
    return Conclusion(verdict, kept, shares, hidden, remainder(problem, kept), tuple(examined), curve=curve)


def unconfirmed_conclusion(problem: Problem, base: Fit, conclusion: Conclusion) -> Conclusion:
    """A finding whose names make runs worse that were not fitted: something is missing, but not this."""
    rest = remainder(problem, base)
    return replace(conclusion, verdict="unknown", chosen=base, shares={}, alternatives=(), remainder=rest, curve=0.0)


def _foreign(problem: Problem, fit: Fit) -> float:
    """Rms, N.m, of what is left where a scatter could explain it, but not that of these tolerances; else 0."""
    return residual_outside_population(problem, fit) if fit.weighting.size >= SCATTER_SIZES[-1] else 0.0


def _limiting(other: Fit, chosen: Fit, indistinguishable: Sequence[tuple[str, str]]) -> bool:
    """Whether a set only differs by an effect of which the chosen one is the limit, and which this record shows."""
    mine, theirs = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    if len(mine) != 1 or len(theirs) != 1:
        return False
    (limit,), (general,) = mine, theirs
    return find_effect(limit).identification.limit_of == general and {limit, general} not in map(set, indistinguishable)


def _visible(problem: Problem, fit: Fit) -> float:
    """Least remainder, N.m rms, that is called one."""
    scattered_drive = len(fit.weighting.eigenvalues) > 0 and fit.weighting.size > MEAN_DRIVE_SIZE
    share = REMAINDER_INDIVIDUAL if scattered_drive else REMAINDER
    uncertain = _noise_uncertainty(problem) * float(np.mean(problem.block_variance))
    return max(share * problem.base.full_torque, float(np.sqrt(uncertain)))


def _repeats(problem: Problem, fit: Fit) -> bool:
    """Whether what is left is not merely a noise larger or slower than estimated: that would not come again.

    A remainder where nothing repeats (rotation, holds) may be missing in the cycles; it is believed where it is twice
    what the noise's size leaves open.
    """
    if is_repeatable(problem, fit):
        return True
    return remainder(problem, fit) ** 2 > 2 * _noise_uncertainty(problem) * float(np.mean(problem.block_variance))


def _noise_uncertainty(problem: Problem) -> float:
    """Share of the noise's variance by which its estimate may be off: a slow noise says little anew with every sample,
    and the differences of two cycles half as much.
    """
    deviation = float(np.sqrt(4 * problem.noise.correlation_time / len(problem.trace)))
    return max(NOISE_UNCERTAINTY, NOISE_DEVIATIONS * deviation)


def _alternatives(
    problem: Problem, chosen: Fit, found: Search, thresholds: Thresholds, indistinguishable: Sequence[tuple[str, str]]
) -> tuple[tuple[str, ...], ...]:
    """Sets of no more effects that explain the record as well."""
    known = {frozenset(f.names): f.cost for fits in found.best.values() for f in fits}
    fits: Sequence[Fit] = [f for size, fits in found.best.items() if 0 < size <= len(chosen.names) for f in fits]
    alike = []
    for f in sorted(fits, key=lambda f: f.cost):
        if set(f.names) == set(chosen.names):
            continue
        # What a null drive would gain by chance is no argument.
        worse = f.cost - chosen.cost + max(0.0, thresholds.total(f) - thresholds.total(chosen))
        # What counts is the gain of the part in which the two differ.
        common = frozenset(f.names) & frozenset(chosen.names)
        gain = known.get(common, found.base.cost) - chosen.cost
        allowance = max(ALIKE_COST, ALIKE_SHARE * gain)
        if f.n_effect_parameters > chosen.n_effect_parameters:
            # With more parameters it can imitate; as good as the chosen it must be, and not its limiting case.
            allowance = 2.0
        if worse < allowance and not is_degenerate(problem, f) and not _limiting(f, chosen, indistinguishable):
            alike.append(tuple(sorted(f.names)))
    return tuple(alike[:5])


def _hidden(problem: Problem, chosen: Fit, found: Search, thresholds: Thresholds) -> tuple[tuple[str, ...], ...]:
    """Sets of one effect more that gain more than noise gives, but no more than this drive's own tolerances may; or
    that are as likely with less scatter, where it is wider than the tolerances make, or with none."""
    if problem.is_mean_drive:
        return ()
    overdispersion, size, sets = estimate_overdispersion(problem, chosen), chosen.weighting.size, []
    for fit in sorted(found.best.get(len(chosen.names) + 1, []), key=lambda f: f.cost):
        more = set(fit.names) - set(chosen.names)
        if len(more) != 1 or (name := more.pop()) not in SCATTER_LIKE or is_degenerate(problem, fit):
            continue
        less = fit.weighting.size
        instead = (size >= INDIVIDUAL_SIZE and less <= MEAN_DRIVE_SIZE) or (size >= IMPLAUSIBLE_SIZE and less < size)
        if chosen.cost - fit.cost > (0.0 if instead else overdispersion * thresholds.noise[name]):
            sets.append(tuple(sorted(fit.names)))
    return tuple(sets[:MOST_HIDDEN])
