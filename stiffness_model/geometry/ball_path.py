"""Geometry of the ball path and of the gear profile, its equidistant.

The angle beta is a position on one period of the profile; for an element it is the crank angle minus the element's
own angle. In drives whose crank and cage turn in the same direction (lobes = |i| - 1) elements meet the profile at
beta, in reversing ones (lobes = |i| + 1) at -beta, on the mirrored flank; `orientation` is +1 or -1 respectively.

All functions take beta in rad, scalar or array, and lengths in m, and broadcast.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..numerics.arrays import Array
from ..numerics.roots import bracketed_root


@dataclass(frozen=True)
class BallPath:
    """The path of the elements' centres in the gear.

    centre_distance: a + b, crank radius plus element radius, m; eccentricity: e, m; lobes: z, an integer.
    """

    centre_distance: float
    eccentricity: float
    lobes: int

    def radius(self, beta: ArrayLike) -> Array:
        """Distance c(beta) from the drive's axis to the element's centre, m (ref. [5] of the paper).

        >>> f"{BallPath(48e-3, 0.7e-3, 30).radius(0.0):.4f}"
        '0.0487'
        """
        b = np.asarray(beta, float)
        return self._root(b) + self.eccentricity * np.cos(b)

    def slope(self, beta: ArrayLike) -> Array:
        """c'(beta), m/rad; equal to -n_t of eq. 6."""
        b = np.asarray(beta, float)
        e = self.eccentricity
        return -e * np.sin(b) * (1 + e * np.cos(b) / self._root(b))

    def second_slope(self, beta: ArrayLike) -> Array:
        """c''(beta), m/rad^2."""
        b = np.asarray(beta, float)
        e, root = self.eccentricity, self._root(b)
        bend = -(e**2) * np.cos(2 * b) / root - (e**2 * np.sin(b) * np.cos(b)) ** 2 / root**3
        return bend - e * np.cos(b)

    def normal(self, beta: ArrayLike, orientation: int = 1) -> tuple[Array, Array]:
        """Outward unit normal (n_r, n_t) at beta (eqs 5-7 with the opposite sign, which points inwards there).

        With orientation -1, the mirrored flank of a reversing drive, n_t changes its sign.
        """
        return self.radius_and_normal(beta, orientation)[1:]

    def radius_and_normal(self, beta: ArrayLike, orientation: int = 1) -> tuple[Array, Array, Array]:
        """`radius` and the two parts of `normal`, for a third of the time of the two."""
        b = np.asarray(beta, float)
        e_cos, e_sin = self.eccentricity * np.cos(b), self.eccentricity * np.sin(b)
        root = np.sqrt(self.centre_distance**2 - e_sin * e_sin)
        radius = root + e_cos
        n_r, n_t = radius / self.lobes, orientation * e_sin * (1 + e_cos / root)
        length = np.sqrt(n_r * n_r + n_t * n_t)
        return radius, n_r / length, n_t / length

    def curvature(self, beta: ArrayLike) -> Array:
        """Signed curvature det(c', c'')/|c'|^3 of the path (eqs 24, 25), 1/m; positive where the centre of curvature
        lies on the side of the axis.

        >>> [f"{1e3 / BallPath(48e-3, 0.7e-3, 28).curvature(b):.3f}" for b in (0, math.pi)]
        ['3.917', '-4.534']
        """
        z = self.lobes
        r, dr, ddr = self.radius(beta), z * self.slope(beta), z**2 * self.second_slope(beta)
        return (r**2 + 2 * dr**2 - r * ddr) / (r**2 + dr**2) ** 1.5

    def pressure_angle(self, beta: ArrayLike) -> Array:
        """Angle between the gear's normal and the radius, rad, >= 0.

        >>> drive_1 = BallPath(48e-3, 0.7e-3, 30)
        >>> f"{math.degrees(drive_1.pressure_angle(np.linspace(0, math.pi, 10001)).max()):.1f}"
        '23.6'
        """
        n_r, n_t = self.normal(beta)
        return np.arctan2(np.abs(n_t), n_r)

    def point(self, beta: ArrayLike, offset: ArrayLike = 0.0) -> Array:
        """Cartesian point of the equidistant `offset` m outside the path, shape (..., 2), m (eq. 24)."""
        angle = np.asarray(beta, float) / self.lobes
        n_r, n_t = self.normal(beta)
        q = np.asarray(offset, float)
        radial, tangential = self.radius(beta) + q * n_r, q * n_t
        cos, sin = np.cos(angle), np.sin(angle)
        return np.stack([radial * cos - tangential * sin, radial * sin + tangential * cos], axis=-1)

    def _root(self, beta: Array) -> Array:
        return np.sqrt(self.centre_distance**2 - (self.eccentricity * np.sin(beta)) ** 2)


def profile_curvature(path_curvature: ArrayLike, offset: ArrayLike) -> Array:
    """Curvature of the gear surface as a contact partner, 1/m: 1/r_Gear of eq. 25, negative where concave.

    In terms of curvatures the path's inflection point (infinite radius) needs no special case.
    """
    k = np.asarray(path_curvature, float)
    return -k / (1 + k * np.asarray(offset, float))


def usable_limit(path: BallPath, offset: float) -> float:
    """Greatest |beta|, rad, of the part of the profile that exists; pi if the profile does not intersect itself.

    The equidistant of a strongly curved path intersects itself on the symmetry line between two lobes,
    beta = pi. The part beyond the intersection is cut away, and elements there carry nothing.

    >>> [f"{math.degrees(usable_limit(BallPath(48e-3, 0.7e-3, z), 7e-3)):.3f}" for z in (28, 30)]
    ['103.888', '91.426']
    """
    symmetry = math.pi / path.lobes

    def angle_past_symmetry(beta: ArrayLike) -> Array:
        n_r, n_t = path.normal(beta)
        return np.asarray(beta) / path.lobes + np.arctan2(offset * n_t, path.radius(beta) + offset * n_r) - symmetry

    grid = np.linspace(0.0, math.pi, 2001)[:-1]
    crossed = np.flatnonzero(angle_past_symmetry(grid) > 0)
    if crossed.size == 0:
        return math.pi
    first = crossed[0]
    if first == 0:
        return 0.0
    return bracketed_root(lambda b: float(angle_past_symmetry(b)), float(grid[first - 1]), float(grid[first]))


def curvature_limit(path: BallPath, offset: float) -> float:
    """|beta| at which undercut by curvature alone starts, rad (1 + k q = 0); pi if there is none.

    This is not the limit of the usable profile: `usable_limit` is lower, and excluding elements by curvature alone
    overestimates the stiffness by a third and more.

    >>> [f"{math.degrees(curvature_limit(BallPath(48e-3, 0.7e-3, z), 7e-3)):.1f}" for z in (28, 30)]
    ['138.8', '133.0']
    """
    grid = np.linspace(0.0, math.pi, 2001)
    undercut = np.flatnonzero(1 + path.curvature(grid) * offset < 0)
    if undercut.size == 0:
        return math.pi
    first = undercut[0]
    return bracketed_root(lambda b: 1 + float(path.curvature(b)) * offset, float(grid[first - 1]), float(grid[first]))


def wrap(angle: ArrayLike) -> Array:
    """The angle wrapped to (-pi, pi], rad."""
    a = np.asarray(angle, float)
    return math.pi - (math.pi - a) % (2 * math.pi)


def max_elements_on_circle(centre_distance: float, element_radius: float) -> int:
    """Greatest number of elements of `element_radius` m that fit side by side on a circle of `centre_distance` m.

    The chord between neighbours, 2 R sin(pi/n), must be at least 2 r; a single element always fits.

    >>> max_elements_on_circle(48e-3, 7e-3)
    21
    """
    ratio = element_radius / centre_distance
    return 1 if ratio >= 1 else math.floor(math.pi / math.asin(ratio) + 1e-12)
