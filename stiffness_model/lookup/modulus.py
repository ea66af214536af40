"""Influence of the Young's modulus of gear and cage on the torque: contacts in series, their shares taken at one load.

All contacts of an element share one exponent p, so their approaches add up to F^(1/p) (c_crank + c_gear + c_cage),
where the coefficient c of a contact is proportional to its material compliance to the power 1/p. A relative error of
the modulus of gear and cage therefore scales every element's force at a given twist by

    scale = (1 + share_gear (g - 1) + share_cage (c - 1))^-p,    g = (1 + material_gear (1/(1 + error) - 1))^(1/p)

with the two contacts' shares of the approach, and c like g. The shares differ a little from element to element. Taking
them from the whole drive at max_twist costs 6e-5 of the full torque for errors of the modulus up to 20 % at the drawn
clearance and 1e-3 over all clearances of the lookup; at `BOUNDS`, 3e-4 and 6e-3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..drawing.drive import Drive
from ..drawing.twist_limits import clearance_reach
from ..elasticity import hertz
from ..errors import expect, expect_number, refuse_unknown
from ..montecarlo.population import simulate
from ..numerics.arrays import Array
from .table_files import require_keys

BOUNDS = (-0.6, 1.5)
"""Range of the relative error of the modulus over which `scale` is validated."""
_N_DRIVES = 32
_PROBE_ERROR = -0.5
"""Relative error at which the shares are determined: the middle of the range of softer moduli."""


@dataclass(frozen=True)
class ModulusShares:
    """Shares of the gear's and the cage's contacts in the total approach, and of their materials in each contact.

    gear, cage: shares of the approach at the drawing's max_twist. gear_material, cage_material: shares of the contact's
    compliance (the rest is the rolling element's). exponent: p. error: maximum difference between `scale` times the
    torque and the solver with the other modulus, at both `BOUNDS` and over the lookup's clearances, relative to the
    full torque there.
    """

    gear: float
    cage: float
    gear_material: float
    cage_material: float
    exponent: float
    error: float = 0.0

    @staticmethod
    def from_dict(table: Any, where: str) -> ModulusShares:
        """The shares of a mapping made by `dataclasses.asdict`. Raises `InputError` for any other."""
        names = [field.name for field in fields(ModulusShares)]
        refuse_unknown("share", require_keys(table, names, where), names, where)
        values = {
            name: expect_number(table[name], "a number within -1e3 ... 1e3", where, low=-1e3, high=1e3)
            for name in names
        }
        expect(0.5 < values["exponent"] < 5, "an exponent of 1 ... 2", values["exponent"], where)
        return ModulusShares(**values)

    def scale(self, error: Any) -> Any:
        """Factor of torque, stiffness and forces for a relative error of the modulus; exactly 1 at 0.

        Accepts numbers, arrays and symbolic expressions.

        >>> ModulusShares(1.0, 0.0, 1.0, 1.0, 1.5).scale(-0.5)
        0.5
        """
        softer = 1 / (1 + error) - 1
        approach = 1
        for share, material in ((self.gear, self.gear_material), (self.cage, self.cage_material)):
            approach = approach + share * ((1 + material * softer) ** (1 / self.exponent) - 1)
        return approach**-self.exponent


def modulus_shares(drive: Drive) -> ModulusShares:
    """Determine the shares with the solver, softening one contact at a time; a fraction of a second."""
    exponent = hertz.POINT_EXPONENT if drive.element == "ball" else hertz.LINE_EXPONENT
    own = drive.materials["element"].compliance
    material = {
        part: drive.materials[part].compliance / (own + drive.materials[part].compliance) for part in ("gear", "cage")
    }
    drawn = _full_torque(drive)
    shares = {}
    for part in ("gear", "cage"):
        softer = _full_torque(with_modulus(drive, _PROBE_ERROR, (part,)))
        own_change = (1 + material[part]) ** (1 / exponent) - 1
        shares[part] = ((softer / drawn) ** (-1 / exponent) - 1) / own_change
    result = ModulusShares(shares["gear"], shares["cage"], material["gear"], material["cage"], exponent)
    return replace(result, error=_measured_error(drive, result))


def with_modulus(drive: Drive, error: float, parts: Sequence[str] = ("gear", "cage")) -> Drive:
    """The drawing with the Young's modulus of some parts changed by a relative error."""
    materials = dict(drive.materials)
    for part in parts:
        drawn = materials[part]
        materials[part] = replace(
            drawn, name=f"{drawn.name}, modulus {error:+.3g}", youngs_modulus=drawn.youngs_modulus * (1 + error)
        )
    return replace(drive, materials=materials)


def _torque(drive: Drive, twist: Array, clearance: float = 0.0) -> Array:
    return simulate(drive, twist, _N_DRIVES, clearance=clearance).torque.mean(axis=0)


def _full_torque(drive: Drive) -> float:
    low, high = _torque(drive, np.array([-drive.max_twist, drive.max_twist]))
    return float(high - low) / 2


def _measured_error(drive: Drive, shares: ModulusShares) -> float:
    twist = np.linspace(-1, 1, 9) * drive.max_twist
    widest = clearance_reach(drive)
    worst = 0.0
    for error in BOUNDS:
        other = with_modulus(drive, error)
        full = _full_torque(other)
        for clearance in (-widest, 0.0, widest):
            gap = shares.scale(error) * _torque(drive, twist, clearance) - _torque(other, twist, clearance)
            worst = max(worst, float(np.abs(gap).max() / full))
    return worst
