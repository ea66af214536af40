"""How far a drive may be twisted and turned before the numbers mean nothing: one check for all who pass angles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, expect
from ..numerics.arrays import Array
from ..units import ARCMIN
from .drive import Drive

MAX_TWIST_FACTOR = 4.0
"""Times the drawing's max_twist. A contact's approach grows with the twist, its load with the power 3/2 and its
pressure with 1/2 (Hertz): there the contacts carry eight times what they do at max_twist, at twice the pressure."""
QUARTER_TURN = math.pi / 2
"""Of the crank, rad. The eccentric's way across, e sin(crank twist), grows no further: on its way to the next lobe it
leaves the flanks that the elements stand on."""
MAX_OUTPUT_ANGLE = 1e12
"""rad at the output. Beyond, a floating-point number no longer tells which element stands where."""


def twist_limit(drive: Drive) -> float:
    """Greatest twist that is computed, rad at the output: `MAX_TWIST_FACTOR` max_twist, at most a `QUARTER_TURN`.

    >>> from stiffness_model.io.drawing_toml import load_drive
    >>> [round(twist_limit(load_drive(name)) / ARCMIN) for name in ("drive_1", "drive_3")]
    [32, 160]
    """
    return min(MAX_TWIST_FACTOR * drive.max_twist, QUARTER_TURN / drive.transmission_ratio)


def expect_twists(drive: Drive, twist: ArrayLike, where: str = "twist", *, in_rad: bool = True) -> Array:
    """Twists at the output as an array (n,), rad; one number is an array of one.

    in_rad: whether the caller passed rad, so that arcmin may have been forgotten. Raises `InputError` for what is not
    finite, for more than one dimension, and far beyond the drawing's max_twist (`twist_limit`).

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
    most, worst = twist_limit(drive), float(angles[np.abs(angles).argmax()])
    # A rounding error beyond is none.
    if abs(worst) > most * (1 + 1e-9):
        reason = (
            f"{MAX_TWIST_FACTOR:g} times the max_twist of {drive.name}"
            if most < QUARTER_TURN / drive.transmission_ratio
            else f"a quarter turn of the crank of {drive.name}"
        )
        forgotten = in_rad and 0.02 * drive.max_twist <= abs(worst) * ARCMIN <= most
        remedy = (
            f"twists are in rad: did you mean {worst:.6g} * ARCMIN?"
            if forgotten
            else "a drive for greater twists says so by max_twist in its drawing"
        )
        raise InputError(
            f"{where}: expected twists within +-{most / ARCMIN:.4g} arcmin, {reason}, "
            f"got {worst / ARCMIN:.3g} arcmin; {remedy}"
        )
    return angles


def expect_crank_angle(drive: Drive, angle: float, where: str = "angle") -> None:
    """Raise `InputError` for a crank angle, rad, at which the output has turned beyond `MAX_OUTPUT_ANGLE`."""
    most = MAX_OUTPUT_ANGLE * drive.transmission_ratio
    expect(
        abs(angle) <= most,
        f"a crank angle within +-{most:.3g} rad, beyond which it is lost where the elements stand",
        angle,
        where,
    )
