"""What the effects at the contacts themselves do to the lookup's torque, in CasADi: another modulus, a lost element."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import casadi as ca

from stiffness_model.drive import Drive
from stiffness_model.element_table import EDGE, ElementTable
from stiffness_model.lookup import Lookup
from stiffness_model.modulus import modulus_shares
from stiffness_model.spline import slope_weights, weights

from .effects import Effect, Place
from .tables import cached_element_table, clip, locate


def completed(lookup: Lookup, drive: Drive, effects: Iterable[Effect]) -> Lookup:
    """The drawing's lookup with what these effects need beside its tables: cached, or solved within a second."""
    places = {effect.place for effect in effects}
    if Place.MODULUS in places and lookup.modulus is None:
        lookup = replace(lookup, modulus=modulus_shares(drive))
    if Place.ELEMENT in places and lookup.element is None:
        lookup = replace(lookup, element=cached_element_table(drive))
    return lookup


def element_function(table: ElementTable) -> ca.Function:
    """(twist rad, clearance m, position rad) -> (torque, stiffness) of one element; see `ElementTable.evaluate`."""
    twist, clearance, position = ca.MX.sym("twist"), ca.MX.sym("clearance"), ca.MX.sym("position")
    beta = position - 2 * math.pi * ca.floor(position / (2 * math.pi) + 0.5)
    side = ca.if_else(beta < 0, -1, 1)
    i, f = locate(table.twist, side * twist)
    j, g = locate(table.clearance, clearance)
    k, h = locate(table.position, ca.fmin(ca.fabs(beta), table.limit + EDGE))
    inside, held = clip(f), clip(g)
    _, n_c, n_b = table.coefficients.shape
    offsets = [(a * n_c + b) * n_b + d for a in range(4) for b in range(4) for d in range(4)]
    coefficients = ca.MX(ca.DM(table.coefficients.ravel()))
    cell = coefficients[(i * n_c + j) * n_b + k + ca.DM(offsets)]
    torque, slope = _element_cell()(cell, f, inside, held, h)
    left = clip((table.limit - ca.fabs(beta)) / (2 * EDGE) + 0.5)
    torque, stiffness = side * left * torque, left * slope / table.twist.step
    return ca.Function("element", [twist, clearance, position], [torque, stiffness],
                       ["twist", "clearance", "position"], ["torque", "stiffness"])



def _element_cell() -> ca.Function:
    """(coefficients of a cell, its coordinates) -> (value, slope along the twist), in scalars as `tables`' own."""
    cell, f, inside, held, h = (ca.SX.sym(name, n) for name, n in
                                (("cell", 64), ("f", 1), ("inside", 1), ("held", 1), ("h", 1)))
    along_position, along_clearance = weights(h, h), weights(held, held)
    rows = [sum(along_clearance[b] * sum(along_position[d] * cell[16 * a + 4 * b + d] for d in range(4))
                for b in range(4)) for a in range(4)]
    return ca.Function("element_cell", [cell, f, inside, held, h], [
        sum(w * c for w, c in zip(weights(f, inside), rows, strict=True)),
        sum(w * c for w, c in zip(slope_weights(inside), rows, strict=True))],
        {"is_diff_in": [False, True, True, True, True]})
