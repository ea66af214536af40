"""The verdict that the probabilities of the hypotheses allow, and the fit of which it is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..calibrated_odds import NAMED
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.residuals import remainder
from ..estimation.search import restrict_fit
from ..hypotheses import PROBABILITY_DIGITS, Hypothesis, merged, ranked
from ..inference.evidence import Evidence
from ..inference.nonparametric import TermFit
from ..inference.tolerance_curve import CurveDeviation, curve_deviation
from .hypothesis_table import Row

NOTHING = 0.5
"""Probability from which nothing is said to be missing: to miss something is taken to cost as much as a record that is
left undecided; chosen by judgement."""
UNNAMED = 1 / 3
"""Probability from which something unnamed is reported. To miss it is taken to cost as much as two false suspicions;
chosen by judgement."""
CERTAIN = 0.8
"""Probability of any known effects from which something is missing that is known, if not which: such a record is not
unknown. On the records of the calibration values from 0.8 to 0.95 differ by one verdict."""
CREDIBLE = 0.98
"""Probability of the smallest set of hypotheses in which the truth is said to be."""


@dataclass(frozen=True)
class Conclusion:
    """What is concluded from a record.

    chosen: the fit of the named effects, or without effects; alternatives: the other sets of effects that the record
    does not exclude, () where nothing may be missing, none of a verdict that finds no effect; shown_alternatives: those
    of which every effect shows in the record; remainder: N.m rms; unnamed: term of something unnamed; curve_deviation:
    what the tolerances of the drive explain as well as a modulus that is off, where the record shows it.
    """

    verdict: str
    chosen: Fit
    alternatives: tuple[tuple[str, ...], ...]
    shown_alternatives: tuple[tuple[str, ...], ...]
    remainder: float
    unnamed: TermFit | None = None
    curve_deviation: CurveDeviation | None = None


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
    """The verdict that the probabilities of what a record shows allow.

    Effects are named where they are the missing ones, with or without something unnamed beside them, with a probability
    of `NAMED`. Otherwise, unless it is `CERTAIN` that effects are, something unnamed is missing where its probability,
    alone or beside any effects, reaches `UNNAMED`; nothing is, where that has a probability of `NOTHING`; and else the
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
    if alone.get(nothing, 0.0) >= NOTHING:
        return Decision("none", nothing)
    return Decision("ambiguous", best if ranked(hypotheses)[0].effects else nothing)


def conclude(evidence: Evidence, rows: Sequence[Row], hypotheses: Sequence[Hypothesis]) -> Conclusion:
    """The conclusion from the probabilities of the rows of a table.

    The verdict is of what the record shows; what may be missing but does not show is among the alternatives.
    """
    shown = [(row, row.shown_as(h.probability)) for row, h in zip(rows, hypotheses, strict=True)]
    told = merged([h for _, h in shown])
    problem, decision = evidence.problem, decide_by_probability(told)
    matching = [row for row, h in shown if frozenset(h.effects) == row.effects == decision.effects]
    row = max(matching, key=lambda r: (r.unnamed == decision.unnamed, not r.is_hidden, r.log_evidence))
    chosen, beside = _without_small_effects(evidence, row), row.beside
    rest = remainder(problem, chosen)
    has_alternatives = decision.verdict in ("named", "partly", "ambiguous")
    return Conclusion(
        decision.verdict,
        chosen,
        _credible_sets(hypotheses, decision.effects) if has_alternatives else (),
        _credible_sets(told, decision.effects) if has_alternatives else (),
        max(rest, beside.rms) if decision.unnamed and beside else rest,
        beside if decision.unnamed else None,
        None if decision.unnamed else curve_deviation(problem, chosen),
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
    """Sets of effects, () of nothing, other than the chosen one among the likeliest hypotheses of `CREDIBLE`."""
    found: dict[tuple[str, ...], None] = {}
    total = 0.0
    for hypothesis in ranked(hypotheses):
        if total >= CREDIBLE:
            break
        total += hypothesis.probability
        unnamed_alone = hypothesis.unnamed and not hypothesis.effects
        if not unnamed_alone and frozenset(hypothesis.effects) != chosen:
            found[tuple(sorted(hypothesis.effects))] = None
    return tuple(found)
