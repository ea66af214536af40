"""Which seats the elements of a row occupy, and where the first of them stands.

A row has as many seats as the drive's transmission ratio, and each seat faces a lobe of its own at every turn. Where a
drawing has fewer elements than seats it does not say which of them are free: the elements are spread as evenly as the
seats allow, as in `stiffness_model.rotation`, or stand side by side, with all free seats in one gap. Either way it does
not say which element comes first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stiffness_model.drawing.drive import Drive

PLASTIC = 1.32471795724474602596
"""Root of x^3 = x + 1: multiples of 1/x and 1/x^2 are spread evenly over a square, however many there are (Roberts, The
Unreasonable Effectiveness of Quasirandom Sequences, 2018)."""


@dataclass(frozen=True)
class Seating:
    """start: rad, position of the first element at crank angle 0; seats: of the elements of a row, by number."""

    start: float
    seats: tuple[int, ...]


def even_seats(drive: Drive) -> tuple[int, ...]:
    """The seats nearest to an even spacing of a row's elements."""
    row = drive.seats
    return tuple(np.round(np.arange(row.elements) * row.seats / row.elements).astype(int).tolist())


def spread_seatings(drive: Drive, count: int) -> tuple[Seating, ...]:
    """So many seatings whose first elements are spread over the turn and over the distance of the elements; where there
    are free seats, in turn as even as they allow and side by side."""
    kinds = tuple(dict.fromkeys((even_seats(drive), tuple(range(drive.seats.elements)))))
    step = 2 * math.pi / drive.elements
    return tuple(
        Seating(step * (int(drive.elements * (k / PLASTIC % 1.0)) + k / PLASTIC**2 % 1.0), seats)
        for k in range(math.ceil(count / len(kinds)))
        for seats in kinds
    )[:count]
