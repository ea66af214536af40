"""Hertzian pressure and contact ellipse in every contact of many virtual drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import hertz, sampling
from .beyond.laws import bore
from .contacts import PARTNERS, Contacts, build_contacts, compliances, curvature_sums, usable
from .drawing_file import AnyDrive, as_drive
from .drive import Drive
from .equilibrium import solve
from .errors import expect

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pressures:
    """The greatest pressure at each kind of contact and the contact it stands in.

    All arrays (n_drives, n_twist, 3), the last axis in the order gear, crank, cage. pressure: Pa; major, minor:
    semi-axes of the contact ellipse, m (for rollers: half the length, and the half width). Where major reaches
    the element's radius the theory has ended; in the cage bore that is soon (`hertz.CONFORMITY_LIMIT`).
    """

    twist: Array
    pressure: Array
    major: Array
    minor: Array


def contact_pressures(drive: AnyDrive, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> Pressures:
    """Greatest pressures at twists (n_twist,), rad at the output, of the first `n_drives` virtual drives.

    Raises `InputError` as `simulate` does.

    >>> from stiffness_model import load_drive
    >>> p = contact_pressures(load_drive("drive_1"), [load_drive("drive_1").max_twist], n_drives=20)
    >>> " ".join(f"{1e-9 * x:.1f} GPa" for x in p.pressure.mean(axis=0)[0])
    '4.0 GPa 4.3 GPa 0.5 GPa'
    """
    drive = as_drive(drive)
    angles = np.atleast_1d(np.asarray(twist, float))
    expect(angles.ndim == 1 and bool(np.isfinite(angles).all()), "finite twists in one dimension", twist, "twist")
    expect(n_drives >= 1, "at least one drive", n_drives, "n_drives")
    parts = [part for block, count in sampling.blocks(n_drives) for part in _block(drive, angles, block, count, seed)]
    pressure, major, minor = (np.stack([part[k] for part in parts]) for k in range(3))
    return Pressures(angles, pressure, major, minor)


def _block(drive: Drive, twist: Array, block: int, n_drives: int, seed: int) -> list[Array]:
    """Pressure and semi-axes, (3, n_twist, 3) of every drive of a block."""
    deviations = sampling.draw(drive, block, n_drives, seed)
    keep = usable(drive, deviations.beta)
    contacts = build_contacts(drive, deviations)[keep.ravel()]
    curved = {part: values[keep.ravel()] for part, values in curvature_sums(drive, deviations).items()}
    own, compliance = 1 / deviations.element[keep], compliances(drive)
    result = solve(contacts, twist * drive.ratio)
    forces = {"gear": result.gear, "crank": result.crank, "cage": np.maximum(result.cage_plus, result.cage_minus)}
    found = np.zeros((3, n_drives, len(twist), len(PARTNERS)))
    member = np.repeat(np.arange(n_drives), keep.sum(axis=1))
    for k, part in enumerate(PARTNERS):
        if part == "cage" and drive.beyond.cage_contact == "lamina":
            ellipse = _arc(contacts, forces[part])
        else:
            ellipse = _ellipse(drive, forces[part], compliance[part], curved[part], own)
        for j in np.unique(member):
            of_drive = np.flatnonzero(member == j)
            worst = of_drive[ellipse[2][:, of_drive].argmax(axis=1)]
            for row, values in enumerate((ellipse[2], ellipse[0], ellipse[1])):
                found[row, j, :, k] = values[np.arange(len(twist)), worst]
    return [found[:, j] for j in range(n_drives)]


def _arc(contacts: Contacts, force: Array) -> tuple[Array, Array, Array]:
    """The same of the conforming bores: half the arc's length, half its width and the pressure in its middle."""
    law, radius = bore(contacts), contacts.element_radius
    approach, _ = law.approach(force)
    line_load = law.greatest_line_load(approach)
    half_width, pressure = hertz.line_contact_pressure(line_load, law.compliance, 1 / radius, 1.0)
    return law.half_angle(approach) * radius, half_width, pressure


def _ellipse(drive: Drive, force: Array, compliance: float, curved: Array, own: Array) -> tuple[Array, Array, Array]:
    """Semi-axes, m, and pressure, Pa, of contacts under `force`, (n_twist, n)."""
    if drive.element == "ball":
        return hertz.point_contact_ellipse(force, compliance, curved, own)
    half_width, pressure = hertz.line_contact_pressure(force, compliance, curved, drive.element_length)
    return np.full_like(force, drive.element_length / 2), half_width, pressure
