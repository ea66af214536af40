"""The stages of `reefmu.model.stages.order` over a whole trace, with exact sensitivities to every parameter."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...effects import Place
from ...model.stages.order import CONTACT_EQUILIBRIUM, KINEMATICS, OUTPUT, TORQUE_CHAIN, Stage, advance_order
from ..preprocessing.trace import Trace
from .effect_functions import Dual, EffectFunctions, Partials, Tangent, accumulate, is_zero
from .parameter_layout import ZERO
from .record_contacts import Coefficients, ContactOutputs, ContactPoint, RecordContacts
from .record_states import Kinematics, RecordStates, States
from .vectorised import Number

Signals = Mapping[str, Number]
Variables = dict[str, Any]
"""The variables of `reefmu.model.stages.order` by their names."""
_NONE: Tangent = {}


class MeasuredTorque(NamedTuple):
    """Variable y: the torque that the sensor reads, N.m, and its derivative, a number or (n,), by the torque that the
    base curve has at the twist of the contacts, all states held."""

    torque: Dual
    gain: Number


class _Contribution(NamedTuple):
    """What an effect contributes while it has these states: its expressions, and these with all derivatives."""

    states: tuple[Dual, ...]
    partials: list[Partials]
    duals: list[Dual]


class RecordStages:
    """The stages of some effects on a trace, every one the method of its name.

    functions: of the effects; slices, shape: indices of their parameters and of the base curve's in a vector p, which
    also holds the zero of the twist.
    """

    def __init__(
        self,
        trace: Trace,
        contacts: RecordContacts,
        functions: Sequence[EffectFunctions],
        slices: Sequence[slice],
        shape: slice,
    ) -> None:
        self.trace, self.functions, self.slices, self.shape = trace, functions, slices, shape
        self.record_contacts, self.states = contacts, RecordStates(trace, functions, slices)
        # The torque that states depend on follows from a whole trajectory: `advance_time` asks for it.
        advance = advance_order(
            angles=bool(self.states.along_angles),
            time=bool(self.states.in_time or self.states.by_torque),
            torque=False,
        )
        self._order = (KINEMATICS, *advance, *CONTACT_EQUILIBRIUM, OUTPUT)
        self._inputs: dict[str, Number] = {
            "crank_angle": trace.crank,
            "crank_speed": trace.crank_speed,
            "output_angle": trace.output,
            "output_speed": trace.output_speed,
            "temperature": trace.temperature,
            "twist_rate": trace.twist_rate,
            "crank_direction": trace.crank_direction,
            "output_direction": trace.output_direction,
            "ratio": trace.crank_factor,
            "twist_direction": trace.twist_direction,
            "elastic_torque": 0.0,
        }
        self._at = {
            place: [index for index, k in enumerate(functions) if k.effect.place is place]
            for place in {k.effect.place for k in functions}
        }
        self._known: dict[int, _Contribution] = {}

    def run(self, p: Sequence[float]) -> tuple[MeasuredTorque, ContactOutputs]:
        """The measured torque, and what the contacts give, for a vector of parameters."""
        self._known.clear()
        variables = self._chain(
            self._order, {"x": self.states.start, "u": self._inputs, "p": p, "dt": self.trace.step, "c": None}
        )
        return variables["y"], variables["c"]

    def _chain(self, order: Iterable[Stage], variables: Variables) -> Variables:
        """The variables after these stages."""
        variables = dict(variables)
        for stage in order:
            function = getattr(self, stage.name)
            variables[stage.writes] = function(*(variables[name] for name in stage.reads))
        return variables

    # -- stages -----------------------------------------------------------------------------------------------

    def kinematics(self, u: Signals, p: Sequence[float]) -> Kinematics:
        """The measured twist less its zero, which is a parameter, and the kinematic effects."""
        measured = Kinematics(Dual(self.trace.twist, {}), {**u, "twist": self.trace.twist})
        shift = Dual(p[ZERO], {ZERO: 1.0}).plus(self._total(Place.KINEMATIC, self.states.start, measured, p))
        twist = measured.twist.plus(shift, -1.0)
        return Kinematics(twist, {**u, "twist": twist.value})

    def advance_angles(self, x: States, _u: Signals, k: Kinematics, p: Sequence[float]) -> States:
        """See `RecordStates`."""
        return self.states.advance_angles(x, k, p)

    def coefficients(self, x: States, _u: Signals, k: Kinematics, p: Sequence[float]) -> Coefficients:
        """See `Coefficients`."""
        series = self._each(Place.SERIES, x, k, p)
        return Coefficients(
            _sum(compliance for compliance, _ in series) if series else None,
            tuple(missing for missing, _ in self._each(Place.ELEMENT, x, k, p)),
            self._total(Place.MODULUS, x, k, p),
            np.array(p[self.shape]),
        )

    def contact_point(self, x: States, _u: Signals, k: Kinematics, p: Sequence[float]) -> ContactPoint:
        """See `ContactPoint`."""
        return ContactPoint(
            k.twist,
            _sum(offset for _, offset in self._each(Place.SERIES, x, k, p)),
            self._total(Place.CLEARANCE, x, k, p),
            tuple(position for _, position in self._each(Place.ELEMENT, x, k, p)),
        )

    def contacts(self, q: ContactPoint, r: Coefficients) -> ContactOutputs:
        """See `RecordContacts`."""
        return self.record_contacts(q, r)

    def advance_time(self, x: States, u: Signals, k: Kinematics, _dt: object, p: Sequence[float], _c: object) -> States:
        """See `RecordStates`."""

        def contacts(states: States) -> ContactOutputs:
            return self._chain(CONTACT_EQUILIBRIUM, {"x": states, "u": u, "k": k, "p": p})["c"]

        return self.states.advance_time(x, k, p, contacts)

    def output(self, x: States, _u: Signals, k: Kinematics, p: Sequence[float], c: ContactOutputs) -> MeasuredTorque:
        """The torque at the end of the chain."""
        k = k._replace(signals={**k.signals, "elastic_torque": c.elastic.value})
        torque, by_elastic = c.elastic, 1.0
        for place, sign in TORQUE_CHAIN:
            torque = torque.plus(self._total(place, x, k, p, c.elastic.tangent), sign)
            by_elastic = by_elastic + sign * sum(
                self._known[index].partials[0].by_elastic for index in self._at.get(place, ())
            )
        return MeasuredTorque(torque, c.gain * by_elastic)

    # -- contributions of the effects -----------------------------------------------------------------------

    def _each(
        self, place: Place, x: States, k: Kinematics, p: Sequence[float], elastic: Tangent = _NONE
    ) -> list[list[Dual]]:
        """What every effect at a place contributes. elastic: derivatives of the elastic torque.

        Contributions stay known while the effect's own states do: the search for states that depend on the torque asks
        for them again and again.
        """
        found: list[list[Dual]] = []
        for index in self._at.get(place, ()):
            states, known = x[index], self._known.get(index)
            if known is None or known.states is not states:
                values = self.functions[index].contribution(k.signals, p[self.slices[index]], [s.value for s in states])
                duals = [self._dual(index, v, states, k.twist.tangent, elastic) for v in values]
                known = self._known[index] = _Contribution(states, values, duals)
            found.append(known.duals)
        return found

    def _total(self, place: Place, x: States, k: Kinematics, p: Sequence[float], elastic: Tangent = _NONE) -> Dual:
        """Sum of the contributions at a place."""
        return _sum(duals[0] for duals in self._each(place, x, k, p, elastic))

    def _dual(self, index: int, v: Partials, states: Sequence[Dual], twist: Tangent, elastic: Tangent) -> Dual:
        tangent: Tangent = {}
        if not is_zero(v.by_twist):
            accumulate(tangent, twist, v.by_twist)
        if not is_zero(v.by_elastic):
            accumulate(tangent, elastic, v.by_elastic)
        first = self.slices[index].start
        accumulate(tangent, {first + k: value for k, value in v.by_parameters.items()})
        for s, value in v.by_states.items():
            accumulate(tangent, states[s].tangent, value)
        return Dual(v.value, tangent)


def _sum(duals: Iterable[Dual]) -> Dual:
    total = Dual(0.0, {})
    for dual in duals:
        total = total.plus(dual)
    return total
