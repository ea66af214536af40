"""Hertzian pressure and contact ellipse in every contact of many virtual drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.element_contacts import PARTNERS, Contacts, compliances, curvature_sums
from ..contact.laws import bore_law
from ..contact.usable_elements import usable_elements
from ..display import one_line
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..drawing.twist_limits import expect_twists
from ..elasticity import hertz
from ..equilibrium.closed_form import solve_chunks
from ..equilibrium.solution import Equilibrium, Status
from ..errors import expect, warn_not_converged
from ..io.drawing_toml import DriveLike, as_drive
from ..memory import expect_memory
from ..numerics.arrays import Array


@dataclass(frozen=True)
class Pressures:
    """Greatest pressure of each kind of contact, and the ellipse of that contact.

    All arrays (n_drives, n_twist, 3), the last axis in the order gear, crank, cage. pressure: Pa; major, minor:
    semi-axes of the contact ellipse, m (rollers: half the length and half the width). Where major reaches the element's
    radius, Hertz's half-space theory is no longer valid; in the cage's bore that happens early
    (`hertz.CONFORMITY_LIMIT`). twist: (n_twist,) rad.
    """

    twist: Array
    pressure: Array
    major: Array
    minor: Array

    def __repr__(self) -> str:
        return one_line(self)


def contact_pressures(drive: DriveLike, twist: ArrayLike, n_drives: int = 100, seed: int = 0) -> Pressures:
    """Greatest pressures of the first `n_drives` virtual drives of `seed`.

    drive: a drive, a preset's name or a drawing's path. twist: (n_twist,) rad at the output. Every drive stands at its
    own random angle, as in `simulate`. Ratings need the maximum over a turn, which is higher:
    `peak_pressure.peak_pressures`. Raises `InputError` as `simulate` does.

    >>> from stiffness_model import load_drive
    >>> p = contact_pressures(load_drive("drive_1"), [load_drive("drive_1").max_twist], n_drives=20)
    >>> " ".join(f"{1e-9 * x:.1f} GPa" for x in p.pressure.mean(axis=0)[0])
    '4.0 GPa 4.3 GPa 0.5 GPa'
    """
    drive = as_drive(drive)
    angles = expect_twists(drive, twist)
    expect(n_drives >= 1, "at least one drive", n_drives, "n_drives")
    expect_memory_for(n_drives, len(angles))
    blocks = [_block(drive, angles, block, count, seed) for block, count in sampling.blocks(n_drives)]
    warn_not_converged(sum(lost for _, lost in blocks), n_drives * drive.elements * len(angles), drive.name)
    pressure, major, minor = np.concatenate([found for found, _ in blocks], axis=1)
    return Pressures(angles, pressure, major, minor)


def expect_memory_for(n_drives: int, n_twist: int) -> None:
    """Raise `InputError` if pressures and semi-axes of so many drives and twists exceed the available memory."""
    # The arrays exist twice: as blocks and concatenated.
    expect_memory(
        2 * 9 * 8.0 * n_drives * n_twist,
        f"pressures of {n_drives} virtual drives at {n_twist} twists",
        "take fewer drives or twists",
    )


def _block(drive: Drive, twist: Array, block: int, n_drives: int, seed: int) -> tuple[Array, int]:
    """Pressure and semi-axes, (3, n_drives, n_twist, 3), of a block, and how many elements found no equilibrium."""
    elements = usable_elements(drive, sampling.draw(drive, block, n_drives, seed))
    lost, found = 0, []
    for _, result in solve_chunks(elements.contacts, twist * drive.ratio):
        lost += int((result.status == Status.NOT_CONVERGED).sum())
        found.append(
            max_per_drive(drive, elements.contacts, elements.deviations, result, elements.drive_index, n_drives)
        )
    return np.concatenate(found, axis=2), lost


def max_per_drive(
    drive: Drive,
    contacts: Contacts,
    deviations: Deviations,
    result: Equilibrium,
    owner: NDArray[np.intp],
    n_drives: int,
) -> Array:
    """Pressure and semi-axes, (3, n_drives, n_twist, 3), of each drive's contact with the greatest pressure.

    deviations: of the same n elements as `contacts`, (n,); owner: (n,) index of each element's drive, ascending. A
    drive without elements has zeros.
    """
    found = np.zeros((3, n_drives, len(result.gear), len(PARTNERS)))
    for k, part in enumerate(PARTNERS):
        major, minor, pressure = element_pressures(drive, contacts, deviations, result, part)
        for j in np.unique(owner):
            of_drive = slice(*np.searchsorted(owner, (j, j + 1)))
            worst = pressure[:, of_drive].argmax(axis=1)[:, None]
            for row, values in zip(found, (pressure, major, minor), strict=True):
                row[j, :, k] = np.take_along_axis(values[:, of_drive], worst, axis=1)[:, 0]
    return found


def element_pressures(
    drive: Drive, contacts: Contacts, deviations: Deviations, result: Equilibrium, part: str
) -> tuple[Array, Array, Array]:
    """Semi-axes, m, and pressure, Pa, (n_twist, n), of every element's contact with `part` of `PARTNERS`."""
    forces = {"gear": result.gear, "crank": result.crank, "cage": np.maximum(result.cage_plus, result.cage_minus)}
    if part == "cage" and drive.beyond.cage_contact == "lamina":
        return _arc(contacts, forces[part])
    return _ellipse(
        drive, forces[part], compliances(drive)[part], curvature_sums(drive, deviations)[part], 1 / deviations.element
    )


def _arc(contacts: Contacts, force: Array) -> tuple[Array, Array, Array]:
    """The same for conforming bores: half the arc's length, half its width, and the pressure in its middle."""
    law, radius = bore_law(contacts), contacts.element_radius
    approach, _ = law.approach(force)
    line_load = law.peak_line_load(approach)
    half_width, pressure = hertz.line_contact_pressure(line_load, law.compliance, 1 / radius, 1.0)
    return law.half_angle(approach) * radius, half_width, pressure


def _ellipse(drive: Drive, force: Array, compliance: float, curved: Array, own: Array) -> tuple[Array, Array, Array]:
    """Semi-axes, m, and pressure, Pa, of contacts under `force`, (n_twist, n)."""
    if drive.element == "ball":
        return hertz.point_contact_ellipse(force, compliance, curved, own)
    half_width, pressure = hertz.line_contact_pressure(force, compliance, curved, drive.element_length)
    return np.full_like(force, drive.element_length / 2), half_width, pressure


def wall_forces(contacts: Contacts, net: Array) -> tuple[Array, Array]:
    """Forces, N, (n,), on the loaded and on the opposite cage wall, from the net force between element and cage.

    A ball larger than its bore by 2 a presses both walls: K ((a + x)^p - (a - x)^p) = net, where x is the displacement
    from the middle, until contact with the opposite wall is lost at x = a.
    """
    loaded, other = np.abs(net), np.zeros_like(net)
    tight = contacts.cage_gap < 0
    if tight.any():
        p = contacts.exponent
        squeeze = contacts.stiffness_cage[tight] * (-contacts.cage_gap[tight]) ** p
        wanted = loaded[tight] / squeeze
        x = np.minimum(wanted / 2**p, 1.0)
        for _ in range(6):
            value = (1 + x) ** p - (1 - x) ** p - wanted
            x = np.clip(x - value / (p * ((1 + x) ** (p - 1) + (1 - x) ** (p - 1))), 0.0, 1.0)
        lifted = wanted >= 2**p
        loaded[tight] = np.where(lifted, loaded[tight], squeeze * (1 + x) ** p)
        other[tight] = np.where(lifted, 0.0, squeeze * (1 - x) ** p)
    return loaded, other
