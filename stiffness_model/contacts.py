"""The contacts of every element: what its equilibrium needs and what stays fixed while the crank twists."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from . import hertz
from .drive import Drive
from .geometry import profile_curvature
from .sampling import Deviations

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Contacts:
    """Constants of the contacts C1 (gear), C2 (crank), C3 and C4 (cage walls t+ and t-) of n elements.

    All arrays have the shape (n,). beta: rad; path_radius: c(beta), m; normal_r, normal_t: outward unit normal
    of the gear; gear_gap: clearance q - r_RE at the gear with the element in its neutral position, m; reach:
    r_RE + r_crank, m; cage_gap: clearance r_cage - r_RE to either wall, m, negative for a ball larger than its
    bore; stiffness_*: K of F = K d^exponent, N/m^exponent; capped: where the conformity rule of `hertz` held
    the cage stiffness. eccentricity: e, m.
    """

    beta: Array
    path_radius: Array
    normal_r: Array
    normal_t: Array
    gear_gap: Array
    reach: Array
    cage_gap: Array
    stiffness_gear: Array
    stiffness_crank: Array
    stiffness_cage: Array
    capped: NDArray[np.bool_]
    eccentricity: float
    exponent: float

    def __len__(self) -> int:
        return len(self.beta)

    def __getitem__(self, index: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Contacts:
        """Some of the elements, by a slice, a mask or an index array."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{name: v[index] for name, v in values.items() if isinstance(v, np.ndarray)})


def build_contacts(drive: Drive, deviations: Deviations, gear_shift: float = 0.0) -> Contacts:
    """Contacts of the elements of `deviations` (flattened, drive after drive).

    gear_shift: m, added to the gear's clearance everywhere (positive: play, negative: preload).
    """
    beta, r_element = deviations.beta.ravel(), deviations.element.ravel()
    r_crank, r_cage, q = deviations.crank.ravel(), deviations.cage.ravel(), deviations.gear.ravel() + gear_shift
    path = drive.path
    normal_r, normal_t = path.normal(beta, drive.orientation)
    compliance = {part: drive.materials["element"].compliance + drive.materials[part].compliance
                  for part in ("gear", "crank", "cage")}
    capped = np.zeros(beta.shape, bool)
    if drive.element == "ball":
        exponent = hertz.POINT_EXPONENT
        across = 2 / r_element
        ball = 1 / r_element
        # In-plane curvature sums; across the plane gear and crank are straight, the bore along its axis.
        gear = across + profile_curvature(path.curvature(beta), q)
        crank = across + 1 / r_crank
        cage = across - 1 / r_cage
        stiffness = {"gear": hertz.point_stiffness(compliance["gear"], gear - ball, ball),
                     "crank": hertz.point_stiffness(compliance["crank"], crank - ball, ball),
                     "cage": hertz.point_stiffness(compliance["cage"], cage - ball, ball)}
        capped = hertz.conformity(cage - ball, ball) > hertz.CONFORMITY_LIMIT
    else:
        exponent = hertz.LINE_EXPONENT
        stiffness = {part: np.full(beta.shape, hertz.line_stiffness(compliance[part], drive.element_length))
                     for part in compliance}
    return Contacts(
        beta=beta, path_radius=path.radius(beta), normal_r=normal_r, normal_t=normal_t,
        gear_gap=q - r_element, reach=r_element + r_crank, cage_gap=r_cage - r_element,
        stiffness_gear=stiffness["gear"], stiffness_crank=stiffness["crank"], stiffness_cage=stiffness["cage"],
        capped=capped, eccentricity=drive.eccentricity, exponent=exponent,
    )


def usable(drive: Drive, beta: Array) -> NDArray[np.bool_]:
    """Which positions lie on the part of the profile that exists."""
    return np.abs(beta) <= drive.usable_limit
