"""The gear's exact profile: gap, normal and curvature at the point nearest to an element.

The paper assumes an indentation at the gear that is linear in the element's displacement, and a constant stiffness of
the contact (eq. 8). The profile is the equidistant of the elements' path, so that the exact indentation follows from
the distance of the element's centre from that path: with f the foot of the perpendicular on the path and n the normal
there,

    indentation = n . (x - f) - (q - r_RE).

To second order that is the paper's indentation plus k t^2/2, with t the displacement along the path and k its
curvature (1/3.4 mm at beta = 0 with 30 lobes). The flank is extended beyond the point where the profile intersects
itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..elasticity.hertz import point_stiffness
from ..numerics.arrays import Array
from .ball_path import BallPath, profile_curvature


class NearestPoint(NamedTuple):
    """The nearest point of the path. beta: rad; normal_r, normal_t: outward unit normal; offset: normal . foot, m;
    curvature: 1/m.
    """

    beta: Array
    normal_r: Array
    normal_t: Array
    offset: Array
    curvature: Array


@dataclass(frozen=True)
class GearProfile:
    """The gear's profile and the contact with it.

    path: of the elements' centres; orientation: +1 or -1 as `Drive.orientation`; compliance: sum of (1 - nu^2)/E of
    element and gear, 1/Pa; line_stiffness: K of rollers, N/m^(10/9), None for balls.
    """

    path: BallPath
    orientation: int
    compliance: float
    line_stiffness: float | None

    def nearest_point(self, beta: Array, x: Array, guess: Array, steps: int = 2) -> NearestPoint:
        """The point nearest to centres displaced by x, (2, ...) m, from beta; Newton's method from `guess`, rad.

        Two steps from the point of the last displacement are exact to rounding if the displacement has changed little.

        >>> profile = GearProfile(BallPath(48e-3, 0.7e-3, 30), -1, 1e-11, None)
        >>> foot = profile.nearest_point(np.array([0.5]), np.array([[0.0], [0.0]]), np.array([0.5]))
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
        """K of the contact at that point, N/m^p; gear_gap: q - r_RE, m."""
        if self.line_stiffness is not None:
            return np.full(np.shape(foot.beta), self.line_stiffness)
        own = 1 / element_radius
        return point_stiffness(self.compliance, own + profile_curvature(foot.curvature, gear_gap + element_radius), own)

    def _arc(self, beta: Array) -> Array:
        """Derivative of the path's arc length by beta, m/rad."""
        return np.hypot(self.path.radius(beta) / self.path.lobes, self.path.slope(beta))

    def _foot(self, beta: Array, at: Array, x: Array) -> tuple[NearestPoint, Array, Array]:
        """The path's point at `at` in the frame of an element whose neutral position is beta, and x - foot."""
        path = self.path
        angle = self.orientation * (at - beta) / path.lobes
        cos, sin = np.cos(angle), np.sin(angle)
        n_r, n_t = path.normal(at, self.orientation)
        n_r, n_t = n_r * cos - n_t * sin, n_r * sin + n_t * cos
        radius = path.radius(at)
        foot_r, foot_t = radius * cos - path.radius(beta), radius * sin
        foot = NearestPoint(at, n_r, n_t, n_r * foot_r + n_t * foot_t, path.curvature(at))
        return foot, x[0] - foot_r, x[1] - foot_t
