"""Which seats the elements of a row occupy, and where the first of them stands.

A row has as many seats as the drive's transmission ratio, and each seat faces a lobe of its own at every turn. Where a
drawing has fewer elements than seats it does not say which of them are free: the elements are spread as evenly as the
seats allow, as in `stiffness_model.rotation`, or stand side by side, with all free seats in one gap. Either way it does
not say which element comes first. Only with the right seats do the same lobes return when they return in the record.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stiffness_model.drawing.drive import Drive


@dataclass(frozen=True)
class Seating:
    """start: rad, position of the first element at crank angle 0; seats: of the elements of a row, by number."""

    start: float
    seats: tuple[int, ...]


def even_seats(drive: Drive) -> tuple[int, ...]:
    """The seats nearest to an even spacing of a row's elements."""
    row = drive.seats
    return tuple(np.round(np.arange(row.elements) * row.seats / row.elements).astype(int).tolist())


def possible_seatings(drive: Drive) -> tuple[Seating, ...]:
    """All seatings that meet lobes in another order; a single one where every seat has an element."""
    even, row = even_seats(drive), drive.seats
    if row.elements == row.seats:
        return (Seating(0.0, even),)
    step = 2 * math.pi / row.elements
    period = row.elements // math.gcd(row.elements, row.seats)
    side_by_side = tuple(range(row.elements))
    return (
        *(Seating(k * step, even) for k in range(period)),
        *(Seating(k * step, side_by_side) for k in range(row.elements)),
    )


def shifted(seating: Seating, drive: Drive, count: int) -> tuple[Seating, ...]:
    """The same seats with the first element at `count` equidistant positions about the start, over the distance of the
    elements of a row, or over that of all elements where each seat has one, which then meet the same lobes."""
    span = 2 * math.pi / (drive.elements if drive.seats.elements == drive.seats.seats else drive.seats.elements)
    return tuple(Seating(seating.start + span * (k / count - 0.5), seating.seats) for k in range(count))
