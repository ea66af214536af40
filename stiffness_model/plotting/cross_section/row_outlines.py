"""The outlines of one row's parts, true to scale or with everything small made larger.

`exaggeration` multiplies what is small, and only that: deviations of the radii, displacements of the elements under
load, and the eccentric's way from its neutral position. At 1 all is true to scale. Where a ball then overlaps a
neighbour, the overlap is the indentation; where it does not, it is the play.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...display import one_line
from ...drawing.drive import Drive
from ...geometry.ball_path import BallPath
from ...numerics.arrays import Array
from ...numerics.roots import bracketed_root
from .element_forces import ElementForces
from .layout import unit_vector
from .outline import rotated

CAGE_CLEARANCE = 0.1
"""Of the room between crank and gear, left free by the cage on either side. A drawing says nothing of its rings."""
MIN_DIMENSION = 1e-9
"""m: less is no dimension of a part, for its surface is rougher."""
POINTS = 97
"""On the half of a lobe in a picture: chords within 1 um of drive_1's profile."""


@dataclass(frozen=True)
class RowOutlines:
    """Outlines of one row with n elements, m. All polygons are closed without repeating their first point.

    gear: (k, 2), the profile; crank: (k, 2), its raceway; eccentric: (2,), the raceway's centre; centre: (n, 2) and
    radius: (n,), the elements; bars: the cage's polygons between the bores, none where bores overlap; walls:
    (n, 2, 2, 2), for each bore its walls t+ and t-, each from its inner to its outer end.
    """

    gear: Array
    crank: Array
    eccentric: Array
    centre: Array
    radius: Array
    bars: list[Array]
    walls: Array

    def __repr__(self) -> str:
        return one_line(self)


def row_outlines(drive: Drive, loads: ElementForces, row: int, exaggeration: float = 1.0) -> RowOutlines:
    """The outlines of row `row` as it stands under `loads`."""
    layout, deviations, f = loads.layout, loads.deviations, exaggeration
    members = slice(row, None, drive.eccentrics)
    bore = layout.bore[row]
    grown = {
        part: f * (getattr(deviations, part)[0, members] - nominal)
        for part, nominal in (
            ("element", drive.element_radius),
            ("cage", drive.element_radius),
            ("gear", drive.element_radius),
            ("crank", drive.crank_radius),
        )
    }
    outwards, along = unit_vector(bore), unit_vector(bore + np.pi / 2)
    shift = f * loads.displacement[row]
    centre = layout.centre[row] + shift[:, :1] * outwards + shift[:, 1:] * along
    neutral = layout.eccentric[row]
    eccentric = neutral + f * (rotated(neutral, loads.twist * drive.ratio) - neutral)

    # Between two elements nothing is known of gear and crank: their deviations go on linearly.
    around = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    crank = eccentric + unit_vector(around) * (drive.crank_radius + _between(around, bore, grown["crank"]))[:, None]
    half = drive.element_radius + grown["cage"]
    inner, outer = cage_radii(drive)
    ends = np.array([inner, outer])
    sides = np.array([1.0, -1.0])
    # A wall is parallel to its bore's axis: at the distance rho it stands at the angle asin(half/rho) from it.
    walls = (
        np.sqrt(np.maximum(ends**2 - half[:, None] ** 2, 0.0))[:, None, :, None] * outwards[:, None, None]
        + (sides * half[:, None])[..., None, None] * along[:, None, None]
    )
    return RowOutlines(
        _gear(drive.path, drive, layout.gear[row], bore, grown["gear"]),
        crank,
        eccentric,
        centre,
        drive.element_radius + grown["element"],
        _bars(bore, half, inner, outer),
        walls,
    )


def max_exaggeration(drive: Drive, loads: ElementForces) -> float:
    """The greatest `exaggeration` that leaves a picture: drawn so, what is small is as large as an element's radius."""
    deviations = loads.deviations
    way = drive.eccentricity * abs(loads.twist * drive.ratio)
    small = [
        way,
        *(
            float(np.abs(values).max())
            for values in (
                deviations.element - drive.element_radius,
                deviations.cage - drive.element_radius,
                deviations.gear - drive.element_radius,
                deviations.crank - drive.crank_radius,
                loads.displacement,
            )
        ),
    ]
    return drive.element_radius / max(*small, MIN_DIMENSION)


def cage_radii(drive: Drive) -> tuple[float, float]:
    """Inner and outer radius, m, of a cage between crank and gear with `CAGE_CLEARANCE` on either side."""
    path, q = drive.path, drive.element_radius
    limit = drive.usable_limit
    low = drive.crank_radius + drive.eccentricity
    high = float(np.hypot(*path.point(np.linspace(0, limit, 721), q).T).min())
    return low + CAGE_CLEARANCE * (high - low), high - CAGE_CLEARANCE * (high - low)


def _gear(path: BallPath, drive: Drive, turn: float, bore: Array, grown: Array) -> Array:
    limit = drive.usable_limit
    beta = np.linspace(-limit, limit, 2 * POINTS - 1)[:-1]
    pitch = 2 * np.pi / drive.lobes
    points: list[Array] = []
    for lobe in range(drive.lobes):
        start = turn + lobe * pitch
        offset = drive.element_radius + _between(start + beta / drive.lobes, bore, grown)
        points.append(rotated(path.point(beta, offset), start))
    return np.concatenate(points)


def _between(angle: Array, bore: Array, values: Array) -> Array:
    """The elements' values at any angle, linear between their bores."""
    return np.interp(angle, bore, values, period=2 * np.pi)


def _bars(bore: Array, half: Array, inner: float, outer: float) -> list[Array]:
    """The cage between neighbouring bores of half widths `half`, as far as there is any."""
    order = np.argsort(bore % (2 * np.pi))
    angles = (bore % (2 * np.pi))[order].tolist()
    halves = half[order].tolist()
    ends = pairwise([*zip(angles, halves, strict=True), (angles[0] + 2 * np.pi, halves[0])])
    bars = [_bar(low, high, inner, outer) for low, high in ends] if inner < outer else []
    return [polygon for polygon in bars if polygon is not None]


def _bar(low: tuple[float, float], high: tuple[float, float], inner: float, outer: float) -> Array | None:
    """The polygon between two bores, each an angle and a half width; None where they overlap at every radius."""

    def start(rho: float) -> float:
        return low[0] + math.asin(min(low[1] / rho, 1.0))

    def width(rho: float) -> float:
        return high[0] - math.asin(min(high[1] / rho, 1.0)) - start(rho)

    if width(outer) <= 0:
        return None
    first = inner if width(inner) > 0 else bracketed_root(width, inner, outer)
    across = np.linspace(0, 1, 25)
    return np.concatenate(
        [
            first * unit_vector(start(first) + width(first) * across),
            outer * unit_vector(start(outer) + width(outer) * across[::-1]),
        ]
    )
