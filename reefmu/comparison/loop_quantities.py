"""Play, friction and stiffness of one loop, between loads that all loops of a comparison reach.

Play is half the distance between the zeros of straight lines through both flanks of the middle line: what is lost to
either side. A flank that is curved near zero load counts as play too, which is the same in all states that are compared
between the same loads.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stiffness_model.numerics.arrays import Array

from .torque_loops import TorqueLoop

FLANK = (0.35, 1.0)
"""Loads, over the common load, between which lines are fitted to the flanks. Chosen by judgement: above what friction
and cogging blur, and wide enough for a line through steps of a sticking motor."""
STIFFNESS_LOADS: Mapping[str, float] = {"stiffness_low": 0.3, "stiffness_middle": 0.55, "stiffness_high": 0.8}
"""Stiffnesses with their loads, over the common load. Chosen by judgement."""
HALF_WINDOW = 0.2
"""Half the range of loads, over the common load, of one stiffness. Chosen by judgement."""
SMALL_LOAD = 0.25
"""Load, over the common load, up to which the half width is friction without load. Chosen by judgement."""
BINS = 8
"""Classes of load with equal weight in the line of friction over load. Chosen by judgement."""
REACHED = 0.9
"""Share of the common load that a loop must reach, by its own measure, to show a quantity. Chosen by judgement: the
levels above `torque_loops.TIP`, which that measure leaves out, suffice for the rest."""
CRANK_QUANTITIES: Mapping[str, str] = {"crank_friction": "N.m", "load_dependent_crank_friction": "1"}
"""Quantities, with their units, of records with the torques of crank and output; at the crank."""
QUANTITIES: Mapping[str, str] = {
    "play": "rad",
    "friction": "N.m",
    "load_dependent_friction": "1",
    **dict.fromkeys(STIFFNESS_LOADS, "N.m/rad"),
    **CRANK_QUANTITIES,
}
"""Quantities with their units."""


def loop_quantities(loop: TorqueLoop, load: float) -> dict[str, float]:
    """The quantities of a loop by their names, NaN where it does not show one.

    load: N.m, common load of both directions. A loop of one direction has no play. Friction without load and its share
    of the load come from both directions, stiffness is the mean of those that the loop reaches.
    """
    zeros: list[float] = []
    slopes: dict[str, list[float]] = {name: [] for name in STIFFNESS_LOADS}
    for sense, reach in zip((-1.0, 1.0), loop.reach, strict=True):
        if reach < REACHED * load:
            continue
        twist, torque = _flank(loop, sense)
        zeros.append(_line(twist, torque, FLANK[0] * load, FLANK[1] * load)[1])
        for name, share in STIFFNESS_LOADS.items():
            window = (share - HALF_WINDOW) * load, (share + HALF_WINDOW) * load
            slopes[name].append(1 / _line(twist, torque, *window)[0])
    friction, over_load = _friction(loop.width, loop.middle, load, loop.friction_at_small_load)
    return {
        "play": sum(zeros) / 2 if len(zeros) == 2 else float("nan"),
        "friction": friction,
        "load_dependent_friction": over_load,
        **{name: float(np.mean(found)) if found else float("nan") for name, found in slopes.items()},
        **dict(zip(CRANK_QUANTITIES, _crank_friction(loop, load), strict=True)),
    }


def _crank_friction(loop: TorqueLoop, load: float) -> tuple[float, float]:
    """Friction at the crank without load, N.m, and its growth over the load at the crank; NaN where it is not shown."""
    if loop.crank_width is None or loop.ratio is None:
        return float("nan"), float("nan")
    return _friction(loop.crank_width, loop.middle / loop.ratio, load / abs(loop.ratio), float("nan"))


def _flank(loop: TorqueLoop, sense: float) -> tuple[Array, Array]:
    """Twist, rad, and torque, N.m, both (n,), of one direction with positive torques: twist that the loop spends below
    a torque, which grows with it even where cogging makes the middle line fall.
    """
    torque = np.sort(sense * loop.middle)
    last = float((sense * loop.twist).max())
    twist = last - loop.step * np.arange(len(torque), dtype=float)[::-1]
    return twist, torque


def _line(twist: Array, torque: Array, low: float, high: float) -> tuple[float, float]:
    """Compliance, rad/(N.m), and zero, rad, of a straight line of the twist (n,), rad, over the torque (n,), N.m,
    between two torques; of the interpolated ends where fewer than three levels lie between.
    """
    inside = (torque >= low) & (torque <= high)
    x, y = torque[inside], twist[inside]
    if len(x) < 3 or np.ptp(x) < 0.5 * (high - low):
        x = np.array([low, high])
        y = np.interp(x, torque, twist)
    slope, zero = np.polyfit(x, y, 1)
    # A rigid flank, within the resolution of the twist, has the compliance of one level.
    return max(float(slope), (twist[1] - twist[0]) / (high - low) / 10), float(zero)


def _friction(half_width: Array, middle: Array, load: float, otherwise: float) -> tuple[float, float]:
    """Half width without load, N.m, and its growth over the load, from classes of load that weigh equally.

    half_width, middle: (n,) N.m of a loop; load: N.m, up to which it counts; otherwise: N.m, where the loop shows no
    growth.
    """
    known = np.isfinite(half_width)
    size, width = np.abs(middle[known]), half_width[known]
    edges = np.linspace(0, load, BINS + 1)
    place = np.searchsorted(edges, size, side="right") - 1
    classes = [place == k for k in range(BINS) if (place == k).any()]
    if len(classes) < 2:
        return otherwise, float("nan")
    slope = float(np.polyfit([size[c].mean() for c in classes], [width[c].mean() for c in classes], 1)[0])
    small = size <= SMALL_LOAD * load
    if not small.any():
        small = classes[0]
    return float((width[small] - slope * size[small]).mean()), slope
