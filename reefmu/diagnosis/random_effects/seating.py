"""Which seats the elements of a row occupy, and where the first of them may stand.

A row has as many seats as the drive's transmission ratio, and each seat faces a lobe of its own at every turn. Where a
drawing has fewer elements than seats, they are spread as evenly as the seats allow, as in `stiffness_model.rotation`.
Which element comes first no drawing says.
"""

from __future__ import annotations

import math

from stiffness_model.drawing.drive import Drive

GOLDEN = (math.sqrt(5) - 1) / 2
"""Multiples of the golden ratio are spread over a turn as evenly as those of any number (Weyl sequence)."""


def even_seats(drive: Drive) -> tuple[int, ...]:
    """The seats nearest to an even spacing of a row's elements."""
    row = drive.seats
    return tuple(round(k * row.seats / row.elements) for k in range(row.elements))


def spread_starts(drive: Drive, count: int) -> tuple[float, ...]:
    """So many positions of the first element at crank angle 0, rad: evenly spaced over the distance of the elements,
    and each at another element's place on the turn."""
    step = 2 * math.pi / drive.elements
    return tuple(step * (int(drive.elements * (k * GOLDEN % 1.0)) + (k + 0.5) / count) for k in range(count))
