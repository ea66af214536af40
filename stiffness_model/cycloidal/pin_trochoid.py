"""Flank geometry of a pin-cycloid pair: the shortened epitrochoid, its equidistant, and the contacts with the pins.

N pins stand on a circle of radius R about the ring's axis O; the disc's centre C orbits about O with the eccentricity
e. In the disc's frame the centres of all pins move on one shortened epitrochoid with z = N - 1 arches,

    q(t) = R exp(i t) - e exp(i N t),   shortening coefficient e N/R < 1,

and the flank is its inner equidistant at the distance of the pin's radius. The disc rolls with its pitch circle,
radius e z, inside the ring's, radius e N. They touch at the instantaneous centre P, at the distance e N from O in the
direction of the eccentricity, through which the normals of all contacts pass. While the crank turns by phi, the disc
turns by -phi/z: with the ring fixed, the ratio from crank to disc is -(N - 1).

The contacts are stated in the eccentric's frame: origin in C, x-axis in the direction of the eccentricity. There they
depend only on the angle alpha of each pin from the eccentricity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..numerics.arrays import Array


class FlankContacts(NamedTuple):
    """Contacts between pins and flank without load and deviations, arrays of one shape.

    centre: the pin's centre from the disc's, m, complex. push: unit vector, complex, along which the pin pushes the
    disc. curvature: of the path of the pin's centre, 1/m, positive where the disc is convex. radial: component of
    `push` along the pin's radius from O, the negative cosine of the pressure angle.
    """

    centre: NDArray[np.complex128]
    push: NDArray[np.complex128]
    curvature: Array
    radial: Array


@dataclass(frozen=True)
class PinTrochoid:
    """The path of the pins' centres in the disc's frame. circle_radius R and eccentricity e in m; pins: N."""

    circle_radius: float
    eccentricity: float
    pins: int

    @property
    def lobes(self) -> int:
        """Arches of the path, and lobes of the disc: N - 1."""
        return self.pins - 1

    @property
    def shortening(self) -> float:
        """The shortening coefficient e N/R; the path has cusps at 1 and loops above.

        >>> round(PinTrochoid(34e-3, 1.5e-3, 14).shortening, 4)
        0.6176
        """
        return self.eccentricity * self.pins / self.circle_radius

    def profile(self, parameter: ArrayLike, pin_radius: float) -> NDArray[np.complex128]:
        """Points of the disc's flank, complex, m, at path parameters t in rad, of any shape; once round for 2 pi.

        pin_radius: distance of the equidistant, m. At t = 0 lies the bottom of a valley:

        >>> valley = PinTrochoid(34e-3, 1.5e-3, 14).profile(0.0, 3.5e-3)
        >>> round(1e3 * float(valley.real), 6)
        29.0
        """
        t = np.asarray(parameter, float)
        tangent = self.circle_radius * np.exp(1j * t) - self.eccentricity * self.pins * np.exp(1j * self.pins * t)
        # The derivative of q is i times this, so that the inner normal is -tangent/|tangent|.
        path = self.circle_radius * np.exp(1j * t) - self.eccentricity * np.exp(1j * self.pins * t)
        return np.asarray(path - pin_radius * tangent / np.abs(tangent), np.complex128)

    def curvature(self, alpha: ArrayLike) -> Array:
        """Curvature of the path, 1/m, at the contact of pins at angles alpha, rad, from the eccentricity."""
        turned = np.exp(-1j * np.asarray(alpha, float))
        r, e, n = self.circle_radius, self.eccentricity, self.pins
        tangent = r - e * n * turned
        return (np.conj(tangent) * (r - e * n**2 * turned)).real / np.abs(tangent) ** 3

    def contacts(self, alpha: ArrayLike) -> FlankContacts:
        """Contacts with pins at angles alpha, rad, from the eccentricity, of any shape.

        >>> one = PinTrochoid(34e-3, 1.5e-3, 14).contacts(1.0)
        >>> instantaneous_centre = 13 * 1.5e-3
        >>> abs(float(((instantaneous_centre - one.centre) / one.push).imag)) < 1e-15
        True
        """
        a = np.asarray(alpha, float)
        direction = np.exp(1j * a)
        towards = self.eccentricity * self.pins - self.circle_radius * direction
        push = towards / np.abs(towards)
        return FlankContacts(
            centre=np.asarray(self.circle_radius * direction - self.eccentricity, np.complex128),
            push=np.asarray(push, np.complex128),
            curvature=self.curvature(a),
            radial=(push * np.conj(direction)).real,
        )

    def least_convex_radius(self) -> float:
        """Least radius of curvature, m, of the path's convex parts; a larger pin would undercut the flank.

        >>> round(1e3 * PinTrochoid(34e-3, 1.5e-3, 14).least_convex_radius(), 3)
        8.623
        """
        highest = float(self.curvature(np.linspace(0.0, 2 * math.pi, 4001)).max())
        return 1 / highest if highest > 0 else math.inf
