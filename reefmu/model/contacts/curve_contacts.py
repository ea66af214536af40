"""The contacts of a model without a drawing: the twist-torque curve of a `CurveLookup` as a CasADi function."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.numerics.piecewise_line import QuadraticSpline

from .tables import clamped


def curve_function(lookup: CurveLookup) -> ca.Function:
    """(twist rad, clearance m, a further argument without influence) -> (torque, stiffness, 0, 0, in range).

    The same lines with rounded corners as `CurveLookup`, to rounding. A curve has neither contact forces nor load
    shares; the zeros in their places are no outputs of a model (`reefmu.model.signals.outputs_of`).
    """
    twist, clearance, place = (ca.MX.sym(name) for name in ("twist", "clearance", "place"))
    held = clamped(lookup.clearance, clearance)
    play = held / lookup.lever
    torque, stiffness = ca.MX(float(lookup.line.at(0.0))), ca.MX(0)
    for k, (spline, at) in enumerate(zip(lookup.flanks, (twist - play, twist + play), strict=True)):
        value, slope = _spline_function(f"flank_{k}", spline)(at)
        torque, stiffness = torque + value, stiffness + slope
    in_range = ca.logic_and(
        ca.logic_and(twist >= lookup.twist.start, twist <= lookup.twist.stop),
        ca.logic_and(clearance >= lookup.clearance.start, clearance <= lookup.clearance.stop),
    )
    return ca.Function(
        "curve",
        [twist, clearance, place],
        [torque, stiffness, ca.MX(0), ca.MX(0), in_range],
        ["twist", "clearance", "place"],
        ["torque", "stiffness", "max_contact_force", "load_share", "in_range"],
    )


def _spline_function(name: str, spline: QuadraticSpline) -> ca.Function:
    """x -> (value, slope) of a quadratic spline, which its first and last straight pieces continue."""
    x = ca.MX.sym("x")
    first, last = float(spline.knots[0]), float(spline.knots[-1])
    inside = ca.if_else(x < first, first, ca.if_else(x > last, last, x))
    knots, coefficients = spline.knots, spline.coefficients
    value = ca.Function.bspline(f"{name}_value", [knots.tolist()], coefficients.tolist(), [2], 1)
    # The slope is a spline of one degree less, of the differences of the coefficients.
    differences = 2 * (coefficients[1:] - coefficients[:-1]) / (knots[3:-1] - knots[1:-3])
    slope = ca.Function.bspline(f"{name}_slope", [knots[1:-1].tolist()], differences.tolist(), [1], 1)(inside)
    return ca.Function(name, [x], [value(inside) + (x - inside) * slope, slope])


def source_curve(lookup: Lookup) -> Mapping[str, Any] | None:
    """The curve that a lookup without a drawing was made of, or None."""
    return lookup.curve if isinstance(lookup, CurveLookup) and "drive" not in lookup.drawing else None
