"""The outlines of one row's parts, true to scale or with small quantities exaggerated.

`exaggeration` multiplies only what is small: deviations of the radii, displacements of the elements under load, and the
eccentric's displacement from its neutral position. At 1 everything is true to scale. In an exaggerated picture an
overlap of a ball with its neighbour is the indentation, and a gap is the backlash.
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
"""Share of the space between crank and gear that the cage leaves free on either side; for the picture only, since a
drawing does not state its rings.
"""
MIN_DIMENSION = 1e-9
"""Smallest dimension of a part, m; the surface roughness is larger."""
POINTS = 97
"""Points on half a lobe; chords are then within 1 um of drive_1's profile."""


@dataclass(frozen=True)
class RowOutlines:
    """Outlines of one row with n elements, m. All polygons are closed without repeating their first point.

    gear: (k, 2), the profile; crank: (k, 2), its raceway; eccentric: (2,), the raceway's centre; centre: (n, 2) and
    radius: (n,), the elements; bars: the cage's polygons between the bores, none where bores overlap; walls:
    (n, 2, 2, 2), the walls t+ and t- of each bore, from the inner to the outer end.
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


def row_outlines(drive: Drive, forces: ElementForces, row: int, exaggeration: float = 1.0) -> RowOutlines:
    """The outlines of row `row` as it stands under `forces`."""
    layout, deviations, f = forces.layout, forces.deviations, exaggeration
    members = slice(row, None, drive.eccentrics)
    bore = layout.bore[row]
    scaled = {
        part: f * (getattr(deviations, part)[0, members] - nominal)
        for part, nominal in (
            ("element", drive.element_radius),
            ("cage", drive.element_radius),
            ("gear", drive.element_radius),
            ("crank", drive.crank_radius),
        )
    }
    outwards, along = unit_vector(bore), unit_vector(bore + np.pi / 2)
    shift = f * forces.displacement[row]
    centre = layout.centre[row] + shift[:, :1] * outwards + shift[:, 1:] * along
    neutral = layout.eccentric[row]
    eccentric = neutral + f * (rotated(neutral, forces.twist * drive.ratio) - neutral)

    # Between two elements the deviations of gear and crank are interpolated linearly.
    around = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    crank = eccentric + unit_vector(around) * (drive.crank_radius + _between(around, bore, scaled["crank"]))[:, None]
    half = drive.element_radius + scaled["cage"]
    inner, outer = cage_radii(drive)
    ends = np.array([inner, outer])
    sides = np.array([1.0, -1.0])
    # A wall is parallel to its bore's axis: at the radius rho its angle from the axis is asin(half/rho).
    walls = (
        np.sqrt(np.maximum(ends**2 - half[:, None] ** 2, 0.0))[:, None, :, None] * outwards[:, None, None]
        + (sides * half[:, None])[..., None, None] * along[:, None, None]
    )
    return RowOutlines(
        _gear(drive.path, drive, layout.gear[row], bore, scaled["gear"]),
        crank,
        eccentric,
        centre,
        drive.element_radius + scaled["element"],
        _bars(bore, half, inner, outer),
        walls,
    )


def max_exaggeration(drive: Drive, forces: ElementForces) -> float:
    """The largest sensible `exaggeration`: the largest of the small quantities then equals an element's radius."""
    deviations = forces.deviations
    eccentric_displacement = drive.eccentricity * abs(forces.twist * drive.ratio)
    small = [
        eccentric_displacement,
        *(
            float(np.abs(values).max())
            for values in (
                deviations.element - drive.element_radius,
                deviations.cage - drive.element_radius,
                deviations.gear - drive.element_radius,
                deviations.crank - drive.crank_radius,
                forces.displacement,
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


def _gear(path: BallPath, drive: Drive, turn: float, bore: Array, deviation: Array) -> Array:
    limit = drive.usable_limit
    beta = np.linspace(-limit, limit, 2 * POINTS - 1)[:-1]
    pitch = 2 * np.pi / drive.lobes
    points: list[Array] = []
    for lobe in range(drive.lobes):
        start = turn + lobe * pitch
        offset = drive.element_radius + _between(start + beta / drive.lobes, bore, deviation)
        points.append(rotated(path.point(beta, offset), start))
    return np.concatenate(points)


def _between(angle: Array, bore: Array, values: Array) -> Array:
    """The elements' values interpolated linearly between their bores, at any angle."""
    return np.interp(angle, bore, values, period=2 * np.pi)


def _bars(bore: Array, half: Array, inner: float, outer: float) -> list[Array]:
    """The cage's bars between neighbouring bores of half widths `half`, where there are any."""
    order = np.argsort(bore % (2 * np.pi))
    angles = (bore % (2 * np.pi))[order].tolist()
    halves = half[order].tolist()
    ends = pairwise([*zip(angles, halves, strict=True), (angles[0] + 2 * np.pi, halves[0])])
    bars = [_bar(low, high, inner, outer) for low, high in ends] if inner < outer else []
    return [polygon for polygon in bars if polygon is not None]


def _bar(low: tuple[float, float], high: tuple[float, float], inner: float, outer: float) -> Array | None:
    """The polygon between two bores, each given by an angle and a half width; None if they overlap at every radius."""

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
