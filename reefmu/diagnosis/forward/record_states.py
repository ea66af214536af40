"""The stages that advance the states, over a whole trace.

A state's equation is linear in the state, so that a whole trajectory is one bidiagonal system. A creeping offset
changes the torque that it depends on, and is found by Newton steps on the trajectory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable, Place, State
from ..preprocessing.trace import Trace
from .effect_functions import Dual, EffectFunctions, Tangent, accumulate, is_zero, scaled
from .record_contacts import ContactOutputs
from .trajectory import exponentials, increments, propagate_tangent, recurrence
from .vectorised import Number

RELAXATIONS = 8
"""Most Newton steps on the trajectories of states that depend on the torque; chosen by judgement."""
RELAXATION_TOLERANCE = 1e-6
"""Change of those trajectories, over their greatest value, at which the steps end; chosen by judgement."""
RUNAWAY = 10.0
"""Delayed twist, over the greatest twist of the record, at which a trajectory is held; chosen by judgement."""

States = tuple[tuple[Dual, ...], ...]
"""Variable x: the trajectories of every effect's states, zero or (n,), in the effects' order."""


class Kinematics(NamedTuple):
    """Variable k: twist of the contacts and all compliances, rad; the signals that effects may read after it."""

    twist: Dual
    signals: Mapping[str, Number]


class RecordStates:
    """The states of some effects on a trace.

    functions: of the effects; slices: where their parameters stand in a vector p. start: all states at zero.
    along_angles, in_time, by_torque: effect and number of the states that evolve along an angle, in time, and in time
    depending on the torque.
    """

    def __init__(self, trace: Trace, functions: Sequence[EffectFunctions], slices: Sequence[slice]) -> None:
        self.trace, self.functions, self.slices = trace, functions, slices
        self.start: States = tuple(tuple(Dual(0.0, {}) for _ in k.effect.states) for k in functions)
        self.along_angles = self._evolving(in_time=False)
        self.in_time = self._evolving(in_time=True)
        self.by_torque = self._evolving(in_time=True, by_torque=True)
        self._last: tuple[Sequence[float], dict[tuple[int, int], Dual]] = ((), {})
        self._steps: dict[tuple[int, int], tuple[Number, tuple[Array, Array, Array, Array]]] = {}

    def _evolving(self, *, in_time: bool, by_torque: bool = False) -> list[tuple[int, int]]:
        return [
            (index, s)
            for index, k in enumerate(self.functions)
            for s, state in enumerate(k.effect.states)
            if (state.independent_variable is IndependentVariable.TIME) == in_time
            and k.equations[s].depends_on_torque == by_torque
        ]

    def advance_angles(self, x: States, k: Kinematics, p: Sequence[float]) -> States:
        """Trajectories of the states that evolve along an angle."""
        t = self.trace
        angles = {
            IndependentVariable.TWIST: t.smooth_twist,
            IndependentVariable.CRANK: t.crank,
            IndependentVariable.OUTPUT: t.output,
        }
        changed: dict[tuple[int, int], Dual] = {}
        for index, s in self.along_angles:
            state = self.functions[index].effect.states[s]
            way = increments(angles[state.independent_variable], self._begin(state))
            changed[index, s] = self._advance(x, k, p, (index, s), np.abs(way))
        return _replaced(x, changed)

    def advance_time(
        self,
        x: States,
        k: Kinematics,
        p: Sequence[float],
        contacts: Callable[[States], ContactOutputs],
    ) -> States:
        """Trajectories of the states that evolve in time. contacts: contact outputs at given states."""
        independent = {
            at: self._advance(x, k, p, at, np.where(begin, 0.0, self.trace.step))
            for at, begin in self._with_begin(self.in_time)
        }
        x = _replaced(x, independent)
        dependent = list(self._with_begin(self.by_torque))
        if not dependent:
            return x
        x, is_converged = self._extrapolated(x, p), True
        for _ in range(RELAXATIONS):
            last = [x[i][s].value for (i, s), _ in dependent]
            before = self._shifted(x, dependent)
            x = self._relaxed(x, before, k, p, contacts(before), tangents=False)
            now = [x[i][s].value for (i, s), _ in dependent]
            moved = max(float(np.abs(a - b).max()) for a, b in zip(now, last, strict=True))
            if moved <= RELAXATION_TOLERANCE * max(float(np.abs(a).max()) for a in now):
                break
        else:
            is_converged = False
        before = self._shifted(x, dependent)
        x = self._relaxed(x, before, k, p, contacts(before), tangents=True)
        self._last = (list(p), {at: x[at[0]][at[1]] for at in self.by_torque}) if is_converged else ((), {})
        return x

    def _extrapolated(self, x: States, p: Sequence[float]) -> States:
        """The states with a first guess of those that depend on the torque: to first order about the last result.

        The Newton steps converge to the same trajectory from any guess; fits move in small steps, and from a near one
        fewer are needed.
        """
        changed: dict[tuple[int, int], Dual] = {}
        for at, found in self._last[1].items():
            guess = found.value + sum(v * (p[k] - self._last[0][k]) for k, v in found.tangent.items())
            if np.isfinite(guess).all():
                changed[at] = Dual(self._held(guess), {})
        return _replaced(x, changed)

    def _time_steps(
        self, at: tuple[int, int], rate: Number, begin: NDArray[np.bool_]
    ) -> tuple[Array, Array, Array, Array]:
        """Lengths (n,) of the steps in time, s, and `exponentials` of `rate` times these; kept while it is the same."""
        if at not in self._steps or not np.array_equal(self._steps[at][0], rate):
            length = np.where(begin, 0.0, self.trace.step)
            self._steps[at] = rate, (length, *exponentials(rate * length))
        return self._steps[at][1]

    def _held(self, trajectory: Array) -> Array:
        """A trajectory (n,), rad, within bounds from which a fit can return."""
        held = RUNAWAY * float(np.abs(self.trace.twist).max())
        return np.clip(trajectory, -held, held)

    def _shifted(self, x: States, dependent: Sequence[tuple[tuple[int, int], NDArray[np.bool_]]]) -> States:
        """The states whose torque they depend on is that under the offset of the sample before, as in the model."""
        return _replaced(x, {(i, s): Dual(_before(x[i][s].value, begin), {}) for (i, s), begin in dependent})

    def _relaxed(
        self,
        x: States,
        before: States,
        k: Kinematics,
        p: Sequence[float],
        c: ContactOutputs,
        *,
        tangents: bool,
    ) -> States:
        """One Newton step on the trajectories that depend on the torque; with tangents at last."""
        signals = {**k.signals, "elastic_torque": c.elastic.value}
        changed: dict[tuple[int, int], Dual] = {}
        for (i, s), begin in self._with_begin(self.by_torque):
            function, parameters, first = self.functions[i], p[self.slices[i]], self.slices[i].start
            values = [state.value for state in before[i]]
            a, b = function.equations[s](signals, parameters, values)
            length, decay, mean, mean_slope = self._time_steps((i, s), a.value, begin)
            by_a = length * decay * values[s] + b.value * length**2 * mean_slope
            by_b = length * mean
            by_torque = by_a * a.by_elastic + by_b * b.by_elastic
            relief: Number = 0.0
            if function.effect.place is Place.SERIES:
                offset = function.contribution(signals, parameters, values)[1]
                relief = -c.stiffness * offset.by_states.get(s, 0.0)
            # Beyond 1 the steps are too long for so soft a state, and it would run away: no fit goes there.
            rate = np.clip(decay + by_torque * relief, -1.0, 1.0)
            trajectory = recurrence(rate, [b.value * by_b - by_torque * relief * values[s]], begin)[0]
            tangent = x[i][s].tangent
            if tangents:
                tangent = scaled(c.elastic.tangent, by_torque)
                for v, by in ((a, by_a), (b, by_b)):
                    accumulate(tangent, {first + j: value for j, value in v.by_parameters.items()}, by)
                    if not is_zero(v.by_twist):
                        accumulate(tangent, k.twist.tangent, by * v.by_twist)
                tangent = propagate_tangent(rate, tangent, begin)
            changed[i, s] = Dual(self._held(trajectory), tangent)
        return _replaced(x, changed)

    def _advance(
        self,
        x: States,
        k: Kinematics,
        p: Sequence[float],
        at: tuple[int, int],
        length: Array,
    ) -> Dual:
        """One trajectory over steps of these lengths (n,)."""
        i, s = at
        function, first = self.functions[i], self.slices[i].start
        begin = self._begin(function.effect.states[s])
        a, b = function.equations[s](k.signals, p[self.slices[i]], [state.value for state in x[i]])
        decay, mean, mean_slope = exponentials(a.value * length)
        initial = self._initial(function.effect.states[s])
        trajectory = recurrence(decay, [b.value * length * mean], begin, initial)[0]
        before = _before(trajectory, begin)
        by_a = length * decay * before + b.value * length**2 * mean_slope
        by_b = length * mean
        tangent: Tangent = {}
        for v, by in ((a, by_a), (b, by_b)):
            accumulate(tangent, {first + j: value for j, value in v.by_parameters.items()}, by)
            if not is_zero(v.by_twist):
                accumulate(tangent, k.twist.tangent, by * v.by_twist)
        return Dual(trajectory, propagate_tangent(decay, tangent, begin))

    def _begin(self, state: State) -> NDArray[np.bool_]:
        """Where a state starts anew: with every run, or with the record."""
        return self.trace.start if state.resets else self.trace.first

    def _initial(self, state: State) -> float | Array:
        """Where a state starts: (runs, 1) friction that is built up, all else at zero."""
        built_up = self.trace.friction.get(state.independent_variable) if state.is_share else None
        return 0.0 if built_up is None else built_up[:, None]

    def _with_begin(self, states: Sequence[tuple[int, int]]) -> Iterator[tuple[tuple[int, int], NDArray[np.bool_]]]:
        return ((at, self._begin(self.functions[at[0]].effect.states[at[1]])) for at in states)


def _replaced(x: States, changed: Mapping[tuple[int, int], Dual]) -> States:
    """The states with other trajectories; effects without a change stay the same objects."""
    touched = {index for index, _ in changed}
    return tuple(
        tuple(changed.get((index, s), dual) for s, dual in enumerate(duals)) if index in touched else duals
        for index, duals in enumerate(x)
    )


def _before(trajectory: Number, begin: NDArray[np.bool_]) -> Array:
    """A trajectory (n,) one sample earlier, zero where it begins."""
    values = np.broadcast_to(np.asarray(trajectory, float), begin.shape)
    before = np.concatenate([[0.0], values[:-1]])
    before[begin] = 0.0
    return before
