"""Closed outlines of the gear's profile and of the ball path, as polygons with a stated chord error.

The profile is the envelope of circles of radius q whose centres run along the path. Where this equidistant intersects
itself between two lobes (`geometry.usable_limit`), its loop beyond the intersection is machined away: the outline ends
there in a sharp crest and continues with the next lobe.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...display import one_line
from ...drawing.drive import Drive
from ...errors import expect_number
from ...geometry.ball_path import BallPath, usable_limit
from ...numerics.arrays import Array

CHORD_ERROR = 1e-7
"""Default of the greatest distance between curve and polygon, m; far below any tolerance of a profile."""


@dataclass(frozen=True)
class Outline:
    """A closed polygon, counter-clockwise, whose last point connects to the first.

    points: (n, 2) m, all on the curve. error: greatest distance between curve and polygon, m, as measured. limit:
    |beta|, rad, at which a lobe ends; pi if nothing is cut away, otherwise the lobes meet in a crest.
    """

    points: Array
    error: float
    limit: float

    def __repr__(self) -> str:
        return one_line(self)


def gear_outline(drive: Drive, chord_error: float = CHORD_ERROR) -> Outline:
    """The gear's profile in the middle of its tolerance zone, with the first lobe's middle on the x axis.

    chord_error: m. Raises `InputError` for a chord error that is not positive.

    >>> from stiffness_model import load_drive
    >>> outline = gear_outline(load_drive("drive_1"))
    >>> outline.points.shape[0] % 30, outline.error <= CHORD_ERROR
    (0, True)
    """
    return equidistant(drive.path, gear_offset(drive), chord_error)


def gear_offset(drive: Drive) -> float:
    """Distance q, m, of the profile from the path, in the middle of the gear's tolerance zone."""
    return drive.element_radius + drive.tolerances["gear"].offset


def equidistant(path: BallPath, offset: float, chord_error: float = CHORD_ERROR) -> Outline:
    """The outline `offset` m outside the path (0: the path itself), trimmed where it intersects itself.

    There are no other intersections: the polar angle increases along the whole lobe up to the intersection at the end
    of the lobe's sector, since the offset turns against the path's inclination and only the part beyond the
    intersection turns back. Hence no flank is undercut. Tests check this over eccentricities, lobes and offsets.
    """
    expect_number(chord_error, "a chord error in m, above 1e-12", "chord_error", low=1e-12)
    limit = usable_limit(path, offset) if offset else math.pi
    beta = np.linspace(-limit, limit, 4001)
    nodes = _nodes(path, offset, beta, chord_error)
    # The last node, a crest or the joint at beta = pi, is the next lobe's first point.
    lobe, pitch = path.point(nodes[:-1], offset), 2 * math.pi / path.lobes
    points = np.concatenate([rotated(lobe, k * pitch) for k in range(path.lobes)])
    return Outline(points, _sag(path, offset, nodes), limit)


def rotated(points: Array, angle: float) -> Array:
    """Points (..., 2) rotated counter-clockwise by `angle` rad about the axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def _nodes(path: BallPath, offset: float, beta: Array, chord_error: float) -> Array:
    """Positions whose chords have about equal distances from the curve, at most `chord_error`."""
    # Sagitta of a chord over d(beta): |k| v^2 d(beta)^2/8 for the curvature k and the speed v along the curve.
    k, speed = path.curvature(beta), np.hypot(path.slope(beta), path.radius(beta) / path.lobes)
    root = np.sqrt(np.abs(k * (1 + k * offset)) * speed**2 / 8)
    # At an inflection the estimate is 0, although the curve between two nodes is not straight.
    root = np.maximum(root, 0.2 * root.max())
    length = np.concatenate([[0.0], np.cumsum((root[1:] + root[:-1]) / 2 * np.diff(beta))])
    intervals = max(8, math.ceil(length[-1] / math.sqrt(chord_error)))
    while True:
        nodes = np.interp(np.linspace(0.0, length[-1], intervals + 1), length, beta)
        # Symmetric nodes make the flanks mirror images.
        nodes = (nodes - nodes[::-1]) / 2
        if _sag(path, offset, nodes) <= chord_error:
            return nodes
        intervals = math.ceil(1.1 * intervals)


def _sag(path: BallPath, offset: float, nodes: Array) -> float:
    """Greatest distance, m, of the curve from the chords between its points at `nodes`."""
    ends = path.point(nodes, offset)
    chord = np.diff(ends, axis=0)
    chord /= np.hypot(*chord.T)[:, None]
    parts = np.linspace(0, 1, 9)[1:-1]
    between = path.point(nodes[:-1, None] + np.diff(nodes)[:, None] * parts, offset) - ends[:-1, None]
    return float(np.abs(between[..., 0] * chord[:, None, 1] - between[..., 1] * chord[:, None, 0]).max())
