"""The gear's true profile as an element meets it: gap, normal and curvature at the nearest point.

The paper takes the indentation at the gear as linear in the element's displacement and the contact's stiffness as
constant (eq. 8). The profile is the equidistant of the elements' path, so that the exact gap is the distance of the
element's centre from that path, less what the radii leave: with f the foot of the perpendicular on the path and n
the normal there,

    indentation = n . (x - f) - (q - r_RE).

Locally that is the paper's plus k t^2/2, with t the displacement along the path and k its curvature (1/3.4 mm at
beta = 0 with 30 lobes). The flank is prolonged beyond the point where the profile cuts itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..elasticity.hertz import point_stiffness
from ..numerics.arrays import Array
from .ball_path import BallPath, profile_curvature


class NearestPoint(NamedTuple):
    """The nearest point of the path: beta there, rad; outward unit normal; normal . foot, m; curvature, 1/m."""

    beta: Array
    normal_r: Array
    normal_t: Array
    offset: Array
    curvature: Array


@dataclass(frozen=True)
class GearProfile:
    """path: of the centres; orientation: +1 or -1 as `Drive.orientation`; compliance: of element and gear, 1/Pa;
    line_stiffness: N/m^(10/9) of rollers, None for balls.
    """

    path: BallPath
    orientation: int
    compliance: float
    line_stiffness: float | None

    def nearest_point(self, beta: Array, x: Array, guess: Array, steps: int = 2) -> NearestPoint:
        """The foot for centres displaced by x, (2, ...) m, from beta; Newton's method from `guess` (beta, rad).

        Two steps from the last displacement's foot are exact to rounding where the displacement has moved little.

        >>> drive = GearProfile(BallPath(48e-3, 0.7e-3, 30), -1, 1e-11, None)
        >>> foot = drive.nearest_point(np.array([0.5]), np.array([[0.0], [0.0]]), np.array([0.5]))
        >>> bool(abs(foot.beta[0] - 0.5) < 1e-12)
        True
        """
        at = guess
        for _ in range(steps):
            foot, out_r, out_t = self._foot(beta, at, x)
            along = -out_r * foot.normal_t + out_t * foot.normal_r
            distance = out_r * foot.normal_r + out_t * foot.normal_t
            at = at + self.orientation * along / (1 + foot.curvature * distance) / self._arc(at)
        return self._foot(beta, at, x)[0]

    def stiffness(self, foot: NearestPoint, element_radius: Array, gear_gap: Array) -> Array:
        """K of the contact there, N/m^p, with the clearance gear_gap = q - r_RE."""
        if self.line_stiffness is not None:
            return np.full(np.shape(foot.beta), self.line_stiffness)
        own = 1 / element_radius
        return point_stiffness(self.compliance, own + profile_curvature(foot.curvature, gear_gap + element_radius), own)

    def _arc(self, beta: Array) -> Array:
        """Length of the path over beta, m/rad."""
        return np.hypot(self.path.radius(beta) / self.path.lobes, self.path.slope(beta))

    def _foot(self, beta: Array, at: Array, x: Array) -> tuple[NearestPoint, Array, Array]:
        """The path at `at` in the frame of an element whose neutral place is beta, and x - foot."""
        path = self.path
        turn = self.orientation * (at - beta) / path.lobes
        cos, sin = np.cos(turn), np.sin(turn)
        n_r, n_t = path.normal(at, self.orientation)
        n_r, n_t = n_r * cos - n_t * sin, n_r * sin + n_t * cos
        radius = path.radius(at)
        foot_r, foot_t = radius * cos - path.radius(beta), radius * sin
        foot = NearestPoint(at, n_r, n_t, n_r * foot_r + n_t * foot_t, path.curvature(at))
        return foot, x[0] - foot_r, x[1] - foot_t
