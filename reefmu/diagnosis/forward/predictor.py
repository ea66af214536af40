"""Torque of base curve plus effects over a trace, and its exact sensitivities to every parameter.

The order of things is that of `reefmu.model.assembly`. A state's equation is linear in the state, so a whole
trajectory is one bidiagonal system; a creeping offset, which feels the torque it changes, is found by Newton
steps on the trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable, Place, State
from ..preprocessing.trace import Blocks, Trace
from .base_curve import BaseCurve
from .effect_functions import Partials, Tangent, accumulate, effect_functions, is_zero, scaled
from .element import element_torque
from .parameter_layout import ParameterLayout
from .trajectory import exponentials, increments, propagate_tangent, recurrence
from .vectorised import Number

NEWTON_STEPS = 12
RELAXATIONS = 8
RUNAWAY = 10.0
"""Delayed twist, over the greatest twist of the record, at which a trajectory is held."""


@dataclass(frozen=True)
class Prediction:
    """torque: (n,) N.m; sensitivities: (n, k) by zero, base shape and effects' parameters, in that order;
    elastic: (n,) N.m; slope: (n,) stiffness, N.m/rad; contact: (n,) rad, twist that the contacts feel; clearance:
    (n,) m, beyond the drawn one. n: blocks where the predictor has blocks, else samples.
    """

    torque: Array
    sensitivities: Array
    elastic: Array
    slope: Array
    contact: Array
    clearance: Array


@dataclass(frozen=True)
class _Dual:
    value: Number
    tangent: Tangent

    def plus(self, other: _Dual, sign: float = 1.0) -> _Dual:
        tangent = dict(self.tangent)
        accumulate(tangent, other.tangent, sign)
        return _Dual(self.value + sign * other.value, tangent)


class Predictor:
    """Evaluates one set of effects on one trace; means over `blocks` of it, if given. size: of the parameters."""

    def __init__(self, trace: Trace, base: BaseCurve, names: Sequence[str], blocks: Blocks | None = None) -> None:
        self.trace, self.base, self.blocks = trace, base, blocks
        self.names = tuple(names)
        self.functions = [effect_functions(name) for name in self.names]
        self.layout = ParameterLayout(base.shape.size, self.names)
        self.slices = [self.layout.effects[name] for name in self.names]
        self.size = self.layout.size

    def __call__(self, parameters: Array) -> Prediction:
        """Torque and sensitivities for a parameter vector (size,): zero, base shape, effects' parameters."""
        run = _Run(self, np.asarray(parameters, float))
        torque, elastic, slope = run.result()
        n = len(self.trace)
        clearance = np.broadcast_to(np.asarray(run.clearance, float), n)
        blocks = self.blocks
        width = n if blocks is None else len(blocks.count)
        columns = np.zeros((self.size, width))
        for k, value in torque.tangent.items():
            columns[k] = blocks.mean(value) if blocks is not None and isinstance(value, np.ndarray) else value
        if blocks is None:
            return Prediction(np.asarray(torque.value), columns.T, elastic, slope, run.contact, clearance)
        mean = blocks.mean
        return Prediction(
            mean(np.asarray(torque.value)), columns.T, mean(elastic), mean(slope), mean(run.contact), mean(clearance)
        )


class _Run:
    """One evaluation."""

    def __init__(self, predictor: Predictor, parameters: Array) -> None:
        self.of, self.trace = predictor, predictor.trace
        self.p = [float(v) for v in parameters]
        self.n = len(self.trace)
        t = self.trace
        self.signals: dict[str, Number] = {
            "crank_angle": t.crank,
            "crank_speed": t.crank_speed,
            "output_angle": t.output,
            "output_speed": t.output_speed,
            "temperature": t.temperature,
            "twist_rate": t.twist_rate,
            "crank_direction": t.crank_direction,
            "output_direction": t.output_direction,
            "ratio": t.ratio,
            "twist": t.twist,
            "twist_direction": 0.0,
            "elastic_torque": 0.0,
        }
        self.states: list[list[Number]] = [[0.0] * len(k.effect.states) for k in predictor.functions]
        self.state_tangents: list[list[Tangent]] = [[{} for _ in k.effect.states] for k in predictor.functions]
        self.elastic_tangent: Tangent = {}
        self.contact: Array = t.twist
        self.clearance: Number = 0.0

    def result(self) -> tuple[_Dual, Array, Array]:
        shift = _Dual(self.p[0], {0: 1.0}).plus(self._total(Place.KINEMATIC, {}))
        twist = _Dual(self.trace.twist, {}).plus(shift, -1.0)
        path = self.trace.smooth_twist - shift.value
        self.signals["twist"] = twist.value
        self.signals["twist_direction"] = np.sign(increments(path, self.trace.start))
        self._path_states(path, twist.tangent)
        clearance = self._total(Place.CLEARANCE, twist.tangent)
        elastic, slope = self._contacts(twist, clearance)
        self.signals["elastic_torque"] = elastic.value
        self.elastic_tangent = elastic.tangent
        torque = elastic
        for place, sign in ((Place.PARALLEL, 1.0), (Place.OUTPUT, -1.0), (Place.SENSOR, 1.0)):
            torque = torque.plus(self._total(place, twist.tangent), sign)
        return torque, np.asarray(elastic.value), slope

    # -- pieces ---------------------------------------------------------------------------------------------

    def _parameters(self, index: int) -> list[float]:
        return self.p[self.of.slices[index]]

    def _dual(self, index: int, v: Partials, twist_tangent: Tangent) -> _Dual:
        tangent: Tangent = {}
        if not is_zero(v.by_twist):
            accumulate(tangent, twist_tangent, v.by_twist)
        if not is_zero(v.by_elastic):
            accumulate(tangent, self.elastic_tangent, v.by_elastic)
        first = self.of.slices[index].start
        accumulate(tangent, {first + k: value for k, value in v.by_parameters.items()})
        for s, value in v.by_states.items():
            accumulate(tangent, self.state_tangents[index][s], value)
        return _Dual(v.value, tangent)

    def _contribution(self, index: int, twist_tangent: Tangent) -> list[_Dual]:
        k = self.of.functions[index]
        found = k.contribution(self.signals, self._parameters(index), self.states[index])
        return [self._dual(index, v, twist_tangent) for v in found]

    def _total(self, place: Place, twist_tangent: Tangent) -> _Dual:
        total = _Dual(0.0, {})
        for index, k in enumerate(self.of.functions):
            if k.effect.place is place:
                total = total.plus(self._contribution(index, twist_tangent)[0])
        return total

    # -- states ---------------------------------------------------------------------------------------------

    def _begin(self, state: State) -> NDArray[np.bool_]:
        """Where a state starts anew: with every run, or with the record."""
        return self.trace.start if state.resets else self.trace.first

    def _path_states(self, path: Array, twist_tangent: Tangent) -> None:
        """Advance all states whose equations see no elastic torque."""
        t = self.trace
        for index, k in enumerate(self.of.functions):
            for s, state in enumerate(k.effect.states):
                if k.equations[s].depends_on_torque:
                    continue
                begin = self._begin(state)
                if state.independent_variable is IndependentVariable.TIME:
                    way = np.where(begin, 0.0, t.step)
                else:
                    way = increments(
                        {
                            IndependentVariable.TWIST: path,
                            IndependentVariable.CRANK: t.crank,
                            IndependentVariable.OUTPUT: t.output,
                        }[state.independent_variable],
                        begin,
                    )
                # A constant shift of the twist moves no path.
                moving = (
                    {}
                    if state.independent_variable is not IndependentVariable.TWIST
                    else {
                        i: np.sign(way) * increments(v, begin)
                        for i, v in twist_tangent.items()
                        if isinstance(v, np.ndarray)
                    }
                )
                self._advance(index, s, begin, np.abs(way), moving, twist_tangent)

    def _advance(
        self, index: int, s: int, begin: NDArray[np.bool_], length: Array, moving: Tangent, twist_tangent: Tangent
    ) -> None:
        k, first = self.of.functions[index], self.of.slices[index].start
        a, b = k.equations[s](self.signals, self._parameters(index), self.states[index])
        decay, mean, mean_slope = exponentials(a.value * length)
        x = recurrence(decay, [b.value * length * mean], begin)[0]
        before = np.concatenate([[0.0], x[:-1]])
        before[begin] = 0.0
        by_a = length * decay * before + b.value * length**2 * mean_slope
        by_b = length * mean
        tangent: Tangent = {}
        for v, by in ((a, by_a), (b, by_b)):
            accumulate(tangent, {first + i: value for i, value in v.by_parameters.items()}, by)
            if not is_zero(v.by_twist):
                accumulate(tangent, twist_tangent, by * v.by_twist)
        if moving:
            accumulate(tangent, moving, (a.value * before + b.value) * decay)
        self.states[index][s] = x
        self.state_tangents[index][s] = propagate_tangent(decay, tangent, begin)

    # -- contacts -------------------------------------------------------------------------------------------

    def _contacts(self, twist: _Dual, clearance: _Dual) -> tuple[_Dual, Array]:
        slow = [
            (i, s)
            for i, k in enumerate(self.of.functions)
            for s in range(len(k.effect.states))
            if k.equations[s].depends_on_torque
        ]
        if slow:
            for i, s in slow:
                self.states[i][s] = np.zeros(self.n)
            # Torque under the offset of the step before, as `advance` has it; then the states, then once more.
            for done in range(RELAXATIONS):
                last = [self.states[i][s] for i, s in slow]
                self._slow_step(twist, clearance, slow, tangents=False)
                moved = max(float(np.abs(self.states[i][s] - x).max()) for (i, s), x in zip(slow, last, strict=True))
                scale = max(float(np.abs(self.states[i][s]).max()) for i, s in slow)
                if done and moved <= 1e-6 * scale:
                    break
            self._slow_step(twist, clearance, slow, tangents=True)
        return self._solve(twist, clearance)

    def _slow_step(self, twist: _Dual, clearance: _Dual, slow: list[tuple[int, int]], tangents: bool) -> None:
        """One Newton step on the trajectories of the states along time; at last their tangents."""
        present, present_tangents = [list(x) for x in self.states], [list(t) for t in self.state_tangents]
        for i, s in slow:
            begin = self._begin(self.of.functions[i].effect.states[s])
            before = np.concatenate([[0.0], self.states[i][s][:-1]])
            before[begin] = 0.0
            self.states[i][s], self.state_tangents[i][s] = before, {}
        elastic, slope = self._solve(twist, clearance)
        self.signals["elastic_torque"] = elastic.value
        for i, s in slow:
            k, first = self.of.functions[i], self.of.slices[i].start
            a, b = k.equations[s](self.signals, self._parameters(i), self.states[i])
            begin = self._begin(k.effect.states[s])
            length = np.where(begin, 0.0, self.trace.step)
            decay, mean, mean_slope = exponentials(a.value * length)
            before = self.states[i][s]
            by_a = length * decay * before + b.value * length**2 * mean_slope
            by_b = length * mean
            by_torque = by_a * a.by_elastic + by_b * b.by_elastic
            feel: Number = 0.0
            if k.effect.place is Place.SERIES:
                offset = k.contribution(self.signals, self._parameters(i), self.states[i])[1]
                feel = -slope * offset.by_states.get(s, 0.0)
            # Beyond 1 the steps are too long for so soft a state, and it would run away: no fit goes there.
            rate = np.clip(decay + by_torque * feel, -1.0, 1.0)
            held = RUNAWAY * float(np.abs(self.trace.twist).max())
            x = recurrence(rate, [b.value * by_b - by_torque * feel * before], begin)[0]
            present[i][s] = np.clip(x, -held, held)
            if tangents:
                tangent = scaled(elastic.tangent, by_torque)
                for v, by in ((a, by_a), (b, by_b)):
                    accumulate(tangent, {first + j: value for j, value in v.by_parameters.items()}, by)
                    if not is_zero(v.by_twist):
                        accumulate(tangent, twist.tangent, by * v.by_twist)
                present_tangents[i][s] = propagate_tangent(rate, tangent, begin)
        self.states, self.state_tangents = present, present_tangents

    def _solve(self, twist: _Dual, clearance: _Dual) -> tuple[_Dual, Array]:
        """ElasticTorque torque with tangents, and stiffness with the series compliance."""
        pairs = [
            self._contribution(i, twist.tangent)
            for i, k in enumerate(self.of.functions)
            if k.effect.place is Place.SERIES
        ]
        lost = [
            self._contribution(i, twist.tangent)
            for i, k in enumerate(self.of.functions)
            if k.effect.place is Place.ELEMENT
        ]
        modulus = self._total(Place.MODULUS, twist.tangent)
        if not pairs:
            return self._contact(np.asarray(twist.value), twist.tangent, clearance, lost, modulus)
        compliance, offset = _Dual(0.0, {}), _Dual(0.0, {})
        for c, o in pairs:
            compliance, offset = compliance.plus(c), offset.plus(o)
        at = np.asarray(twist.value - offset.value)
        if not is_zero(compliance.value):
            reach = float(np.abs(self.trace.twist).max())
            for _ in range(NEWTON_STEPS):
                torque, stiffness = self._contact(at, None, clearance, lost, modulus)
                gap = at + compliance.value * torque.value + offset.value - twist.value
                step = gap / (1 + compliance.value * stiffness)
                at = at - step
                if np.abs(step).max() <= 1e-9 * reach:
                    break
        torque, stiffness = self._contact(at, {}, clearance, lost, modulus)
        # dT = dT|contact + K (d twist - d offset - T dC - C dT)
        soft = 1 / (1 + compliance.value * stiffness)
        tangent = dict(torque.tangent)
        accumulate(tangent, twist.tangent, stiffness)
        accumulate(tangent, offset.tangent, -stiffness)
        accumulate(tangent, compliance.tangent, -stiffness * torque.value)
        return _Dual(torque.value, scaled(tangent, soft)), stiffness * soft

    def _contact(
        self, at: Array, twist_tangent: Tangent | None, clearance: _Dual, lost: list[list[_Dual]], modulus: _Dual
    ) -> tuple[_Dual, Array]:
        """Torque and stiffness at a twist of the contacts themselves; no tangents if twist_tangent is None."""
        base = self.of.base
        self.contact, self.clearance = at, clearance.value
        shape = np.array(self.p[self.of.layout.shape])
        torque, stiffness, by_clearance, by_shape = base.elastic.evaluate(at, clearance.value, shape)
        parts = []
        for share, position in lost:
            assert base.element is not None
            t, k, c, b = element_torque(base.element, at, clearance.value, position.value)
            parts.append((share, position, t, b))
            torque, stiffness = torque - share.value * t, stiffness - share.value * k
            by_clearance = by_clearance - share.value * c
        scale, scale_slope = 1.0, 0.0
        if base.modulus is not None and modulus.tangent:
            error = float(modulus.value)
            scale = float(base.modulus.scale(error))
            scale_slope = float(np.imag(base.modulus.scale(error + 1e-30j)) / 1e-30)
        tangent: Tangent = {}
        if twist_tangent is not None:
            accumulate(tangent, twist_tangent, scale * stiffness)
            accumulate(tangent, clearance.tangent, scale * by_clearance)
            accumulate(tangent, modulus.tangent, scale_slope * torque)
            for k, column in enumerate(by_shape):
                accumulate(tangent, {1 + k: scale * column})
            for share, position, t, b in parts:
                accumulate(tangent, share.tangent, -scale * t)
                accumulate(tangent, position.tangent, -scale * share.value * b)
        return _Dual(scale * torque, tangent), scale * stiffness
