"""Inertia forces on the elements of a rotating drive.

The crank turns at constant speed psi', the gear is fixed, the cage turns at theta' = psi'/i (i signed). An element's
position on the profile then changes at beta' = psi' - theta' = psi' (1 - 1/i): 30/29 of the crank's speed if crank and
cage turn in opposite directions, 28/29 if they turn in the same one. On its path r = c(beta) its acceleration is

    radial  c'' beta'^2 - c theta'^2        tangential  2 c' beta' theta'

and the inertia force is minus its mass times that. The oscillation on the eccentric, c'' = -e cos(beta), outweighs the
cage's rotation by far: at 3000 rpm of drive 1's crank the force on the ball of 11 g is 0.91 N at beta = 0, of which
0.06 N come from the cage's rotation. That is negligible against contact forces of 1300 N at full twist; it decides
where elements with clearance rest, and would reach a tenth of those forces only at 36 000 rpm. In drive 3, printed, it
is 0.6 % of them at a quarter of full twist and 3000 rpm. The model is quasi-static: the element's own spin and
vibrations are left out.
"""

from __future__ import annotations

import math

import numpy as np

from ..drawing.drive import Drive
from ..numerics.arrays import Array


def element_mass(drive: Drive, radius: Array) -> Array:
    """Mass of elements of these radii (m), kg.

    >>> from stiffness_model import load_drive
    >>> f"{1e3 * element_mass(load_drive('drive_1'), np.array(7e-3)):.2f} g"
    '11.22 g'
    """
    volume = 4 / 3 * math.pi * radius**3 if drive.element == "ball" else math.pi * radius**2 * drive.element_length
    return drive.materials["element"].density * volume


def inertia_force(drive: Drive, beta: Array, radius: Array) -> Array:
    """Radial and tangential inertia force, (n, 2) N, at positions beta (n,) rad and the drawing's crank speed.

    Zero if the drawing's `inertia` is off.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1", inertia="on", crank_speed="3000 rpm")
    >>> inertia_force(drive, np.array([0.0]), np.array([7e-3])).round(2)
    array([[ 0.91, -0.  ]])
    """
    crank = drive.beyond.crank_speed
    if not drive.beyond.has_inertia_forces:
        return np.zeros((len(beta), 2))
    cage = crank / drive.ratio
    speed = crank - cage
    path, mass = drive.path, element_mass(drive, radius)
    radial = path.radius(beta) * cage**2 - path.second_slope(beta) * speed**2
    tangential = -2 * path.slope(beta) * speed * cage
    return np.stack([mass * radial, mass * tangential], axis=1)
