"""The verdict that the probabilities of the hypotheses allow, and the fit of which it is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.residuals import remainder
from ..estimation.search import restrict_fit
from ..hypotheses import PROBABILITY_DIGITS, Hypothesis, ranked
from ..inference.evidence import Evidence
from ..inference.significance import assess_set
from ..inference.verdict import Conclusion
from .hypothesis_table import Row

NAMED = 0.6
"""Probability from which effects that the tests support are named. A wrong name is taken to cost as much as one and a
half records that are left undecided, so that naming pays where it is wrong in less than two cases of five; chosen by
judgement."""
UNNAMED = 1 / 3
"""Probability from which something unnamed is reported. To miss it is taken to cost as much as two false suspicions;
chosen by judgement."""
CERTAIN = 0.8
"""Probability of any known effects from which something is missing that is known, if not which: such a record is not
unknown. On the records of the calibration values from 0.8 to 0.95 differ by one verdict."""
CREDIBLE = 0.98
"""Probability of the smallest set of hypotheses in which the truth is said to be."""


@dataclass(frozen=True)
class Decision:
    """verdict: of a diagnosis; effects: that it gives."""

    verdict: str
    effects: frozenset[str]

    @property
    def unnamed(self) -> bool:
        """Whether something without a name is part of the verdict."""
        return self.verdict in ("partly", "unknown")


def decide_by_probability(hypotheses: Sequence[Hypothesis]) -> Decision:
    """The verdict that probabilities allow.

    Effects are named where they are the missing ones, with or without something unnamed beside them, with a probability
    of `NAMED`. Otherwise, unless it is `CERTAIN` that effects are, something unnamed is missing where its probability,
    alone or beside any effects, reaches `UNNAMED`; nothing is, where that is the likeliest hypothesis; and else the
    record is ambiguous.

    >>> table = [((), False, 0.1), (("creep",), False, 0.5), (("creep",), True, 0.3), (("wear",), False, 0.1)]
    >>> found = decide_by_probability([Hypothesis(*row) for row in table])
    >>> found.verdict, sorted(found.effects)
    ('partly', ['creep'])
    """
    alone: dict[frozenset[str], float] = {}
    beside: dict[frozenset[str], float] = {}
    for h in hypotheses:
        part, effects = beside if h.unnamed else alone, frozenset(h.effects)
        part[effects] = part.get(effects, 0.0) + h.probability
    likely = {e: alone.get(e, 0.0) + beside.get(e, 0.0) for h in ranked(hypotheses) if (e := frozenset(h.effects))}
    nothing: frozenset[str] = frozenset()
    best = max(likely, key=lambda e: round(likely[e], PROBABILITY_DIGITS), default=nothing)
    if likely.get(best, 0.0) >= NAMED:
        return Decision("partly" if beside.get(best, 0.0) >= UNNAMED * likely[best] else "named", best)
    if sum(beside.values()) >= UNNAMED and sum(likely.values()) < CERTAIN:
        return Decision("unknown", nothing)
    first = ranked(hypotheses)[0]
    return Decision("ambiguous", best) if first.effects else Decision("none", nothing)


def conclude(
    evidence: Evidence, tested: Conclusion, rows: Sequence[Row], hypotheses: Sequence[Hypothesis]
) -> Conclusion:
    """The conclusion from the probabilities of the rows of a table.

    tested: the conclusion from the tests of significance. It stays where

    * the tests find nothing and the probabilities name nothing: a false alarm is worse than a miss;
    * both have the same verdict and effects, or the same effects beside a curve that is within tolerances, which no
      hypothesis counts as something unnamed;
    * nothing is the likeliest, but the tests leave effects open that the tolerances may mask;
    * the effects are among several that this record cannot tell apart, which count as one in the calibration.
    """
    decision = decide_by_probability(hypotheses)
    if tested.verdict == "none" and decision.verdict != "named":
        return tested
    same_effects = decision.effects == frozenset(tested.chosen.names)
    if same_effects and tested.verdict == decision.verdict:
        return tested
    if same_effects and decision.verdict == "named" and tested.curve_deviation:
        return tested
    if same_effects and decision.verdict == "none" and tested.alternatives:
        return tested
    if tested.verdict == "ambiguous" and (same_effects or decision.effects in map(frozenset, tested.alternatives)):
        return tested
    row = max((r for r in rows if r.effects == decision.effects), key=lambda r: r.unnamed == decision.unnamed)
    chosen = tested.chosen if same_effects else _without_small_effects(evidence, row)
    test = assess_set(evidence, chosen) if chosen.names and not same_effects else None
    rest, beside = remainder(evidence.problem, chosen), row.beside
    # Effects that the tolerances may mask belong to the fit beside which they were tested.
    alternatives = tested.alternatives if same_effects else ()
    if decision.verdict == "ambiguous":
        alternatives = _credible_sets(hypotheses, decision.effects)
    return replace(
        tested,
        verdict=decision.verdict,
        chosen=chosen,
        shares=tested.shares if test is None else dict(test.shares),
        tests=tested.tests if test is None else (*tested.tests, test),
        alternatives=alternatives,
        remainder=max(rest, beside.rms) if decision.unnamed and beside else rest,
        unnamed=beside if decision.unnamed else None,
        curve_deviation=beside.rms if beside and not decision.unnamed else 0.0,
    )


def _without_small_effects(evidence: Evidence, row: Row) -> Fit:
    """The fit of a row, refitted without the effects that are too small to matter."""
    if not row.effects:
        return evidence.search.base
    if frozenset(row.fit.names) == row.effects:
        return row.fit
    names, parameters = restrict_fit(evidence.problem, row.fit, row.effects)
    return evidence.problem.fit_from(names, parameters, row.fit.weighting, HELD_SIZE)


def _credible_sets(hypotheses: Sequence[Hypothesis], chosen: frozenset[str]) -> tuple[tuple[str, ...], ...]:
    """Sets of effects other than the chosen one among the likeliest hypotheses of `CREDIBLE` in total."""
    found: dict[tuple[str, ...], None] = {}
    total = 0.0
    for hypothesis in ranked(hypotheses):
        if total >= CREDIBLE:
            break
        total += hypothesis.probability
        if hypothesis.effects and frozenset(hypothesis.effects) != chosen:
            found[tuple(sorted(hypothesis.effects))] = None
    return tuple(found)
