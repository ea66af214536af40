"""A power law with a dead band, its exponent held: at a number, or at one for several records of the same gear.

A free exponent takes over what play does to a curve: both bend it near zero torque. A gear has one exponent
whatever its preload, so several records at several preloads share it, and what differs between them is the play.
The play is part of this base and fitted with every candidate; backlash and preload are then no effects of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.errors import expect
from stiffness_model.numerics.arrays import Array

from ..record import Record
from .estimation.least_squares import Fit
from .estimation.search import base_fit
from .forward.base_curve import BaseCurve, ShapeParameters, power_base
from .preprocessing.trace import Trace, make_trace

LEAST, MOST = 1.0, 2.0
"""Bounds of a shared exponent: a spring 1, a line contact 10/9, a ball 3/2; no contact softens under load."""
BALL = 1.5
GRID = (1.0, 1.1, 1.25, 1.5, 1.75, 2.0)
LOW, HIGH = 0.3, 6.0
"""Bounds of an exponent that is held."""
PARTNERS = ("load_dependent_hysteresis", "hysteresis")
"""Fitted beside the exponent and the play: the friction that hides them."""
PLAYS = (0.06, 0.2)
"""Starts of the play, over the reach of the twist."""
PLAY = "play [rad]"
"""Name of the base parameter: play to either side."""


@dataclass(frozen=True)
class SharedExponent:
    """value; low, high: range when each record in turn is left out."""

    value: float
    low: float
    high: float

    @property
    def at_bound(self) -> bool:
        """Whether it stands at `LEAST` or `MOST`."""
        return self.value in (LEAST, MOST)

    def __str__(self) -> str:
        text = f"one exponent for all records: {self.value:.3g}"
        if self.at_bound:
            text += f", at the bound of {LEAST:g} ... {MOST:g}"
        return text + f"; leaving out one record each: {self.low:.3g} ... {self.high:.3g}"


@dataclass(frozen=True)
class DeadBandTorque:
    """Another elastic torque behind a play to either side, rad: the last of the base parameters.

    lever: m/rad, between a clearance and the play that it makes.
    """

    inner: ElasticTorque
    lever: float

    def evaluate(self, twist: Array, clearance: Number, shape: Array) -> tuple[Array, Array, Array, list[Array]]:
        """See `ElasticTorque`; shape is that of the inner torque and the play."""
        value, by_twist, by_clearance, by_shape = self.inner.evaluate(
            twist, clearance + self.lever * shape[-1], shape[:-1]
        )
        return value, by_twist, by_clearance, [*by_shape, self.lever * by_clearance]


def fixed_exponent_base(exponent: float) -> Callable[[Trace], BaseCurve]:
    """Makes a power law base with a dead band, whose exponent is held at a value within 0.3 ... 6."""
    expect(LOW <= exponent <= HIGH, f"an exponent within {LOW:g} ... {HIGH:g}", exponent, "exponent")

    def make(trace: Trace) -> BaseCurve:
        base = power_base(trace)

        def with_play(values: Array, play: float) -> Array:
            return np.array([values[0], exponent, play])

        return replace(
            base,
            elastic=DeadBandTorque(base.elastic, base.lever),
            shape=ShapeParameters(
                (*base.shape.names, PLAY),
                with_play(base.shape.start, PLAYS[0] * base.max_twist),
                with_play(base.shape.low, 0.0),
                with_play(base.shape.high, 0.9 * base.max_twist),
                np.full(3, np.inf),
            ),
        )

    return make


def shared_exponent(records: Sequence[Record], progress: Callable[[str, float], None] | None = None) -> SharedExponent:
    """The exponent that fits all records best, each with its own scale, play and friction.

    Every record counts the same: by the logarithm of what its best fit leaves. Between the grid's values the sum is
    taken as a parabola. Records that allow no diagnosis do not count; without another the exponent is that of a ball.
    """
    sound = [(record, ratio) for record in records if not audit(record, ratio := ratio_from_angles(record)).defects]
    if not sound:
        return SharedExponent(BALL, BALL, BALL)
    costs = np.empty((len(sound), len(GRID)))
    for i, (record, ratio) in enumerate(sound):
        trace = make_trace(record, ratio)
        for k, exponent in enumerate(GRID):
            if progress:
                progress("one exponent for all records", (i * len(GRID) + k) / costs.size)
            costs[i, k] = np.log(best_cost(record, trace, exponent))
    value = _least(costs.sum(axis=0))
    others = [_least(np.delete(costs, i, axis=0).sum(axis=0)) for i in range(len(sound))] if len(sound) > 1 else []
    return SharedExponent(value, min([value, *others]), max([value, *others]))


def best_cost(record: Record, trace: Trace, exponent: float) -> float:
    """What the best fit of play and friction to a record with these traces leaves with the exponent held."""

    base = fixed_exponent_base(exponent)(trace)
    problem = prepare_problem(record, trace, base)
    first = base_fit(problem)
    fits: list[Fit] = []
    for share in PLAYS:
        # Zero, scale, exponent, play; friction over load with its presliding, friction with its presliding.
        start = [
            *first.parameters[:3],
            share * base.max_twist,
            0.2,
            0.05 * base.max_twist,
            0.05 * base.full_torque,
            0.01 * base.max_twist,
        ]
        fits.append(problem.fit_from(PARTNERS, np.array(start)))
    return min(fit.cost for fit in fits)


def _least(costs: Array) -> float:
    """Where a curve through the grid is least."""
    k = int(costs.argmin())
    if k in (0, len(GRID) - 1):
        return GRID[k]
    a, b, _ = np.polyfit(np.array(GRID[k - 1 : k + 2]), costs[k - 1 : k + 2], 2)
    return float(np.clip(-b / (2 * a), GRID[k - 1], GRID[k + 1]))
