"""Limits of twists and crank angles beyond which results have no meaning, checked in one place, and how far the
clearance of a drive may differ from the drawn one."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, expect
from ..numerics.arrays import Array
from ..units import ARCMIN
from .drive import Drive

MAX_TWIST_FACTOR = 4.0
"""Greatest twist over the drawing's max_twist; chosen by judgement. A contact's indentation grows with the twist, its
load with the power 3/2 and its pressure with 1/2 (Hertz): there the contacts carry eight times their load at max_twist,
at twice the pressure."""
QUARTER_TURN = math.pi / 2
"""Greatest crank twist, rad. Beyond it the eccentric's tangential displacement, e sin(crank twist), decreases: the
eccentric leaves the flanks that carry the elements for the next lobe."""
MAX_OUTPUT_ANGLE = 1e12
"""Greatest output angle, rad, beyond which floating-point numbers no longer resolve the elements' places."""
CLEARANCE_PER_RADIUS = {"element": -2.0, "crank": -1.0, "gear": 1.0}
"""Change of the clearance between gear and crank by the radius of a part: geometry, at small pressure angles."""
CLEARANCE_DEVIATIONS = 5.0
"""Least reach in standard deviations of an element's clearance; chosen by judgement: six elements
in ten million are beyond."""


class TwistedDrive(Protocol):
    """What the limits need of a drive: name, greatest twist in use (rad) and magnitude of the ratio."""

    @property
    def name(self) -> str: ...
    @property
    def max_twist(self) -> float: ...
    @property
    def transmission_ratio(self) -> float: ...


def clearance_reach(drive: Drive) -> float:
    """Greatest difference of a clearance from the drawn one that tables of a drive hold, m: half of the clearance that
    max_twist closes, or five standard deviations of it by the tolerances where they are wider.

    >>> from stiffness_model.io.drawing_toml import load_drive
    >>> [round(1e6 * clearance_reach(load_drive(name)), 1) for name in ("drive_1", "drive_2")]
    [23.6, 36.7]
    """
    return max(half_closed_clearance(drive), CLEARANCE_DEVIATIONS * clearance_deviation(drive))


def half_closed_clearance(drive: Drive) -> float:
    """Half of the clearance that max_twist closes, m."""
    return 0.5 * drive.eccentricity * abs(drive.ratio) * drive.max_twist


def clearance_deviation(drive: Drive) -> float:
    """Standard deviation of the clearance of an element between gear and crank by the tolerances of the sizes, m."""
    return math.hypot(*(c * drive.tolerances[part].sigma for part, c in CLEARANCE_PER_RADIUS.items()))


def twist_limit(drive: TwistedDrive) -> float:
    """Greatest twist that is computed, rad at the output: `MAX_TWIST_FACTOR` max_twist, at most a `QUARTER_TURN`.

    >>> from stiffness_model.io.drawing_toml import load_drive
    >>> [round(twist_limit(load_drive(name)) / ARCMIN) for name in ("drive_1", "drive_3")]
    [32, 160]
    """
    return min(MAX_TWIST_FACTOR * drive.max_twist, QUARTER_TURN / drive.transmission_ratio)


def expect_twists(drive: TwistedDrive, twist: ArrayLike, where: str = "twist", *, in_rad: bool = True) -> Array:
    """Twists at the output as an array (n,), rad; a single number becomes an array of one.

    where: what messages call them; in_rad: whether the caller passes rad, so that a missing factor `ARCMIN` is a
    likely mistake. Raises `InputError` for values that are not finite, for more than one dimension, and for twists
    beyond `twist_limit`.

    >>> from stiffness_model.io.drawing_toml import load_drive
    >>> expect_twists(load_drive("drive_1"), [0.0, 8.0])
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: twist: expected twists within +-32 arcmin, 4 times the max_twist of drive_1, \
got 2.75e+04 arcmin; twists are in rad: did you mean 8 * ARCMIN?
    """
    try:
        angles = np.atleast_1d(np.asarray(twist, float))
    except (TypeError, ValueError):
        angles = np.array([np.nan])
    expect(
        angles.ndim == 1 and angles.size > 0 and bool(np.isfinite(angles).all()),
        "a one-dimensional array of finite twists in rad" if in_rad else "a finite twist",
        twist,
        where,
    )
    limit, greatest = twist_limit(drive), float(angles[np.abs(angles).argmax()])
    # The limit itself passes whatever its last digits.
    if abs(greatest) > limit * (1 + 1e-9):
        reason = (
            f"{MAX_TWIST_FACTOR:g} times the max_twist of {drive.name}"
            if limit < QUARTER_TURN / drive.transmission_ratio
            else f"a quarter turn of the crank of {drive.name}"
        )
        likely_arcmin = in_rad and 0.02 * drive.max_twist <= abs(greatest) * ARCMIN <= limit
        remedy = (
            f"twists are in rad: did you mean {greatest:.6g} * ARCMIN?"
            if likely_arcmin
            else "for greater twists raise max_twist in the drawing"
        )
        raise InputError(
            f"{where}: expected twists within +-{limit / ARCMIN:.4g} arcmin, {reason}, "
            f"got {greatest / ARCMIN:.3g} arcmin; {remedy}"
        )
    return angles


def expect_crank_angle(drive: TwistedDrive, angle: float, where: str = "angle") -> None:
    """Raise `InputError` for a crank angle, rad, at which the output's angle is beyond `MAX_OUTPUT_ANGLE`."""
    limit = MAX_OUTPUT_ANGLE * drive.transmission_ratio
    expect(
        abs(angle) <= limit,
        f"a crank angle within +-{limit:.3g} rad, beyond which the elements' places are not resolved",
        angle,
        where,
    )
