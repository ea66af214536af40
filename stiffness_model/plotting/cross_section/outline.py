"""Closed outlines of the gear's profile and of the ball path, as polygons with a stated chord error.

The profile is the edge of what balls of radius q cut that run along the path. Where the equidistant crosses itself
between two lobes (`geometry.usable_limit`), its loop beyond the crossing lies inside that cut: the outline ends at the
crossing, in a sharp crest, and goes on with the next lobe.
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
"""Greatest distance between curve and polygon, m, unless asked for otherwise."""


@dataclass(frozen=True)
class Outline:
    """A closed polygon, counter-clockwise, whose last point is joined to the first.

    points: (n, 2), m, all on the curve. error: greatest distance between curve and polygon, m, as measured. limit:
    |beta|, rad, at which a lobe ends; pi where nothing is cut away, else the lobes meet in a crest.
    """

    points: Array
    error: float
    limit: float

    def __repr__(self) -> str:
        return one_line(self)


def gear_outline(drive: Drive, chord_error: float = CHORD_ERROR) -> Outline:
    """The gear's profile in the middle of its tolerance field, first lobe's middle on the x axis.

    Raises `InputError` for a chord error that is not positive.

    >>> from stiffness_model import load_drive
    >>> outline = gear_outline(load_drive("drive_1"))
    >>> outline.points.shape[0] % 30, outline.error <= CHORD_ERROR
    (0, True)
    """
    return equidistant(drive.path, gear_offset(drive), chord_error)


def gear_offset(drive: Drive) -> float:
    """Distance q, m, of the profile from the path in the middle of the gear's tolerance field."""
    return drive.element_radius + drive.tolerances["gear"].offset


def equidistant(path: BallPath, offset: float, chord_error: float = CHORD_ERROR) -> Outline:
    """The outline `offset` m outside the path (0: the path itself), trimmed where it crosses itself.

    It does not cross itself elsewhere: its polar angle grows all along a lobe, up to the crossing where the lobe's
    sector ends (the offset leans against the path's own lean, and what turns back lies beyond the crossing). So no
    flank overhangs either. The tests hold that over eccentricities, lobes and offsets of all sizes.
    """
    expect_number(chord_error, "a chord error in m, above 1e-12", "chord_error", low=1e-12)
    limit = usable_limit(path, offset) if offset else math.pi
    beta = np.linspace(-limit, limit, 4001)
    nodes = _nodes(path, offset, beta, chord_error)
    # The crest, or the joint at beta = pi, is the next lobe's first point.
    lobe, pitch = path.point(nodes[:-1], offset), 2 * math.pi / path.lobes
    points = np.concatenate([rotated(lobe, k * pitch) for k in range(path.lobes)])
    return Outline(points, _sag(path, offset, nodes), limit)


def rotated(points: Array, angle: float) -> Array:
    """Points (..., 2) turned counter-clockwise by `angle` rad about the axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def _nodes(path: BallPath, offset: float, beta: Array, chord_error: float) -> Array:
    """Positions whose chords all lie about as far from the curve, and no further than `chord_error`."""
    # A chord over d(beta) lies |k| v^2 d(beta)^2/8 off a curve of curvature k run through with speed v.
    k, speed = path.curvature(beta), np.hypot(path.slope(beta), path.radius(beta) / path.lobes)
    root = np.sqrt(np.abs(k * (1 + k * offset)) * speed**2 / 8)
    # Near an inflection the estimate is 0, the curve between two nodes is not straight.
    root = np.maximum(root, 0.2 * root.max())
    length = np.concatenate([[0.0], np.cumsum((root[1:] + root[:-1]) / 2 * np.diff(beta))])
    intervals = max(8, math.ceil(length[-1] / math.sqrt(chord_error)))
    while True:
        nodes = np.interp(np.linspace(0.0, length[-1], intervals + 1), length, beta)
        # The mirrored flank gets mirrored points.
        nodes = (nodes - nodes[::-1]) / 2
        if _sag(path, offset, nodes) <= chord_error:
            return nodes
        intervals = math.ceil(1.1 * intervals)


def _sag(path: BallPath, offset: float, nodes: Array) -> float:
    """Greatest distance of the curve from the chords between its points at `nodes`, m."""
    ends = path.point(nodes, offset)
    chord = np.diff(ends, axis=0)
    chord /= np.hypot(*chord.T)[:, None]
    parts = np.linspace(0, 1, 9)[1:-1]
    between = path.point(nodes[:-1, None] + np.diff(nodes)[:, None] * parts, offset) - ends[:-1, None]
    return float(np.abs(between[..., 0] * chord[:, None, 1] - between[..., 1] * chord[:, None, 0]).max())
