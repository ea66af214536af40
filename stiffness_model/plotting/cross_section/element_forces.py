"""The contact forces of one drive, as vectors in the plane of its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...contact.usable_elements import is_usable, usable_elements
from ...display import one_line
from ...drawing.drive import Drive
from ...drawing.sampling import Deviations
from ...drawing.twist_limits import expect_twists
from ...equilibrium.closed_form import Status, solve
from ...errors import warn_not_converged
from ...numerics.arrays import Array
from .layout import Layout, place_parts, unit_vector

MIN_FORCE_RATIO, MIN_FORCE = 1e-6, 1e-6
"""A contact counts as loaded above this share of the greatest force and above this force, N; below is rounding error.
"""


@dataclass(frozen=True)
class ElementForces:
    """Forces on the elements of one drive at a twist; m rows of n elements, contacts in the order of `CONTACTS`.

    twist: rad at the output. layout: before the twist. deviations: (1, m n), in the order of `sampling`. usable: (m,
    n), whether an element is on the existing part of the profile. force: (m, n, 4, 2) N, on the element by gear, crank,
    cage t+ and t-. point: (m, n, 4, 2) m, points of contact. displacement: (m, n, 2) m, radial and tangential, of the
    centres. torque: (m, n) N.m on the output, by element. not_converged: elements without equilibrium, whose forces
    count as zero.
    """

    twist: float
    layout: Layout
    deviations: Deviations
    usable: NDArray[np.bool_]
    force: Array
    point: Array
    displacement: Array
    torque: Array
    not_converged: int = 0

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def magnitude(self) -> Array:
        """Magnitudes of the forces, (m, n, 4) N."""
        return np.hypot(self.force[..., 0], self.force[..., 1])

    @property
    def significant(self) -> Array:
        """`magnitude` with zeros below `MIN_FORCE_RATIO` and `MIN_FORCE`."""
        size = self.magnitude
        return np.where(size > max(MIN_FORCE_RATIO * size.max(initial=0.0), MIN_FORCE), size, 0.0)


def solve_element_forces(
    drive: Drive,
    deviations: Deviations,
    twist: float,
    angle: float = 0.0,
    start: float = 0.0,
    weight: Array | None = None,
) -> ElementForces:
    """Forces at `twist`, rad at the output, with the crank twisted from `angle`, rad, and cage and gear fixed.

    deviations: of one drive (`rotation.elements_at`, `sampling.nominal`); its positions are replaced by those of the
    layout whose first element stands at `start`, rad, on the profile (`layout.place_parts`). weight: (1, n) share of
    every element in the torque, as `rotation.elements_at` gives it; an element of weight 0 carries nothing. Without
    weights, every element on the existing part of the profile counts fully. Raises `InputError` for a twist or an angle
    that is not finite or beyond `drawing.twist_limits`; warns with `NotConvergedWarning`.

    >>> from stiffness_model import load_drive
    >>> from stiffness_model.drawing import sampling
    >>> drive = load_drive("drive_1")
    >>> forces = solve_element_forces(drive, sampling.nominal(drive), drive.max_twist)
    >>> bool(forces.torque.sum() > 0), bool((np.abs(forces.force.sum(axis=2)) < 1e-6 * forces.magnitude.max()).all())
    (True, True)
    """
    expect_twists(drive, twist)
    layout = place_parts(drive, angle, start)
    rows, count = layout.beta.shape
    here = Deviations(_flat(layout.beta), deviations.element, deviations.crank, deviations.cage, deviations.gear)
    share = is_usable(drive, here.beta).astype(float).ravel() if weight is None else weight.ravel()
    keep = share > 0
    contacts = usable_elements(drive, here, mask=keep.reshape(here.beta.shape)).contacts
    crank_twist = twist * drive.ratio
    result = solve(contacts, [crank_twist])
    lost = int((result.status == Status.NOT_CONVERGED).sum())
    warn_not_converged(lost, rows * count, drive.name)
    columns = np.zeros((7, rows * count))
    for k, values in enumerate(
        (
            result.gear,
            result.crank,
            result.cage_plus,
            result.cage_minus,
            result.output_torque,
            result.radial,
            result.tangential,
        )
    ):
        columns[k, keep] = values[0]
    columns[4] *= share
    # Element k = r + n_ecc j is the j-th of eccentric r.
    gear, crank, plus, minus, torque, radial, tangential = columns.reshape(7, count, rows).transpose(0, 2, 1)

    n_r, n_t = drive.path.normal(layout.beta, drive.orientation)
    c, turned = drive.path.radius(layout.beta), layout.beta + crank_twist
    d_r = c + radial - drive.eccentricity * np.cos(turned)
    d_t = tangential - drive.eccentricity * np.sin(turned)
    length = np.hypot(d_r, d_t)
    zero, one = np.zeros_like(c), np.ones_like(c)
    # The element's outward normals at the four contacts, radial and tangential.
    normal = np.stack(
        [
            np.stack([n_r, n_t], -1),
            np.stack([-d_r / length, -d_t / length], -1),
            np.stack([zero, one], -1),
            np.stack([zero, -one], -1),
        ],
        axis=2,
    )
    size = np.stack([gear, crank, plus, minus], axis=-1)[..., None]
    ball = deviations.element.reshape(count, rows).T[..., None, None]
    middle = np.stack([c + radial, tangential], -1)[:, :, None]
    axes = np.stack([unit_vector(layout.bore), unit_vector(layout.bore + np.pi / 2)], axis=-2)[:, :, None]
    return ElementForces(
        float(twist),
        layout,
        here,
        keep.reshape(count, rows).T,
        _in_plane(-size * normal, axes),
        _in_plane(middle + ball * normal, axes),
        np.stack([radial, tangential], -1),
        torque,
        lost,
    )


def _flat(by_row: Array) -> Array:
    """(m, n) in the order of `sampling`, (1, m n): elements alternate between the eccentrics."""
    return by_row.T.reshape(1, -1)


def _in_plane(vectors: Array, axes: Array) -> Array:
    """Vectors (..., 2), radial and tangential, in Cartesian coordinates; axes: (..., 2, 2), the two unit vectors."""
    return vectors[..., :1] * axes[..., 0, :] + vectors[..., 1:] * axes[..., 1, :]
