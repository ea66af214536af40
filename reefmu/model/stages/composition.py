"""The model's functions: the stages as CasADi functions, chained in their declared order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.rotation import Individual

from ...effects import Effect, Place
from ..contacts.curve_contacts import curve_function
from ..contacts.element import element_function
from ..contacts.equilibrium import ContactEquilibrium
from ..contacts.individual import individual_function
from ..contacts.tables import lookup_function
from . import states
from .expressions import DriveExpressions
from .order import (
    ADVANCE_ANGLES,
    ADVANCE_LOADED,
    ADVANCE_TIME,
    COEFFICIENTS,
    CONTACT_EQUILIBRIUM,
    CONTACT_POINT,
    KINEMATICS,
    OUTPUT,
    RATE,
    SETTLE,
    Stage,
    advance_order,
    angles_under_load,
    has_time_states,
)


@dataclass(frozen=True)
class Composition:
    """The stages of one model: of a lookup and its effects, or of an individual instead of the mean."""

    lookup: Lookup
    effects: tuple[Effect, ...]
    individual: Individual | None = None

    @cached_property
    def drive(self) -> DriveExpressions:
        """Symbols and expressions."""
        return DriveExpressions(self.lookup, self.effects, individual=self.individual is not None)

    @cached_property
    def expressions(self) -> dict[str, ca.MX]:
        """Every stage but `contacts`, by name, on the symbols that it reads."""
        drive = self.drive
        return {
            KINEMATICS.name: drive.kinematics(),
            ADVANCE_ANGLES.name: states.advance_angles(drive),
            COEFFICIENTS.name: drive.coefficients(),
            CONTACT_POINT.name: drive.contact_point(),
            ADVANCE_LOADED.name: states.advance_loaded(drive),
            ADVANCE_TIME.name: states.advance_time(drive),
            SETTLE.name: states.settle(drive),
            RATE.name: states.rate(drive),
            OUTPUT.name: drive.output(),
        }

    @cached_property
    def table(self) -> ca.Function:
        """The contacts at a twist of their own, without effects."""
        if self.individual is not None:
            return individual_function(self.individual, self.lookup)
        if isinstance(self.lookup, CurveLookup):
            return curve_function(self.lookup)
        return lookup_function(self.lookup)

    @cached_property
    def contacts(self) -> ca.Function:
        """The stage `contacts`: (q, r) -> c."""
        drive, places = self.drive, {effect.place for effect in self.effects}
        with_element = Place.ELEMENT in places and self.lookup.element is not None
        return ContactEquilibrium(
            self.table,
            element_function(self.lookup.element) if with_element and self.lookup.element else None,
            self.has_series_compliance,
            drive.modulus is not None,
            drive.point_names,
            drive.coefficient_names,
        ).function

    @property
    def has_series_compliance(self) -> bool:
        """Whether a compliance may act in series with the contacts."""
        return not self.drive.series()[0].is_zero()

    @property
    def time_states_need_torque(self) -> bool:
        """Whether the states that evolve in time depend on the contacts."""
        return bool(ca.depends_on(self.expressions[ADVANCE_TIME.name], self.drive.c))

    @cached_property
    def advance_order(self) -> tuple[Stage, ...]:
        """The stages that advance the states of this model."""
        return advance_order(
            angles=bool(self.drive.angles),
            time=has_time_states(self.effects),
            torque=self.time_states_need_torque,
            loaded=bool(angles_under_load(self.effects)),
        )

    def chain(self, order: Sequence[Stage], last: str) -> ca.MX:
        """The variable `last` after the stages in `order`, as an expression in x, u, dt and p."""
        values = {name: self.drive.symbols[name] for name in ("x", "u", "dt", "p")}
        for stage in order:
            # What no stage has written yet, this model does not depend on; if it did, a free symbol would remain.
            arguments = [values.get(name, self.drive.symbols[name]) for name in stage.reads]
            if stage.name == "contacts":
                function = self.contacts
            else:
                symbols = [self.drive.symbols[name] for name in stage.reads]
                function = stage_function(stage.name, symbols, self.expressions[stage.name])
            values[stage.writes] = function.call(arguments, True, False)[0]
        return values[last]

    def functions(self) -> dict[str, ca.Function]:
        """The functions initial, advance, settle, rate, output and jacobian of `reefmu.model.drive_model`, by name."""
        x, u, dt, p = (self.drive.symbols[name] for name in ("x", "u", "dt", "p"))
        advance = self.chain([KINEMATICS, *self.advance_order], "x")
        settle = self.chain([KINEMATICS, *CONTACT_EQUILIBRIUM, SETTLE], "x")
        rate = self.chain([KINEMATICS, *CONTACT_EQUILIBRIUM, RATE], "dx")
        output = self.chain([KINEMATICS, *CONTACT_EQUILIBRIUM, OUTPUT], "y")
        return {
            "initial": ca.Function("initial", [u, p], [self.drive.initial()], ["u", "p"], ["x"]),
            "advance": ca.Function("advance", [x, u, dt, p], [advance], ["x", "u", "dt", "p"], ["x_next"]),
            "settle": ca.Function("settle", [x, u, p], [settle], ["x", "u", "p"], ["x_rest"]),
            "rate": ca.Function("rate", [x, u, p], [rate], ["x", "u", "p"], ["dx"]),
            "output": ca.Function("output", [x, u, p], [output], ["x", "u", "p"], ["y"]),
            "jacobian": ca.Function("jacobian", [x, u, p], [ca.jacobian(output, u)], ["x", "u", "p"], ["dy_du"]),
        }


def stage_function(name: str, arguments: list[ca.MX], result: ca.MX) -> ca.Function:
    """A CasADi function. Raises `NotImplementedError` for a `result` that needs more than `arguments`."""
    given = [a.name() for a in arguments if a.is_symbolic()]
    more = sorted(s.name() for s in ca.symvar(ca.MX(result)) if s.name() not in given)
    if more:
        raise NotImplementedError(
            f"{name}: expected effects that need {', '.join(given)} there, got one that also needs {', '.join(more)}"
        )
    return ca.Function(name, arguments, [ca.densify(result)])
