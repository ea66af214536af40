"""Positions of all parts of a drive at a crank angle: exact kinematics, without backlash and load.

Polar angles are counter-clockwise from the x axis, the gear is fixed and the cage turns. Row r is one eccentric with
its elements. An element at the angle theta meets the eccentric at beta = psi - theta and the profile at the phase z
(theta - gamma) = orientation beta. The bores of a row are therefore on |i| seats spaced by 2 pi/|i|; a row with fewer
elements leaves some of them empty.

The positions beta of all rows are spread as in eq. 20 of the paper (as if empty seats were occupied). This needs either
the rows' profiles or the rows of bores to be rotated relative to each other. If lobes and eccentrics have no common
factor, one profile serves all rows. Otherwise (the presets: 30 lobes, 3 eccentrics at 120 degrees) one profile would
give all rows the same beta, and `gear` states each row's rotation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...display import one_line
from ...drawing.drive import Drive
from ...drawing.twist_limits import expect_crank_angle
from ...errors import expect, expect_number
from ...geometry.ball_path import wrap
from ...numerics.arrays import Array


@dataclass(frozen=True)
class Layout:
    """The parts of a drive at one crank angle; m = eccentrics, n = elements on each of them.

    crank: (m,) angle of each eccentric, rad. bore: (m, n) angles of elements and bores, rad. beta: (m, n) positions on
    the profile, rad in (-pi, pi]. gear: (m,) rotation of each row's profile, rad. eccentric: (m, 2) centres of the
    eccentrics, m. centre: (m, n, 2) centres of the elements, m.
    """

    crank: Array
    bore: Array
    beta: Array
    gear: Array
    eccentric: Array
    centre: Array

    def __repr__(self) -> str:
        return one_line(self)


def place_parts(drive: Drive, angle: float = 0.0, start: float = 0.0) -> Layout:
    """The layout with the first eccentric at `angle`, rad.

    start: position beta, rad, of the first element with the eccentric at 0, which is how cage and crank were assembled;
    the gear is rotated to fit. Raises `InputError` if a row has more elements than seats.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1")
    >>> turned = place_parts(drive, 2 * np.pi).bore - place_parts(drive).bore
    >>> f"{2 * np.pi / turned[0, 0]:.1f}"
    '-29.0'
    >>> [np.degrees(place_parts(load_drive("drive_1", lobes=z)).gear).round(9).tolist() for z in (30, 28)]
    [[0.0, -4.0, 4.0], [0.0, 0.0, 0.0]]
    """
    expect_crank_angle(drive, expect_number(angle, "a finite crank angle in rad", "angle"))
    rows, lobes, ratio = drive.eccentrics, drive.lobes, _n_seats(drive)
    row = np.arange(rows)
    first = 2 * np.pi / ratio * ((row * _step(drive) / rows)[:, None] + occupied_seats(drive)) + start
    eccentric_angle = 2 * np.pi * _order(drive) / rows
    turn = eccentric_angle - first[:, 0] * (1 + drive.orientation / lobes)
    pitch = 2 * np.pi / lobes
    gear = turn - pitch * np.round(turn / pitch)
    beta, crank = first + angle * lobes / ratio, eccentric_angle + angle
    bore = eccentric_angle[:, None] - first + angle * drive.orientation / ratio
    return Layout(
        crank,
        bore,
        wrap(beta),
        np.where(np.abs(gear) < 1e-12, 0.0, gear),
        drive.eccentricity * unit_vector(crank),
        drive.path.radius(beta)[..., None] * unit_vector(bore),
    )


def occupied_seats(drive: Drive) -> NDArray[np.intp]:
    """Indices of the occupied ones of a row's |i| seats, (n,): all, or as many as there are elements, evenly spread.

    Raises `InputError` for more elements than seats.

    >>> from stiffness_model import load_drive
    >>> occupied_seats(load_drive("drive_1", elements=3 * 14, element_radius="4 mm")).tolist()
    [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26]
    """
    count, places = drive.elements_per_row, _n_seats(drive)
    expect(
        count <= places,
        f"at most {places} elements on one eccentric, one for every seat that the ratio gives",
        count,
        drive.name,
    )
    return np.arange(count) * places // count


def period_turns(drive: Drive) -> int:
    """Turns of the crank after which the picture repeats, with each element in another's position.
    >>> from stiffness_model import load_drive
    >>> period_turns(load_drive("drive_1")), period_turns(load_drive("drive_1", elements=60))
    (1, 29)
    """
    count, places = len(occupied_seats(drive)), _n_seats(drive)
    return places // count if places % count == 0 else places


def unit_vector(angle: Array) -> Array:
    """Unit vectors (..., 2) at polar angles (...), rad."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _n_seats(drive: Drive) -> int:
    return drive.seats.seats


def _order(drive: Drive) -> NDArray[np.int64]:
    """Index of each row's eccentric, counted in the crank's direction and chosen so that one profile serves all rows if
    possible.
    """
    rows, step = drive.eccentrics, _step(drive)
    if math.gcd(drive.lobes, rows) == 1 == math.gcd(step, rows):
        return np.arange(rows) * step * pow(drive.lobes, -1, rows) % rows
    return np.arange(rows)


def _step(drive: Drive) -> int:
    """Seats from one element to the next if elements are spread evenly over all seats, else 1."""
    step, remainder = divmod(_n_seats(drive), drive.elements_per_row)
    return step if remainder == 0 else 1
