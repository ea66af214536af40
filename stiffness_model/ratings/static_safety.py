"""Contact pressure against a limit, over twist: which contact governs, and how far the limit is.

ISO 76 rates the most heavily loaded contact, so the pressures are the greatest over a turn of each virtual drive
(`peak_pressure`), and what is reported is what nine drives of ten keep: the 90th percentile of pressure, the 10th of
safety.

For hardened bearing steel against itself the limit is that of ISO 76 for static load ratings: 4200 MPa in the middle
of the most loaded point contact (balls) and 4000 MPa of a line contact (rollers), where the permanent deformation
reaches a ten-thousandth of the element's diameter. It is a limit for standing loads, not for endurance. Other
materials have no limit in that standard: the drawing states one, of a contact (`gear_pressure_limit`, ...) or of a
material (`allowable_pressure`), such as 1.6 times the yield stress, where a point contact first yields below its
surface (Johnson, Contact Mechanics, eq. 6.9), or there is no safety to be told, and reports say so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..contact.element_contacts import PARTNERS
from ..display import one_line
from ..drawing.drive import Drive
from ..io.drawing_toml import DriveLike, as_drive
from ..montecarlo.twist_torque_curve import BAND
from ..numerics.arrays import Array
from .peak_pressure import peak_pressures

LOAD_EXPONENT = {"ball": 3, "roller": 2}
"""Loads go with this power of the pressure."""
REACHED, NOT_REACHED, EXCEEDED, NO_LIMIT = "reached", "not reached", "exceeded", "no limit"


@dataclass(frozen=True)
class PermissibleTorque:
    """The torque up to which the safety stays above 1, N.m.

    status: "reached": the safety falls to 1 at `torque`; "not reached": it stays above 1 at all twists looked at, up
    to `torque`; "exceeded": it is not above 1 already at the first twist under load, at `torque`; "no limit": none is
    known for any loaded contact, and `torque` is NaN.
    """

    torque: float
    status: str

    def __str__(self) -> str:
        return {
            REACHED: f"falls to 1 at {self.torque:.0f} N.m",
            NOT_REACHED: f"stays above 1 up to {self.torque:.0f} N.m",
            EXCEEDED: f"is 1 or below already at {self.torque:.1f} N.m, the least torque looked at",
            NO_LIMIT: "unknown",
        }[self.status]


@dataclass(frozen=True)
class GoverningContact:
    """What governs at one twist.

    contact: the one with the least safety, "" where none carries that has a limit; no_limit: pressure, Pa, of the
    loaded contacts without a known limit, by contact.
    """

    contact: str
    no_limit: dict[str, float]

    def __str__(self) -> str:
        unknown = ", ".join(f"{part} at {pressure / 1e6:.0f} MPa" for part, pressure in self.no_limit.items())
        return "; ".join(x for x in (self.contact, f"no limit known: {unknown}" if unknown else "") if x) or "none"


@dataclass(frozen=True)
class StaticSafety:
    """Pressures of virtual drives against their limits, the last axes in the order gear, crank, cage.

    twist: (n_twist,) rad; pressure: (n_drives, n_twist, 3) Pa, the greatest of each drive over a turn; limit: (3,) Pa,
    NaN where none is known; load_exponent: of the pressure in the load.
    """

    twist: Array
    pressure: Array
    limit: Array
    load_exponent: int

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def safety(self) -> Array:
        """Limit over pressure, (n_drives, n_twist, 3); infinite without pressure, NaN without a known limit."""
        return _inverse(self._utilisation)

    @property
    def load_safety(self) -> Array:
        """The same in terms of the load at the contact, as ISO 76 has it: s0 = C0/P0."""
        return self.safety**self.load_exponent

    @property
    def _utilisation(self) -> Array:
        return self.pressure / self.limit

    def pressure_p90(self) -> Array:
        """What nine drives of ten stay below, (n_twist, 3) Pa: the 90th percentile over the drives."""
        return np.percentile(self.pressure, BAND[1], axis=0)

    def min_safety(self) -> Array:
        """Limit over pressure at the most loaded contact with a known limit, (n_twist,): what nine drives of ten have
        at least. Infinite without load, NaN where no limit is known.
        """
        known = np.isfinite(self.limit)
        if not known.any():
            return np.full(len(self.twist), np.nan)
        return _inverse(np.percentile(self._utilisation[..., known].max(axis=2), BAND[1], axis=0))

    def governing_contacts(self) -> list[GoverningContact]:
        """The contact with the least safety at every twist, and those that have no limit.

        Raises nothing.
        """
        found = []
        for high in self.pressure_p90():
            use = np.where(np.isfinite(self.limit), high / self.limit, 0.0)
            unknown = {
                part: float(p)
                for part, p, limit in zip(PARTNERS, high, self.limit, strict=True)
                if p > 0 and np.isnan(limit)
            }
            found.append(GoverningContact(PARTNERS[int(use.argmax())] if use.max() > 0 else "", unknown))
        return found

    def permissible_torque(self, torque: ArrayLike) -> PermissibleTorque:
        """The torque at which `min_safety` falls to 1, from the torques (n_twist,) N.m at the twists, which rise.

        Contacts without a known limit have no part in it: see `governing_contacts`.
        """
        values, safety = np.asarray(torque, float), self.min_safety()
        loaded = np.isfinite(safety)
        if not loaded.any():
            return PermissibleTorque(math.nan, NO_LIMIT)
        values, safety = values[loaded], safety[loaded]
        below = np.flatnonzero(safety <= 1)
        if below.size == 0:
            return PermissibleTorque(float(values[-1]), NOT_REACHED)
        k = below[0]
        if k == 0:
            return PermissibleTorque(float(values[0]), EXCEEDED)
        # Pressure over torque is nearly a power law.
        x = np.log(safety[k - 1]) / (np.log(safety[k - 1]) - np.log(safety[k]))
        return PermissibleTorque(float(values[k - 1] + x * (values[k] - values[k - 1])), REACHED)


def _inverse(use: Array) -> Array:
    with np.errstate(divide="ignore"):
        return 1 / use


def pressure_limits(drive: Drive) -> Array:
    """Limits, (3,) Pa, at gear, crank and cage: the drawing's, else the lesser of both materials' allowable pressures.

    NaN where one of the two is not known. For 100Cr6 on 100Cr6 that is ISO 76's limit.

    >>> from stiffness_model import load_drive
    >>> pressure_limits(load_drive("drive_1")) / 1e6
    array([4200., 4200., 4200.])
    >>> pressure_limits(load_drive("drive_3", gear_pressure_limit="90 MPa")) / 1e6
    array([  90., 4200.,   nan])
    """
    limits = []
    for part in PARTNERS:
        stated = getattr(drive.beyond, f"{part}_pressure_limit")
        both = [drive.materials[body].allowable(drive.element) for body in (part, "element")]
        known = [pressure for pressure in both if pressure is not None]
        limits.append(stated or (min(known) if len(known) == len(both) else np.nan))
    return np.array(limits)


def static_safety(drive: DriveLike, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> StaticSafety:
    """Pressures of the first `n_drives` virtual drives at twists (n_twist,), rad, against their limits.

    Raises `InputError` as `peak_pressures` does.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> strength = static_safety(load_drive("drive_1"), [4 * ARCMIN, 8 * ARCMIN], n_drives=20)
    >>> strength.min_safety().round(2), str(strength.governing_contacts()[-1])
    (array([1.23, 0.92]), 'crank')
    """
    drive = as_drive(drive)
    found = peak_pressures(drive, twist, n_drives, seed)
    return StaticSafety(found.twist, found.pressure, pressure_limits(drive), LOAD_EXPONENT[drive.element])
