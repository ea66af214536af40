"""The torque of one element as a CasADi function, and the tables that effects on the contacts need."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import casadi as ca

from stiffness_model.io.drawing_toml import as_drive
from stiffness_model.kinds import AnyDrive
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH, ElementTable
from stiffness_model.lookup.modulus import modulus_shares

from ...effects import Effect, Place
from .tables import cached_element_table, clamped, clamped_to_unit, expanded, spline_function


def with_contact_tables(lookup: Lookup, drive: AnyDrive, effects: Iterable[Effect]) -> Lookup:
    """The lookup with the further tables that these effects need, from the cache or computed within a second."""
    places = {effect.place for effect in effects}
    if Place.MODULUS in places and lookup.modulus is None:
        lookup = replace(lookup, modulus=modulus_shares(as_drive(drive)))
    if Place.ELEMENT in places and lookup.element is None:
        lookup = replace(lookup, element=cached_element_table(as_drive(drive)))
    return lookup


def element_function(table: ElementTable) -> ca.Function:
    """(twist rad, clearance m, position rad) -> (torque, stiffness) of one element; see `ElementTable.evaluate`."""
    names = ["twist", "clearance", "position"]
    symbols = twist, clearance, position = [ca.MX.sym(name) for name in names]
    beta = position - 2 * math.pi * ca.floor(position / (2 * math.pi) + 0.5)
    side = ca.if_else(beta < 0, -1, 1)
    left = clamped_to_unit((table.limit - ca.fabs(beta)) / (2 * FADE_HALF_WIDTH) + 0.5)
    inside = clamped(table.twist, side * twist)
    held = ca.vertcat(
        inside, clamped(table.clearance, clearance), ca.fmin(ca.fabs(beta), table.limit + FADE_HALF_WIDTH)
    )
    at, sign, share, beyond = expanded("held", symbols, [held, side, left, side * twist - inside])(*symbols)
    axes, coefficients = (table.twist, table.clearance, table.position), table.coefficients[None]
    slope = spline_function("slope", axes, coefficients, slope=True)(at)
    torque = spline_function("torque", axes, coefficients)(at) + beyond * slope
    return ca.Function("element", symbols, [sign * share * torque, share * slope], names, ["torque", "stiffness"])
