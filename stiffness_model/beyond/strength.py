"""Contact pressure against a limit, over twist: which contact governs, and how far the limit is.

For hardened bearing steel against itself the limit is that of ISO 76 for static load ratings: 4200 MPa in the middle
of the most loaded point contact (balls) and 4000 MPa of a line contact (rollers), where the permanent deformation
reaches a ten-thousandth of the element's diameter. It is a limit for standing loads, not for endurance. Other
materials have no limit in that standard: the drawing states one (`gear_pressure_limit`, ...), such as 1.6 times the
yield stress, where a point contact first yields below its surface (Johnson, Contact Mechanics, eq. 6.9), or there
is no safety to be told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contacts import PARTNERS
from ..drawing_file import AnyDrive, as_drive
from ..drive import Drive
from ..materials import STEEL_100CR6
from ..pressure import contact_pressures

Array = NDArray[np.float64]

ISO_76 = {"ball": 4200e6, "roller": 4000e6}
"""Pa."""
LOAD_POWER = {"ball": 3, "roller": 2}
"""Loads go with this power of the pressure."""


@dataclass(frozen=True)
class Strength:
    """Pressures of virtual drives against their limits, the last axes in the order gear, crank, cage.

    twist: (n_twist,) rad; pressure: (n_drives, n_twist, 3) Pa, the greatest of each drive; limit: (3,) Pa, NaN where
    none is known; load_power: of the pressure in the load.
    """

    twist: Array
    pressure: Array
    limit: Array
    load_power: int

    @property
    def safety(self) -> Array:
        """Limit over pressure, (n_drives, n_twist, 3); infinite without pressure, NaN without a known limit."""
        with np.errstate(divide="ignore"):
            return np.where(np.isnan(self.limit), np.nan, self.limit / self.pressure)

    @property
    def load_safety(self) -> Array:
        """The same in terms of the load at the contact, as ISO 76 has it: s0 = C0/P0."""
        return self.safety**self.load_power

    def least(self) -> Array:
        """Mean over the drives of limit over pressure at the contact that governs, (n_twist,); NaN if none is known."""
        return _least(self.safety.mean(axis=0))[0]

    def governing(self) -> list[str]:
        """The contact with the least safety at every twist; "" where no contact carries or no limit is known.

        Raises nothing.
        """
        return [PARTNERS[k] if np.isfinite(value) else "" for value, k in zip(*_least(self.safety.mean(axis=0)),
                                                                             strict=True)]

    def permissible(self, torque: ArrayLike) -> float:
        """The torque, N.m, at which the mean safety falls to 1, from the torques (n_twist,) at the twists.

        NaN if it does not within them.
        """
        values, safety = np.asarray(torque, float), self.least()
        known = np.isfinite(safety)
        values, safety = values[known], safety[known]
        below = np.flatnonzero(safety <= 1)
        if below.size == 0 or below[0] == 0:
            return float("nan")
        k = below[0]
        # Pressure over torque is nearly a power law.
        x = np.log(safety[k - 1]) / (np.log(safety[k - 1]) - np.log(safety[k]))
        return float(values[k - 1] + x * (values[k] - values[k - 1]))


def _least(safety: Array) -> tuple[Array, NDArray[np.intp]]:
    filled = np.where(np.isnan(safety), np.inf, safety)
    k = filled.argmin(axis=-1)
    value = np.take_along_axis(filled, k[..., None], axis=-1)[..., 0]
    return np.where(np.isnan(safety).all(axis=-1), np.nan, value), k


def pressure_limits(drive: Drive) -> Array:
    """Limits, (3,) Pa, at gear, crank and cage: the drawing's, else ISO 76's for 100Cr6 on 100Cr6, else NaN.

    >>> from stiffness_model import load_drive
    >>> pressure_limits(load_drive("drive_1")) / 1e6
    array([4200., 4200., 4200.])
    >>> pressure_limits(load_drive("drive_3", gear_pressure_limit="90 MPa")) / 1e6
    array([  90., 4200.,   nan])
    """
    limits = []
    for part in PARTNERS:
        stated = getattr(drive.beyond, f"{part}_pressure_limit")
        hardened = all(drive.materials[body] == STEEL_100CR6 for body in (part, "element"))
        limits.append(stated or (ISO_76[drive.element] if hardened else np.nan))
    return np.array(limits)


def check_strength(drive: AnyDrive, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> Strength:
    """Pressures of the first `n_drives` virtual drives at twists (n_twist,), rad, against their limits.

    Raises `InputError` as `contact_pressures` does.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> strength = check_strength(load_drive("drive_1"), [4 * ARCMIN, 8 * ARCMIN], n_drives=20)
    >>> strength.least().round(2), strength.governing()
    (array([1.35, 0.97]), ['crank', 'crank'])
    """
    drive = as_drive(drive)
    found = contact_pressures(drive, twist, n_drives, seed)
    return Strength(found.twist, found.pressure, pressure_limits(drive), LOAD_POWER[drive.element])
