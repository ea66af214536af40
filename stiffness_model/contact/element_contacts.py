"""The contacts of every element: all that its equilibrium needs and that does not change with the crank's twist."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ..drawing.drive import Drive
from ..drawing.options import ModelOptions
from ..drawing.sampling import Deviations
from ..elasticity import hertz
from ..errors import expect
from ..geometry.ball_path import profile_curvature
from ..geometry.exact_profile import GearProfile
from ..numerics.arrays import Array
from .inertia import inertia_force

CONTACTS = ("gear", "crank", "cage t+", "cage t-")
"""The contacts C1 to C4, in the order of the last axis of `Population.contact_force`."""
PARTNERS = ("gear", "crank", "cage")
"""The parts that an element touches."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Constants of the contacts C1 (gear), C2 (crank), C3 and C4 (cage walls t+ and t-) of n elements.

    All arrays have the shape (n,) unless stated otherwise. beta: rad; path_radius: c(beta), m; normal_r, normal_t:
    outward unit normal of the gear; gear_gap: gap q - r_RE at the gear with the element in its neutral position, m;
    radius_sum: r_RE + r_crank, m; cage_gap: gap r_cage - r_RE to either wall, m, negative for a ball larger than its
    bore; stiffness_*: K of F = K d^exponent, N/m^exponent; capped: whether `hertz.CONFORMITY_LIMIT` bounds the cage
    stiffness; eccentric: number of the element's eccentric, counted through all drives; element_radius: m; load:
    (n, 2) radial and tangential inertia force, N. eccentricity: e, m; eccentrics: number in one drive; ratio: signed;
    cage_compliance: sum of (1 - nu^2)/E, 1/Pa; profile: the gear's exact profile, or None for the linearised contact.
    """

    beta: Array
    path_radius: Array
    normal_r: Array
    normal_t: Array
    gear_gap: Array
    radius_sum: Array
    cage_gap: Array
    stiffness_gear: Array
    stiffness_crank: Array
    stiffness_cage: Array
    capped: NDArray[np.bool_]
    eccentric: NDArray[np.intp]
    element_radius: Array
    load: Array
    eccentricity: float
    exponent: float
    eccentrics: int
    ratio: float
    cage_compliance: float
    options: ModelOptions
    profile: GearProfile | None

    def __len__(self) -> int:
        return len(self.beta)

    def __getitem__(self, index: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Contacts:
        """Some of the elements, by a slice, a mask or an index array."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{name: v[index] for name, v in values.items() if isinstance(v, np.ndarray)})


def build_contacts(
    drive: Drive, deviations: Deviations, clearance: float = 0.0, mask: NDArray[np.bool_] | None = None
) -> Contacts:
    """Contacts of the elements of `deviations` (n_drives, n_elements) or (n_elements,), flattened drive after drive.

    clearance: m, added to the gear's clearance everywhere (positive: backlash, negative: preload). mask: shape of the
    deviations, the elements to build; all if None. Raises `InputError` where bearing or housing couple the elements
    and a row of the deviations is not a whole drive.
    """
    eccentric = _eccentric_numbers(drive, deviations)
    if mask is not None:
        eccentric = eccentric[mask.ravel()]
        deviations = Deviations(*(getattr(deviations, f.name)[mask] for f in fields(Deviations)))
    beta, r_element = deviations.beta.ravel(), deviations.element.ravel()
    q = deviations.gear.ravel() + clearance
    path_radius, normal_r, normal_t = drive.path.radius_and_normal(beta, drive.orientation)
    compliance = compliances(drive)
    capped = np.zeros(beta.shape, bool)
    if drive.element == "ball":
        exponent = hertz.POINT_EXPONENT
        curved, ball = curvature_sums(drive, deviations, clearance), 1 / r_element
        stiffness = {part: hertz.point_stiffness(compliance[part], curved[part], ball) for part in PARTNERS}
        if drive.beyond.cage_contact == "hertz":
            capped = hertz.conformity(curved["cage"], ball) > hertz.CONFORMITY_LIMIT
    else:
        exponent = hertz.LINE_EXPONENT
        stiffness = {
            part: np.full(beta.shape, hertz.line_stiffness(compliance[part], drive.element_length)) for part in PARTNERS
        }
    return Contacts(
        beta=beta,
        path_radius=path_radius,
        normal_r=normal_r,
        normal_t=normal_t,
        gear_gap=q - r_element,
        radius_sum=r_element + deviations.crank.ravel(),
        cage_gap=deviations.cage.ravel() - r_element,
        stiffness_gear=stiffness["gear"],
        stiffness_crank=stiffness["crank"],
        stiffness_cage=stiffness["cage"],
        capped=capped,
        eccentric=eccentric,
        element_radius=r_element,
        load=inertia_force(drive, beta, r_element),
        eccentricity=drive.eccentricity,
        exponent=exponent,
        eccentrics=drive.eccentrics,
        ratio=drive.ratio,
        cage_compliance=compliance["cage"],
        options=drive.beyond,
        profile=_profile(drive, compliance["gear"]) if drive.beyond.gear_contact == "exact" else None,
    )


def _eccentric_numbers(drive: Drive, deviations: Deviations) -> NDArray[np.intp]:
    """Number of every element's eccentric: elements k, k + eccentrics, ... of a drive share one."""
    beta = np.atleast_2d(deviations.beta)
    expect(
        not drive.beyond.couples_elements or beta.shape[1] == drive.elements,
        f"whole drives of {drive.elements} elements, because bearing or housing couple them",
        beta.shape[1],
        "elements in a row",
    )
    within_drive = np.arange(beta.shape[1]) % drive.eccentrics
    return (drive.eccentrics * np.arange(len(beta))[:, None] + within_drive).ravel()


def _profile(drive: Drive, compliance: float) -> GearProfile:
    line = None if drive.element == "ball" else float(hertz.line_stiffness(compliance, drive.element_length))
    return GearProfile(drive.path, drive.orientation, compliance, line)


def compliances(drive: Drive) -> dict[str, float]:
    """Sum of (1 - nu^2)/E of the element and each of `PARTNERS`, 1/Pa."""
    return {part: drive.materials["element"].compliance + drive.materials[part].compliance for part in PARTNERS}


def curvature_sums(drive: Drive, deviations: Deviations, clearance: float = 0.0) -> dict[str, Array]:
    """Curvature sum, 1/m, (n,), of the contact with each of `PARTNERS`, in the plane in which the partner is curved.

    For gear and crank that is the plane of the drive, for the cage the plane normal to the bore's axis; a roller's
    slot has flat walls. In the other principal plane the partner is straight and the sum is the element's curvature.
    """
    own = 1 / deviations.element.ravel()
    gear = profile_curvature(drive.path.curvature(deviations.beta.ravel()), deviations.gear.ravel() + clearance)
    bore = 1 / deviations.cage.ravel() if drive.element == "ball" else 0.0
    return {"gear": own + gear, "crank": own + 1 / deviations.crank.ravel(), "cage": own - bore}
