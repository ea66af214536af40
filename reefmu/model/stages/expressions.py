"""The stages without states as CasADi expressions: kinematics, coefficients, contact point and outputs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup

from ...effects import Effect, IndependentVariable, Place, Signals
from ..signals import INPUT_NAMES, outputs_of
from .order import CONTACT_OUTPUTS, TORQUE_CHAIN, coefficient_names, contact_point_names, stored_angles


class DriveExpressions:
    """Symbols of one model, named as in `order`, and the expressions of its stages on them."""

    def __init__(self, lookup: Lookup, effects: Sequence[Effect], *, individual: bool) -> None:
        self.effects, self.individual = tuple(effects), individual
        places = [effect.place for effect in effects]
        self.outputs = outputs_of(has_contacts=lookup.has_contacts)
        self.modulus = lookup.modulus if Place.MODULUS in places else None
        self.angles = stored_angles(effects)
        elements = max(1, places.count(Place.ELEMENT))
        self.point_names = contact_point_names(elements, individual=individual)
        self.coefficient_names = coefficient_names(elements)
        sizes = {
            "x": len(self.angles) + sum(len(e.states) for e in effects),
            "u": len(INPUT_NAMES),
            "p": 2 + sum(len(e.parameters) for e in effects),
            "dt": 1,
            "k": 2,
            "r": len(self.coefficient_names),
            "q": len(self.point_names),
            "c": len(CONTACT_OUTPUTS),
        }
        self.symbols: dict[str, ca.MX] = {name: ca.MX.sym(name, size) for name, size in sizes.items()}
        self.x, self.u, self.p, self.dt, self.k, self.c = (self.symbols[n] for n in ("x", "u", "p", "dt", "k", "c"))
        self.ratio, self.band = self.p[0], self.p[1]
        self.values: dict[str, dict[str, ca.MX]] = {}
        at = 2
        for effect in effects:
            self.values[effect.name] = {q.name: self.p[at + k] for k, q in enumerate(effect.parameters)}
            at += len(effect.parameters)

    # -- signals, states and sums -------------------------------------------------------------------------

    @cached_property
    def _input_signals(self) -> Signals:
        """Signals of the inputs alone, the twist without the kinematic effects; directions are those of the speeds."""
        crank, crank_w, output, output_w, temperature = (self.u[k] for k in range(len(INPUT_NAMES)))
        twist_rate = crank_w / self.ratio - output_w
        return Signals(
            crank,
            crank_w,
            output,
            output_w,
            temperature,
            crank / self.ratio - output,
            twist_rate,
            ca.sign(twist_rate),
            ca.sign(crank_w),
            ca.sign(output_w),
            None,
            self.ratio,
        )

    @property
    def signals(self) -> Signals:
        """Signals of the inputs with the twist of the stage `kinematics`."""
        return self._input_signals._replace(twist=self.k[0])

    @property
    def twist_by_crank(self) -> ca.MX:
        """Derivative of that twist by the crank's angle; that by the output's is -1."""
        return self.k[1]

    def angle(self, variable: IndependentVariable) -> ca.MX:
        """The angle that a state evolves along; the twist is that between the shafts, with the kinematic error."""
        return {
            IndependentVariable.TWIST: self._input_signals.twist,
            IndependentVariable.CRANK: self._input_signals.crank_angle,
            IndependentVariable.OUTPUT: self._input_signals.output_angle,
        }[variable]

    def states_of(self, effect: Effect) -> dict[str, ca.MX]:
        """The states of one effect by name."""
        at = len(self.angles)
        for other in self.effects:
            if other is effect:
                return {s.name: self.x[at + k] for k, s in enumerate(effect.states)}
            at += len(other.states)
        raise AssertionError(effect.name)

    def contributions(self, place: Place, signals: Signals) -> list[Any]:
        """What each effect at a place contributes, in the effects' order."""
        return [
            e.contribution(signals, self.values[e.name], self.states_of(e)) for e in self.effects if e.place is place
        ]

    def total(self, place: Place, signals: Signals) -> ca.MX:
        """Sum of the contributions at a place."""
        return sum(self.contributions(place, signals), start=ca.MX(0))

    def series(self) -> tuple[ca.MX, ca.MX]:
        """Compliance, rad/(N.m), and offset, rad, in series with the contacts."""
        parts = self.contributions(Place.SERIES, self.signals)
        return sum((c for c, _ in parts), start=ca.MX(0)), sum((o for _, o in parts), start=ca.MX(0))

    # -- stages ---------------------------------------------------------------------------------------------

    def initial(self) -> ca.MX:
        """States that fit the inputs: the angles at their present value, the effects' own at zero."""
        start = [self.angle(variable) for variable in self.angles]
        return ca.vertcat(*start, ca.MX.zeros(self.x.numel() - len(start)))

    def kinematics(self) -> ca.MX:
        signals = self._input_signals
        twist = signals.twist - self.total(Place.KINEMATIC, signals)
        return ca.vertcat(twist, ca.jacobian(twist, self.u)[0])

    def coefficients(self) -> ca.MX:
        compliance, _ = self.series()
        missing = [share for share, _ in self.contributions(Place.ELEMENT, self.signals)] or [ca.MX(0)]
        error = self.total(Place.MODULUS, self.signals)
        scale = ca.MX(1) if self.modulus is None else self.modulus.scale(error)
        return ca.vertcat(compliance, *missing, scale, self.band)

    def contact_point(self) -> ca.MX:
        _, offset = self.series()
        positions = [position for _, position in self.contributions(Place.ELEMENT, self.signals)] or [ca.MX(0)]
        angle = [self.u[INPUT_NAMES.index("output.phi")]] if self.individual else []
        clearance = self.total(Place.CLEARANCE, self.signals)
        return ca.vertcat(self.signals.twist - offset, clearance, *positions, *angle)

    def output(self) -> ca.MX:
        elastic, stiffness, force, share, in_range = ca.vertsplit(self.c)
        signals = self.signals._replace(elastic_torque=elastic)
        # The parallel torques see twist and elastic torque as symbols, for their share in the stiffness.
        twist, torque = ca.MX.sym("twist"), ca.MX.sym("torque")
        inner = torque + self.total(Place.PARALLEL, signals._replace(twist=twist, elastic_torque=torque))
        inner, by_torque, by_twist = ca.graph_substitute(
            [inner, ca.jacobian(inner, torque), ca.jacobian(inner, twist)], [twist, torque], [signals.twist, elastic]
        )
        after = {Place.PARALLEL: inner}
        for (before, _), (place, sign) in itertools.pairwise(TORQUE_CHAIN):
            part = self.total(place, signals)
            after[place] = after[before] + part if sign > 0 else after[before] - part
        outputs = {
            "output.tau": after[Place.OUTPUT],
            # Virtual work: the crank carries each torque inside the drive times the derivative by its angle of the
            # twist that the torque acts along, and overcomes the friction of the transmission.
            "crank.tau": -elastic * self.twist_by_crank
            - (inner - elastic) / self.ratio
            - self.total(Place.CRANK, signals),
            "twist": signals.crank_angle / self.ratio - signals.output_angle,
            "stiffness": by_torque * stiffness + by_twist,
            "max_contact_force": force,
            "load_share": share,
            "in_range": in_range,
            "measured.tau": after[Place.SENSOR],
        }
        return ca.vertcat(*(outputs[signal.name] for signal in self.outputs))
