"""The seats of a row of elements: possible positions, their distance, and the cage's wall that remains between bores.

With cage and gear fixed, an element at the angle t of the cage lies on the path at every crank angle only if i t is a
multiple of 2 pi. A row therefore has |i| seats, 2 pi/|i| apart, of which larger elements occupy every second or fewer.
(The torque is computed with a row's elements spaced evenly, eq. 20 of the paper.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Seats:
    """The elements of one row (eccentric) of a drive on its seats.

    seats: |i|; elements: in this row; centre_distance: radius of the circle of their centres, m; bore_radius: mean, m.
    """

    seats: int
    elements: int
    centre_distance: float
    bore_radius: float

    @property
    def spacing(self) -> int:
        """Number of seats from an element to its nearest neighbour; 0 if there are more elements than seats."""
        return self.seats // self.elements

    @property
    def chord(self) -> float:
        """Least distance between the centres of two elements, m; infinite for a single element."""
        return self._chord(self.spacing) if self.elements > 1 else math.inf

    @property
    def wall(self) -> float:
        """Least width of the cage between two bores, on the circle of the centres, m; negative if they overlap."""
        return self.chord - 2 * self.bore_radius

    @property
    def fits(self) -> bool:
        """Whether no bores overlap."""
        return self.wall > 0

    def max_elements(self, wall: float = 0.0) -> int:
        """Greatest number of elements with at least `wall`, m, between their bores; at least 1.

        >>> Seats(29, 29, 48e-3, 7e-3).max_elements()
        14
        """
        least = 2 * self.bore_radius + wall
        for spacing in range(1, self.seats // 2 + 1):
            if self._chord(spacing) >= least * (1 - 1e-12):
                return self.seats // spacing
        return 1

    def overlap_message(self) -> str:
        """One line that says what does not fit and what would.

        >>> Seats(29, 15, 48e-3, 7e-3).overlap_message()
        '15 elements do not fit on the 29 seats of an eccentric: 10.38 mm apart they leave -3.62 mm of wall between \
bores of 14.00 mm; 14 elements fit, with a wall of 6.64 mm, or 15 with bores below 10.38 mm on this circle'
        """
        best = Seats(self.seats, self.max_elements(), self.centre_distance, self.bore_radius)
        width = f", with a wall of {1e3 * best.wall:.2f} mm" if best.elements > 1 else ""
        chord, wall, bore = (f"{1e3 * size:.2f} mm" for size in (self.chord, self.wall, 2 * self.bore_radius))
        smaller = f", or {self.elements} with bores below {chord} on this circle" if self.spacing else ""
        fit = "element fits" if best.elements == 1 else "elements fit"
        return (
            f"{self.elements} elements do not fit on the {self.seats} seats of an eccentric: {chord} apart they "
            f"leave {wall} of wall between bores of {bore}; {best.elements} {fit}{width}{smaller}"
        )

    def _chord(self, spacing: int) -> float:
        """Distance of two elements that are `spacing` seats apart, m."""
        return 2 * self.centre_distance * math.sin(min(math.pi * spacing / self.seats, math.pi / 2))
