"""From the evidence to a conclusion: which effects are named, what else is possible, what remains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import remainder
from ..estimation.weighting import MEAN_DRIVE_SIZE
from .alternatives import equivalent_sets, indistinguishable_sets, masked_sets
from .evidence import (
    Evidence,
    is_significant_remainder,
    residual_of_other_origin,
    unexplained_excess,
    visible_remainder,
)
from .model_comparison import Comparison, as_mean_drive, compare_models
from .nonparametric import TermFit
from .significance import SignificanceTest, largest_significant_set

REMAINDER_SHARE, REMAINDER_FACTOR = 0.08, 2.0
"""A remainder beside named effects is reported if its excess exceeds this share of their gain, or if its rms exceeds
the smallest visible one by this factor; chosen by judgement."""


@dataclass(frozen=True)
class Selection:
    """The effects selected under one hypothesis about the drive, an individual or the mean drive.

    evidence: under that hypothesis; significant: the largest significant set, None if there is none; tests: all that
    were made; fit: of that set, or without effects; comparison: with nonparametric terms, None on an individual, where
    such a term cannot be told from scatter.
    """

    evidence: Evidence
    significant: SignificanceTest | None
    tests: tuple[SignificanceTest, ...]
    fit: Fit
    comparison: Comparison | None

    def shares(self, fit: Fit, default: float = 0.0) -> Mapping[str, float]:
        """Part of the excess that each effect of a fit removes; the default where it was not tested."""
        if self.significant is None:
            return {}
        return {name: self.significant.shares.get(name, default) for name in fit.names}


@dataclass(frozen=True)
class Conclusion:
    """What is concluded from a record.

    chosen: the fit of the named effects, or without effects; shares: part of the excess that each effect removes;
    alternatives: sets that explain the record as well where the verdict is ambiguous, else sets that the scatter may
    mask; remainder: N.m rms; tests: the significance tests made; unnamed: nonparametric term for the remainder, if one
    is significant; curve_deviation: N.m rms, by which the drive's curve deviates within its tolerances.
    """

    verdict: str
    chosen: Fit
    shares: Mapping[str, float]
    alternatives: tuple[tuple[str, ...], ...]
    remainder: float
    tests: tuple[SignificanceTest, ...]
    unnamed: TermFit | None = None
    curve_deviation: float = 0.0

    @property
    def sets(self) -> tuple[frozenset[str], ...]:
        """The sets of effects at which it arrives, several where it is ambiguous."""
        others = self.alternatives if self.verdict == "ambiguous" else ()
        return (frozenset(self.chosen.names), *(frozenset(names) for names in others))


def select_effects(evidence: Evidence) -> Selection:
    """The significant effects, under the hypothesis about the drive that explains the record.

    Where nothing is significant on an individual, but the record is likelier from a mean drive whose curve deviates by
    more than the tolerances, the hypothesis is the mean drive, on which scatter explains nothing.
    """
    significant, tests = largest_significant_set(evidence)
    base = evidence.search.base
    fit = as_mean_drive(evidence.problem, base if significant is None else significant.fit)
    comparison = _compare(evidence, fit)
    deviates = comparison is not None and not comparison.within_tolerances
    if significant is None and fit is not base and deviates:
        return _select_on_mean_drive(evidence.for_mean_drive(fit))
    return Selection(evidence, significant, tests, fit, comparison)


def _select_on_mean_drive(evidence: Evidence) -> Selection:
    significant, tests = largest_significant_set(evidence)
    fit = evidence.search.base if significant is None else significant.fit
    return Selection(evidence, significant, tests, fit, _compare(evidence, fit))


def _compare(evidence: Evidence, fit: Fit) -> Comparison | None:
    if fit.weighting.size > MEAN_DRIVE_SIZE:
        return None
    return compare_models(evidence.problem, evidence.search, fit)


def decide(selection: Selection) -> Conclusion:
    """The conclusion from the effects selected."""
    comparison = selection.comparison
    if comparison is not None and comparison.unnamed is not None:
        decide_on = _conclude_within_tolerances if comparison.within_tolerances else _conclude_unnamed
        return decide_on(selection, comparison.fit, comparison.unnamed)
    if selection.significant is None:
        return _conclude_without_effects(selection)
    return _conclude_named(selection, selection.significant)


def _conclude_within_tolerances(selection: Selection, kept: Fit, curve: TermFit) -> Conclusion:
    """The drive's curve deviates as curves of individuals do.

    Without a named effect that is nothing. Beside named effects a visible deviation is reported as a remainder, since
    it may as well be an effect without a name.
    """
    evidence, shares = selection.evidence, selection.shares(kept)
    rest = remainder(evidence.problem, kept)
    if kept.names and curve.rms > visible_remainder(evidence.problem, kept):
        return Conclusion("partly", kept, shares, (), max(curve.rms, rest), selection.tests, curve, curve.rms)
    if others := indistinguishable_sets(evidence.problem, kept):
        return Conclusion("ambiguous", kept, shares, others, rest, selection.tests, curve_deviation=curve.rms)
    verdict = "named" if kept.names else "none"
    masked = masked_sets(evidence, kept)
    return Conclusion(verdict, kept, shares, masked, rest, selection.tests, curve_deviation=curve.rms)


def _conclude_unnamed(selection: Selection, kept: Fit, unnamed: TermFit) -> Conclusion:
    """What is left has a coordinate but no name, beside named effects or alone."""
    evidence = selection.evidence
    gain = evidence.search.base.cost - kept.cost
    shares = selection.shares(kept, gain / (gain + unnamed.gain)) if kept.names else {}
    is_selected = kept.names and kept.names == selection.fit.names
    alternatives = equivalent_sets(evidence, kept) if is_selected else indistinguishable_sets(evidence.problem, kept)
    verdict = "ambiguous" if alternatives else "partly" if kept.names else "unknown"
    rest = remainder(evidence.problem, kept)
    return Conclusion(verdict, kept, shares, alternatives, rest, selection.tests, unnamed)


def _conclude_without_effects(selection: Selection) -> Conclusion:
    """Nothing is significant: either nothing is missing, or something that no effect explains."""
    evidence, base = selection.evidence, selection.evidence.search.base
    rest = remainder(evidence.problem, base)
    if is_significant_remainder(evidence, base):
        return Conclusion("unknown", base, {}, (), rest, selection.tests)
    # Beside a scatter that other tolerances could make, effects may be present as well.
    masked = masked_sets(evidence, base)
    if (other_origin := residual_of_other_origin(evidence.problem, base)) > 0:
        return Conclusion("unknown", base, {}, masked, other_origin, selection.tests)
    return Conclusion("none", base, {}, masked, rest, selection.tests)


def _conclude_named(selection: Selection, significant: SignificanceTest) -> Conclusion:
    """A set is significant: named alone, beside a remainder, or as one of several."""
    evidence, fit = selection.evidence, significant.fit
    problem = evidence.problem
    gain, rest = evidence.search.base.cost - fit.cost, remainder(problem, fit)
    is_left = is_significant_remainder(evidence, fit) and (
        unexplained_excess(evidence, fit) > REMAINDER_SHARE * gain
        or rest > REMAINDER_FACTOR * visible_remainder(problem, fit)
    )
    if not is_left and (other_origin := residual_of_other_origin(problem, fit)) > 0:
        is_left, rest = True, other_origin
    alternatives = equivalent_sets(evidence, fit)
    verdict = "ambiguous" if alternatives else "partly" if is_left else "named"
    if verdict == "named":
        alternatives = masked_sets(evidence, fit)
    return Conclusion(verdict, fit, dict(significant.shares), alternatives, rest, selection.tests)


def withdraw_effects(problem: Problem, base: Fit, conclusion: Conclusion) -> Conclusion:
    """A conclusion whose effects runs that were not fitted refute: something is missing, but not these effects."""
    return replace(
        conclusion,
        verdict="unknown",
        chosen=base,
        shares={},
        alternatives=(),
        remainder=remainder(problem, base),
        curve_deviation=0.0,
    )
