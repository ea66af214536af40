"""A twist-torque curve as a lookup, for gears without a drawing.

Without a drawing the relation between clearance and twist is unknown. Here a clearance, m, is the twist, rad, that it
frees to either side times `lever`, m/rad, which the model states.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from stiffness_model.errors import InputError, expect, refuse_unknown
from stiffness_model.lookup.build_lookup import QUANTITIES, Lookup
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import Axis, fit

CURVE_FIELDS = ("name", "ratio", "lever [m/rad]", "twist [rad]", "torque [N.m]")
"""Fields of `Lookup.drawing["curve"]` and of the section [curve] of model.toml."""
_NODES, _CLEARANCES = 240, 24


def curve_lookup(twist: Array, torque: Array, lever: float, name: str, ratio: float = 1.0) -> Lookup:
    """A curve as a lookup: a clearance shifts its two branches apart.

    twist: (n,) rad, increasing; torque: (n,) N.m; lever: m/rad; ratio: signed, crank to output. A curve that starts at
    zero twist is continued antisymmetrically.

    >>> curve = curve_lookup(np.array([0.0, 1e-3, 2e-3]), np.array([0.0, 5.0, 10.0]), 0.01, "spring")
    >>> curve.torque([1e-3, 1e-3], [0.0, 5e-6]).round(2).tolist()
    [5.0, 2.5]
    """
    source = {
        "name": name,
        "ratio": ratio,
        "lever [m/rad]": lever,
        "twist [rad]": twist.tolist(),
        "torque [N.m]": torque.tolist(),
    }
    if twist[0] >= 0:
        keep = twist > 0
        twist = np.concatenate([-twist[keep][::-1], [0.0], twist[keep]])
        torque = np.concatenate([-torque[keep][::-1], [0.0], torque[keep]])
    curve = PchipInterpolator(twist, torque, extrapolate=False)
    ends = curve.derivative()(twist[[0, -1]])

    def at(x: Array) -> Array:
        inside = curve(np.clip(x, twist[0], twist[-1]))
        return inside + ends[1] * np.maximum(x - twist[-1], 0) + ends[0] * np.minimum(x - twist[0], 0)

    reach = float(np.abs(twist).max())
    widest = 0.5 * reach * lever
    axes = Axis(-reach, 2 * reach / _NODES, _NODES), Axis(-widest, 2 * widest / _CLEARANCES, _CLEARANCES)
    x, c = axes[0].nodes[:, None], axes[1].nodes[None, :] / lever
    inner = np.where(c >= 0, np.sign(x) * np.maximum(np.abs(x) - c, 0), x)
    # With interference both flanks carry load near the middle, and the torque is the sum of both branches.
    tight = at(x + np.minimum(-c, reach)) + at(x - np.minimum(-c, reach))
    mean = np.where(c >= 0, at(inner), np.where(np.abs(x) > -c, at(np.sign(x) * (np.abs(x) - c)), tight))
    tables = np.stack([mean, mean, mean, np.abs(mean), np.ones_like(mean)])
    coefficients = fit(axes[1], fit(axes[0], tables, 1), 2)
    return Lookup(
        axes[0],
        axes[1],
        coefficients,
        float(np.abs(torque).max()),
        dict.fromkeys(QUANTITIES, 0.0),
        {"curve": source},
        1,
        0,
        "",
    )


def source_curve(lookup: Lookup) -> Mapping[str, Any] | None:
    """The curve that a lookup was made of, or None if it was made of a drawing."""
    return lookup.drawing.get("curve")


def curve_lookup_from_dict(curve: Mapping[str, Any], where: str) -> Lookup:
    """The lookup of a section [curve]. Raises `InputError` for other fields and values that are no curve."""
    refuse_unknown("field", curve, CURVE_FIELDS, where)
    for name in CURVE_FIELDS:
        expect(name in curve, f"a field {name!r}", sorted(curve), where)
    expect(isinstance(curve["name"], str), "a name", curve["name"], where)
    try:
        ratio, lever = float(curve["ratio"]), float(curve["lever [m/rad]"])
        twist, torque = (np.array(curve[name], float) for name in ("twist [rad]", "torque [N.m]"))
    except (TypeError, ValueError) as error:
        raise InputError(f"{where}: expected numbers, got {error}") from None
    expect(np.isfinite(ratio) and ratio != 0, "a ratio that is not zero", ratio, where)
    expect(np.isfinite(lever) and lever > 0, "a lever above zero", lever, where)
    expect(
        twist.ndim == 1 and len(twist) >= 3 and twist.shape == torque.shape,
        "as many torques as twists, 3 or more",
        f"{torque.size} torques and {twist.size} twists",
        where,
    )
    expect(
        bool(np.isfinite(twist).all() and np.isfinite(torque).all() and (np.diff(twist) > 0).all()),
        "finite numbers and increasing twists",
        "others",
        where,
    )
    return curve_lookup(twist, torque, lever, curve["name"], ratio)
