"""The model cut where its tables are read: what comes before, and what is made of the torque that they give.

`reefmu.model.assembly` writes the model as whole functions, tables inside. A program that reads the tables by code of
its own (the native FMU) needs the pieces around them. They are made of the same expressions, as functions in
scalars, without tables:

    kinematics(u, p) -> k          twist after the kinematic effects, rad, and its derivative by the crank's angle
    coefficients(p) -> r                what parameters alone decide: `COEFFICIENTS`
    contact_point(x, u, k, p) -> q       where the contacts stand: `CONTACT_POINT`
    advance_angles(x, u, k, p) -> x       states after the angles have moved to those of u
    advance_time(x, u, k, dt, p, c) -> x     states after dt, the angles held
    rate(x, u, k, p, c) -> dx/dt
    output(x, u, k, p, c) -> y

c: what the contacts give at that point, `CONTACT`. An individual has no tables; its contacts are a function too:

    individual_contacts(q) -> c              q: twist of the contacts alone, clearance, output angle
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.rotation import Individual

from ..effects import Effect, Place, Signals
from .assembly import INPUT_NAMES, Assembly

COEFFICIENTS = ("compliance", "missing", "scale", "band")
"""Compliance in series with the contacts, rad/(N.m); share of one element that is missing; factor of the torque for
another modulus; place in the population."""
CONTACT_POINT = ("target", "clearance", "position")
"""Twist of contacts and compliance together, rad; gear clearance, m; position of the missing element, rad."""
INDIVIDUAL_POINT = (*CONTACT_POINT, "angle")
"""The same for an individual, whose contacts change with the output's angle, rad."""
CONTACT = ("torque", "stiffness", "max_contact_force", "load_share", "in_range")
"""Elastic torque, N.m; its derivative by the target, N.m/rad; the lookup's further outputs."""


@dataclass(frozen=True)
class Stages:
    """See the module.

    has_angle_states, has_time_states: whether states evolve along angles, and along time. time_states_need_torque:
    whether `advance_time` reads c. has_series_compliance: whether a compliance acts in series with the contacts.
    contact_point_names: entries of q, `CONTACT_POINT` or `INDIVIDUAL_POINT`. contact: of an individual.
    """

    kinematics: ca.Function
    coefficients: ca.Function
    contact_point: ca.Function
    advance_angles: ca.Function
    advance_time: ca.Function
    rate: ca.Function
    output: ca.Function
    has_angle_states: bool
    has_time_states: bool
    time_states_need_torque: bool
    has_series_compliance: bool
    contact_point_names: tuple[str, ...]
    contact: ca.Function | None


def make_stages(lookup: Lookup, effects: Sequence[Effect], individual: Individual | None = None) -> Stages:
    """The pieces of the model of this lookup and these effects, or of an individual."""
    return _Staged(lookup, effects, individual).stages()


class _Staged(Assembly):
    """The assembly with symbols in place of the geometry and of what the contacts give."""

    def __init__(self, lookup: Lookup, effects: Sequence[Effect], individual: Individual | None) -> None:
        super().__init__(lookup, effects, individual)
        self.turns = individual is not None
        self.k, self.c = ca.MX.sym("k", 2), ca.MX.sym("c", len(CONTACT))

    def signals(self) -> Signals:
        return super().signals()._replace(twist=self.k[0])

    def twist_by_crank(self, signals: Signals) -> ca.MX:
        return self.k[1]

    def contacts(self, signals: Signals, x: ca.MX) -> tuple[ca.MX, ca.MX, list[ca.MX]]:
        return self.c[0], self.c[1], [self.c[k] for k in range(2, len(CONTACT))]

    def element_parts(self) -> tuple[ca.MX, ca.MX]:
        """Missing share and position of the one element that the tables can take away."""
        found = [
            e.contribution(self.signals(), self.values[e.name], self.own(e, self.x))
            for e in self.effects
            if e.place is Place.ELEMENT
        ]
        if len(found) > 1:
            raise NotImplementedError("expected one effect that takes an element away, got several")
        return found[0] if found else (ca.MX(0), ca.MX(0))

    def stages(self) -> Stages:
        x, u, p, k, c, dt = self.x, self.u, self.p, self.k, self.c, self.dt
        signals = super().signals()
        geometry = ca.vertcat(signals.twist, super().twist_by_crank(signals))
        compliance, offset = self.series(self.signals(), x)
        missing, position = self.element_parts()
        scale = ca.MX(1) if self.modulus is None else self.modulus.scale(self.total(Place.MODULUS, self.signals(), x))
        tuned = ca.vertcat(compliance, missing, scale, self.band)
        point = ca.vertcat(self.k[0] - offset, self.total(Place.CLEARANCE, self.signals(), x), position)
        contact = None
        if self.turns:
            point = ca.vertcat(point, u[INPUT_NAMES.index("output.phi")])
            q = ca.MX.sym("q", 3)
            contact = ca.Function("individual_contacts", [q], [ca.vertcat(*self.table(q[0], q[1], q[2]))])
        aged = self.advance_time()
        return Stages(
            scalar_function("kinematics", [u, p], geometry),
            scalar_function("coefficients", [p], tuned),
            scalar_function("contact_point", [x, u, k, p], point),
            scalar_function("advance_angles", [x, u, k, p], self.advance_angles()),
            scalar_function("advance_time", [x, u, k, dt, p, c], aged),
            scalar_function("rate", [x, u, k, p, c], self.rates()),
            scalar_function("output", [x, u, k, p, c], self.outputs()),
            bool(self.paths),
            self.has_time_states,
            self.has_time_states and bool(ca.depends_on(aged, c)),
            not compliance.is_zero(),
            INDIVIDUAL_POINT if self.turns else CONTACT_POINT,
            contact,
        )


def scalar_function(name: str, arguments: list[ca.MX], result: ca.MX) -> ca.Function:
    """A function in scalars. An effect whose `result` needs more than `arguments` has no place among the stages."""
    given = [a.name() for a in arguments if a.is_symbolic()]
    more = sorted(s.name() for s in ca.symvar(ca.MX(result)) if s.name() not in given)
    if more:
        raise NotImplementedError(
            f"{name}: expected effects that need {', '.join(given)} there, got one that also needs {', '.join(more)}"
        )
    return ca.Function(name, arguments, [ca.densify(result)]).expand()
