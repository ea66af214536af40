"""A power law with a dead band whose exponent is fixed: at a number, or at one value for several records of a gear.

A free exponent absorbs what play does to a curve: both bend it near zero torque. A gear has one exponent whatever its
preload, so that several records at several preloads share it, and what differs between them is the play. The play is a
shape parameter of this base curve and fitted with every set of effects; backlash and preload are then no effects of
their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.errors import expect
from stiffness_model.numerics.arrays import Array

from ..record import Record
from .estimation.search import base_fit
from .forward.base_curve import PLAY, BaseCurve, ShapeParameters, power_base
from .forward.elastic import ElasticTorque
from .forward.vectorised import Number
from .preparation import prepare_problem
from .preprocessing.audit import audit, ratio_from_angles
from .preprocessing.trace import Trace, make_trace

MIN_EXPONENT, MAX_EXPONENT = 1.0, 2.0
"""Bounds of a shared exponent. A spring has 1, a line contact 10/9, a ball 3/2, and no contact softens under load; the
upper bound is chosen by judgement."""
POINT_CONTACT_EXPONENT = 1.5
"""Exponent where no record allows a diagnosis: that of a ball, after Hertz."""
EXPONENT_GRID = (1.0, 1.1, 1.25, 1.5, 1.75, 2.0)
"""Exponents at which every record is fitted; chosen by judgement, dense enough for a parabola between them."""
MIN_FIXED, MAX_FIXED = 0.3, 6.0
"""Bounds of an exponent that the caller fixes, those of a free exponent; chosen by judgement."""
FRICTION_EFFECTS = ("load_dependent_hysteresis", "hysteresis")
"""Effects that are fitted together with exponent and play, since friction masks both."""
PLAY_STARTS = (0.06, 0.2)
"""Starting values of the play, over the greatest twist; chosen by judgement, two against local minima."""
FRICTION_STARTS = (0.2, 0.05, 0.05, 0.01)
"""Starting values of the friction: share of the elastic torque, its presliding twist over the greatest twist, torque
over full torque, its presliding twist over the greatest twist; chosen by judgement."""
MAX_PLAY = 0.9
"""Upper bound of the play, over the greatest twist; chosen by judgement, so that some loaded twist is left."""


@dataclass(frozen=True)
class SharedExponent:
    """The exponent that several records share; low, high: its range when each record in turn is left out."""

    value: float
    low: float
    high: float

    @property
    def at_bound(self) -> bool:
        """Whether the value is at `MIN_EXPONENT` or `MAX_EXPONENT`."""
        return bool(self.bound)

    @property
    def bound(self) -> str:
        """ "low" at `MIN_EXPONENT`, "high" at `MAX_EXPONENT`, else ""."""
        return "low" if self.value == MIN_EXPONENT else "high" if self.value == MAX_EXPONENT else ""

    def __str__(self) -> str:
        text = f"one exponent for all records: {self.value:.3g}"
        if self.at_bound:
            text += f", at the bound of {MIN_EXPONENT:g} ... {MAX_EXPONENT:g}"
        return text + f"; leaving out one record each: {self.low:.3g} ... {self.high:.3g}"


@dataclass(frozen=True)
class DeadBandTorque:
    """An elastic torque behind a play to either side, rad, which is the last of its shape parameters.

    lever: m/rad, clearance over the play that it makes.
    """

    inner: ElasticTorque
    lever: float

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`; shape: that of the inner torque, then the play."""
        value, by_twist, slope, by_shape = self.inner.evaluate(twist, clearance + self.lever * shape[-1], shape[:-1])
        return value, by_twist, slope, [*by_shape, self.lever * slope]


def fixed_exponent_base(exponent: float | SharedExponent) -> Callable[[Trace], BaseCurve]:
    """A function that makes the power law with a dead band for a record's traces.

    Raises `InputError` for an exponent outside 0.3 ... 6.
    """
    bound = ""
    if isinstance(exponent, SharedExponent):
        exponent, bound = exponent.value, exponent.bound
    expect(
        MIN_FIXED <= exponent <= MAX_FIXED,
        f"an exponent within {MIN_FIXED:g} ... {MAX_FIXED:g}",
        exponent,
        "exponent",
    )

    def make(trace: Trace) -> BaseCurve:
        base = power_base(trace)

        def with_play(values: Array, play: float) -> Array:
            return np.array([values[0], exponent, play])

        return replace(
            base,
            elastic=DeadBandTorque(base.elastic, base.lever),
            shape=ShapeParameters(
                (*base.shape.names, PLAY),
                with_play(base.shape.start, PLAY_STARTS[0] * base.max_twist),
                with_play(base.shape.low, 0.0),
                with_play(base.shape.high, MAX_PLAY * base.max_twist),
                np.full(3, np.inf),
                exponent_bound=bound,
            ),
        )

    return make


def shared_exponent(records: Sequence[Record], progress: Callable[[str, float], None] | None = None) -> SharedExponent:
    """The exponent that fits all records best, each with its own scale, play and friction.

    Every record has the same weight, through the logarithm of its lowest cost. Between the exponents tried the sum is
    interpolated by a parabola. Records that allow no diagnosis are left out; without any other the exponent is that of
    a point contact. progress: called with the present stage and the share done.
    """
    usable = [(record, ratio) for record in records if not audit(record, ratio := ratio_from_angles(record)).defects]
    if not usable:
        return SharedExponent(POINT_CONTACT_EXPONENT, POINT_CONTACT_EXPONENT, POINT_CONTACT_EXPONENT)
    costs = np.empty((len(usable), len(EXPONENT_GRID)))
    for i, (record, ratio) in enumerate(usable):
        trace = make_trace(record, ratio)
        for k, exponent in enumerate(EXPONENT_GRID):
            if progress:
                progress("one exponent for all records", (i * len(EXPONENT_GRID) + k) / costs.size)
            costs[i, k] = np.log(lowest_cost(record, trace, exponent))
    value = _interpolated_minimum(costs.sum(axis=0))
    others: list[float] = []
    if len(usable) > 1:
        others = [_interpolated_minimum(np.delete(costs, i, axis=0).sum(axis=0)) for i in range(len(usable))]
    return SharedExponent(value, min([value, *others]), max([value, *others]))


def lowest_cost(record: Record, trace: Trace, exponent: float) -> float:
    """Lowest cost (-2 log likelihood) of play and friction fitted to a record with this exponent; trace: of the
    record."""
    base = fixed_exponent_base(exponent)(trace)
    problem = prepare_problem(record, trace, base)
    # Those of the rig, scale and exponent; then play and friction.
    fitted = base_fit(problem).parameters[:-1]
    friction = np.array(FRICTION_STARTS) * [1.0, base.max_twist, base.full_torque, base.max_twist]
    starts = [np.concatenate([fitted, [share * base.max_twist], friction]) for share in PLAY_STARTS]
    return min(problem.fit_from(FRICTION_EFFECTS, start).cost for start in starts)


def _interpolated_minimum(costs: Array) -> float:
    """The exponent at which a parabola through the lowest cost and its neighbours is lowest."""
    k = int(costs.argmin())
    if k in (0, len(EXPONENT_GRID) - 1):
        return EXPONENT_GRID[k]
    a, b, _ = np.polyfit(np.array(EXPONENT_GRID[k - 1 : k + 2]), costs[k - 1 : k + 2], 2)
    return float(np.clip(-b / (2 * a), EXPONENT_GRID[k - 1], EXPONENT_GRID[k + 1]))
