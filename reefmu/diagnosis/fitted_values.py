"""Fitted parameters with their intervals: of named effects, those that stopped at a bound, and sizes by amplitude."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Value:
    """One fitted parameter with its 95 % interval low ... high.

    warning: why it is uncertain, "" if it is not; bound: "low" or "high" if the fit stopped at that bound of its range.
    The interval is then one-sided: it ends at the bound, beyond which the record asks for a value.
    """

    value: float
    low: float
    high: float
    unit: str
    warning: str = ""
    bound: str = ""


@dataclass(frozen=True)
class ParameterAtBound:
    """A parameter of the base curve ("exponent") or of an effect ("hysteresis.presliding") that stopped at a bound.

    bound: "low" or "high"; low, high: of its one-sided 95 % interval, None on the side of the bound, and on both sides
    if the bound is that of an earlier fit; meaning: what it says of the record.
    """

    parameter: str
    bound: str
    value: float
    low: float | None
    high: float | None
    unit: str
    meaning: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that is missing in the model; share: part of the systematic gap that it removes; probability: sum over
    the hypotheses that contain it, 0 where none were compared."""

    name: str
    parameters: dict[str, Value]
    share: float
    probability: float = 0.0


@dataclass(frozen=True)
class AmplitudeSize:
    """Size of an effect in the cycles of one amplitude, N.m: mean and 95 % interval over that number of cycles."""

    amplitude: float
    value: float
    low: float
    high: float
    cycles: int


@dataclass(frozen=True)
class AmplitudeTest:
    """Sizes of one parameter by amplitude, smallest first. p: that they are equal but for the scatter of cycles, times
    the number of parameters that are tested (Bonferroni); power, power_low, power_high: of the amplitude with which the
    size grows from the smallest to the largest, with its 95 % interval, None where a size is not positive; laws: those
    that would reconcile the sizes.
    """

    effect: str
    parameter: str
    unit: str
    sizes: tuple[AmplitudeSize, ...]
    p: float
    power: float | None
    power_low: float | None
    power_high: float | None
    laws: tuple[str, ...]
