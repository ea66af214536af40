"""Static safety: contact pressure against its limit, over twist, and the contact that governs.

ISO 76 rates the most heavily loaded contact, so the pressures are the maxima over a turn of each virtual drive
(`peak_pressure`). Reported are the values that nine drives of ten meet: the 90th percentile of the pressure and the
10th percentile of the safety.

For hardened bearing steel on bearing steel the limit is that of ISO 76 for static load ratings: 4200 MPa in the centre
of the most heavily loaded point contact (balls) and 4000 MPa in a line contact (rollers), at which the permanent
deformation is about 0.0001 of the element's diameter. It is a limit for static loads, not for endurance. The standard
has no limit for other materials: the drawing states one, for a contact (`gear_pressure_limit`, ...) or for a material
(`allowable_pressure`), for instance 1.6 times the yield stress, where a point contact first yields below its surface
(Johnson, Contact Mechanics, eq. 6.9). Without a limit no safety is reported, and reports say so.
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
"""Exponent of the pressure to which the load is proportional: 3 for point, 2 for line contact (Hertz)."""
REACHED, NOT_REACHED, EXCEEDED, NO_LIMIT = "reached", "not reached", "exceeded", "no limit"


@dataclass(frozen=True)
class PermissibleTorque:
    """The torque, N.m, up to which the safety exceeds 1.

    status: "reached": the safety falls to 1 at `torque`; "not reached": it exceeds 1 at all twists examined, up to
    `torque`; "exceeded": it is 1 or below at the first loaded twist, at `torque`; "no limit": no loaded contact has a
    known limit, and `torque` is NaN.
    """

    torque: float
    status: str

    def __str__(self) -> str:
        return {
            REACHED: f"falls to 1 at {self.torque:.0f} N.m",
            NOT_REACHED: f"stays above 1 up to {self.torque:.0f} N.m",
            EXCEEDED: f"is 1 or below already at {self.torque:.1f} N.m, the smallest torque examined",
            NO_LIMIT: "unknown",
        }[self.status]


@dataclass(frozen=True)
class GoverningContact:
    """The governing contact at one twist.

    contact: the contact with the smallest safety, "" if no loaded contact has a limit; no_limit: pressure, Pa, of the
    loaded contacts without a known limit, by contact.
    """

    contact: str
    no_limit: dict[str, float]

    def __str__(self) -> str:
        unknown = ", ".join(f"{part} at {pressure / 1e6:.0f} MPa" for part, pressure in self.no_limit.items())
        return "; ".join(x for x in (self.contact, f"no limit known: {unknown}" if unknown else "") if x) or "none"


@dataclass(frozen=True)
class StaticSafety:
    """Pressures of virtual drives and their limits, the last axes in the order gear, crank, cage.

    twist: (n_twist,) rad; pressure: (n_drives, n_twist, 3) Pa, each drive's maximum over a turn; limit: (3,) Pa, NaN
    where none is known; load_exponent: the load is proportional to this power of the pressure.
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
        """90th percentile of the pressure over the drives, (n_twist, 3) Pa."""
        return np.percentile(self.pressure, BAND[1], axis=0)

    def min_safety(self) -> Array:
        """Limit over pressure at the most heavily loaded contact with a known limit, (n_twist,): the value that nine
        drives of ten reach or exceed. Infinite without load, NaN if no limit is known.
        """
        known = np.isfinite(self.limit)
        if not known.any():
            return np.full(len(self.twist), np.nan)
        return _inverse(np.percentile(self._utilisation[..., known].max(axis=2), BAND[1], axis=0))

    def governing_contacts(self) -> list[GoverningContact]:
        """The contact with the smallest safety at every twist, and the loaded contacts without a limit."""
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
        """The torque at which `min_safety` falls to 1; torque: (n_twist,) N.m at the twists, ascending.

        Contacts without a known limit are left out: see `governing_contacts`.
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
        # Pressure is nearly a power of the torque: interpolate the logarithm.
        x = np.log(safety[k - 1]) / (np.log(safety[k - 1]) - np.log(safety[k]))
        return PermissibleTorque(float(values[k - 1] + x * (values[k] - values[k - 1])), REACHED)


def _inverse(use: Array) -> Array:
    with np.errstate(divide="ignore"):
        return 1 / use


def pressure_limits(drive: Drive) -> Array:
    """Limits, (3,) Pa, at gear, crank and cage: the drawing's, or the smaller of both materials' allowable pressures.

    NaN where one of the two is not known. For 100Cr6 on 100Cr6 this is ISO 76's limit.

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
    """Peak pressures of the first `n_drives` virtual drives at twists (n_twist,), rad at the output, and their limits.

    Raises `InputError` as `peak_pressures` does.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> rating = static_safety(load_drive("drive_1"), [4 * ARCMIN, 8 * ARCMIN], n_drives=20)
    >>> rating.min_safety().round(2), str(rating.governing_contacts()[-1])
    (array([1.23, 0.92]), 'crank')
    """
    drive = as_drive(drive)
    found = peak_pressures(drive, twist, n_drives, seed)
    return StaticSafety(found.twist, found.pressure, pressure_limits(drive), LOAD_EXPONENT[drive.element])
