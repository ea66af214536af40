"""Where the elements of an individual stand on the profile while crank and cage turn, and which lobes they face."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..geometry.ball_path import wrap
from ..lookup.element_table import FADE_HALF_WIDTH
from ..numerics.arrays import Array, Index
from .individual_drive import Individual


@dataclass(frozen=True)
class ElementPositions:
    """The elements that may carry load at m output angles, in the order of their positions; arrays (m, width).

    element: index of the element; row, lobe: index of its lobe in `Individual.lobe`; beta: position, rad; weight: 1,
    falling to 0 within `FADE_HALF_WIDTH` on either side of the limit where the profile is cut away, so that the torque
    has a derivative.
    """

    element: Index
    row: Index
    lobe: Index
    beta: Array
    weight: Array


@dataclass(frozen=True)
class Window:
    """The part of the profile on which elements carry load: |beta| up to `limit`, rad, and to `reach` with the fading
    edge; at most `width` elements are there at once.
    """

    limit: float
    reach: float
    width: int

    @staticmethod
    def of_drive(drive: Drive) -> Window:
        """The window of a drawing."""
        limit = drive.usable_limit
        if limit >= math.pi:
            return Window(limit, math.pi, drive.elements)
        reach = min(limit + FADE_HALF_WIDTH, math.pi)
        return Window(limit, reach, _most_elements(reach, drive))

    def widened(self, margin: float, drive: Drive) -> Window:
        """The window with elements that lie up to a margin, rad, beyond its reach."""
        reach = min(self.reach + margin, math.pi)
        return Window(self.limit, reach, _most_elements(reach, drive))

    def weight(self, beta: Array) -> Array:
        """`ElementPositions.weight`."""
        if self.reach >= math.pi:
            return np.ones_like(beta)
        return np.clip((self.limit - np.abs(beta)) / (2 * FADE_HALF_WIDTH) + 0.5, 0.0, 1.0)


def _most_elements(reach: float, drive: Drive) -> int:
    """Greatest number of elements with |beta| up to `reach`, rad."""
    return min(math.floor(reach / math.pi * drive.elements) + 1, drive.elements)


def element_lobe_pairs(drive: Drive) -> tuple[Index, Index]:
    """Row and lobe, (n z,) indices each, of all pairs of an element and a lobe, in the order in which they reach one
    beta.

    Element j + 1 of a row stands one bore further back in the cage and faces the lobe that is i/(elements of a row)
    further back; after one turn of the cage each element faces its next lobe. Where fewer elements than seats are
    drawn, evenly spaced, each has the lobe of the nearest seat.
    """
    rows, per_row = drive.eccentrics, drive.elements_per_row
    place = np.arange(drive.elements * drive.lobes)
    j = place // rows
    lobe = -np.round(j % per_row * drive.ratio / per_row).astype(np.intp) - (j // per_row) * round(drive.ratio)
    return place % rows, lobe % drive.lobes


def low_discrepancy_angles(count: int) -> Array:
    """Output angles, (count,) rad, evenly distributed over a turn by the golden ratio, and therefore incommensurate
    with anything periodic in the turn.
    """
    return 2 * np.pi * (np.arange(count, dtype=float) * 0.6180339887498949 % 1)


def element_positions(individual: Individual, window: Window, output_angle: Array) -> ElementPositions:
    """Positions of the elements at output angles, (m,) rad, within the drawing's window."""
    drive = individual.drive
    step = 2 * np.pi / drive.elements
    # In passings: after a whole number of them every element stands where another one stood.
    passed = (individual.start + (drive.ratio - 1) * output_angle) / step
    first = np.ceil(-window.reach / step - passed)
    place = first[:, None] + np.arange(window.width)
    beta = (passed[:, None] + place) * step
    row, lobe = element_lobe_pairs(drive)
    count = place.astype(np.intp)
    meeting = count % len(row)
    return ElementPositions(count % drive.elements, row[meeting], lobe[meeting], beta, window.weight(beta))


def elements_at(individual: Individual, output_angle: float) -> tuple[Deviations, Array]:
    """All elements of an individual at an output angle, rad, with the lobes they face, and the weight of each
    (`ElementPositions.weight`); arrays (1, n), in the order of the elements.

    >>> from stiffness_model import load_drive
    >>> from stiffness_model.rotation import draw_individual
    >>> one = draw_individual(load_drive("drive_1"), 7)
    >>> at, weight = elements_at(one, 0.0)
    >>> bool(at.beta[0, 0] == one.start), bool((at.element[0] == one.element).all())
    (True, True)
    """
    n = individual.drive.elements
    at = element_positions(individual, Window(math.pi, math.pi, n), np.array([float(output_angle)]))
    order = np.argsort(at.element[0])
    q = individual.lobe[at.row[0], at.lobe[0]][order]
    beta = wrap(at.beta[0, order])
    parts = (values[None] for values in (beta, individual.element, individual.crank, individual.cage, q))
    return Deviations(*parts), Window.of_drive(individual.drive).weight(beta)[None]
