"""Hypotheses about what a model lacks, with their probabilities, and how well a record can tell effects apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

MAX_LEFT_OUT = 0.01
"""Total probability of the least likely hypotheses that diagnosis.json may leave out; fixed by its schema."""
PROBABILITY_DIGITS = 6
"""Decimals of probabilities in diagnosis.json. Every combination of up to three of the seventeen effects, with and
without something unnamed, is 1668 hypotheses, whose rounding errors then add up to less than 0.001."""
MATRIX_DIGITS = 4
"""Decimals of the isolability matrix in diagnosis.json, finer than a simulation resolves; chosen by judgement."""

MAX_SHOWN, MIN_SHOWN = 4, 0.005
"""Most hypotheses that notebooks and the command line show, and the smallest probability of those after the first: what
would round to 0 %. The number is chosen by judgement."""


@dataclass(frozen=True)
class Hypothesis:
    """One explanation of a record.

    effects: names of the effects that the model lacks; unnamed: whether it also lacks something that no effect
    describes; probability: of this explanation given the record, 0 ... 1. Without effects, `unnamed` means that
    something unnamed alone is missing; otherwise nothing is missing.
    """

    effects: tuple[str, ...]
    unnamed: bool
    probability: float

    def to_dict(self) -> dict[str, Any]:
        """The entry of this hypothesis in diagnosis.json.

        >>> Hypothesis(("preload", "hysteresis"), True, 0.25).to_dict()
        {'effects': ['hysteresis', 'preload'], 'probability': 0.25, 'unnamed': True}
        >>> Hypothesis((), True, 0.25).to_dict()
        {'effects': None, 'probability': 0.25}
        """
        alone = self.unnamed and not self.effects
        entry = {
            "effects": None if alone else sorted(self.effects),
            "probability": round(float(self.probability), PROBABILITY_DIGITS),
        }
        return entry | ({"unnamed": True} if self.unnamed and not alone else {})


@dataclass(frozen=True)
class IsolabilityMatrix:
    """How well a record tells effects apart.

    names: (n,) of effects; matrix: (n, n), the probability that the diagnosis of this very record names effect j
    (column) when effect i (row) is missing at its typical size. What a row lacks to 1 is the probability that none of
    them is named.
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

    def to_dict(self) -> dict[str, Any]:
        """The entry in diagnosis.json."""
        rows = [[round(float(p), MATRIX_DIGITS) for p in row] for row in self.matrix]
        return {"names": list(self.names), "matrix": rows}


def merged(hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Every hypothesis once, with the sum of its probabilities: whether something unnamed shows makes no other one.

    >>> [h.probability for h in merged([Hypothesis(("wear",), True, 0.25), Hypothesis(("wear",), True, 0.5)])]
    [0.75]
    """
    total: dict[tuple[frozenset[str], bool], Hypothesis] = {}
    for h in hypotheses:
        key = frozenset(h.effects), h.unnamed
        total[key] = replace(h, probability=h.probability + (total[key].probability if key in total else 0.0))
    return tuple(total.values())


def ranked(hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """The hypotheses by falling probability; of equally probable ones, to `PROBABILITY_DIGITS`, the simplest comes
    first, whatever the last digits are on this machine.

    >>> [h.effects for h in ranked([Hypothesis(("wear",), False, 0.25 + 1e-12), Hypothesis(("creep",), False, 0.25)])]
    [('creep',), ('wear',)]
    """

    def key(h: Hypothesis) -> tuple[float, int, list[str]]:
        return -round(h.probability, PROBABILITY_DIGITS), len(h.effects) + h.unnamed, sorted(h.effects)

    return tuple(sorted(hypotheses, key=key))


def likeliest(hypotheses: Sequence[Hypothesis], count: int = MAX_SHOWN) -> tuple[Hypothesis, ...]:
    """The most probable hypotheses, `count` at most, without those below `MIN_SHOWN`."""
    return tuple(h for k, h in enumerate(ranked(hypotheses)[:count]) if k == 0 or h.probability >= MIN_SHOWN)


def reported_hypotheses(hypotheses: Sequence[Hypothesis]) -> list[dict[str, Any]]:
    """The entries of diagnosis.json by falling probability, without the last ones that add up to `MAX_LEFT_OUT` at
    most."""
    entries: list[dict[str, Any]] = []
    total = 0.0
    for hypothesis in ranked(hypotheses):
        if total >= 1 - MAX_LEFT_OUT:
            break
        entry = hypothesis.to_dict()
        entries.append(entry)
        total += entry["probability"]
    return entries


def effect_probability(name: str, hypotheses: Sequence[Hypothesis]) -> float:
    """Probability that an effect is missing: the sum over the hypotheses that contain it.

    >>> effect_probability("creep", [Hypothesis(("creep",), False, 0.5), Hypothesis(("creep", "wear"), True, 0.25)])
    0.75
    """
    return float(sum(h.probability for h in hypotheses if name in h.effects))


def hypothesis_text(hypothesis: Hypothesis) -> str:
    """A hypothesis in words.

    >>> hypothesis_text(Hypothesis(("torque_sensor_offset", "hysteresis"), True, 0.1))
    'hysteresis, torque sensor offset and something without a name'
    >>> hypothesis_text(Hypothesis((), False, 0.1))
    'nothing is missing'
    """
    parts = [name.replace("_", " ") for name in sorted(hypothesis.effects)]
    parts += ["something without a name"] if hypothesis.unnamed else []
    if not parts:
        return "nothing is missing"
    return listed(parts)


def listed(parts: Sequence[str]) -> str:
    """Words as a list in a sentence.

    >>> listed(["a"]), listed(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def probability_text(probability: float) -> str:
    """A probability in whole percent, never as certainty.

    >>> [probability_text(p) for p in (0.9996, 0.94, 0.001)]
    ['> 99 %', '94 %', '< 1 %']
    """
    percent = round(100 * probability)
    return "< 1 %" if percent < 1 else "> 99 %" if percent > 99 else f"{percent} %"
