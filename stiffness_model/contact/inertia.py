"""Forces of inertia on the elements of a turning drive.

The crank turns at a constant speed, the gear is fixed, the cage turns at theta' = psi'/i (i signed). An element's
place on the profile then moves at beta' = psi' - theta' = psi' (1 - 1/i): 30/29 of the crank's speed where they
reverse, 28/29 where they turn together. On its path r = c(beta) its acceleration is

    radial  c'' beta'^2 - c theta'^2        tangential  2 c' beta' theta'

and the force on it is minus its mass times that. The oscillation on the eccentric, c'' = -e cos(beta), outweighs the
cage's turn by far: at 3000 rpm of drive 1's crank the ball of 11 g feels 0.91 N at beta = 0, 0.06 N of them from the
cage's turn. Against contact forces of 1300 N at full twist that is nothing; it decides where elements with play
rest, and would be a tenth of those forces at 36 000 rpm only. In drive 3, printed, it is 0.6 % of them at a
quarter of full twist and 3000 rpm. Quasi-static: the element's own spin and
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
    """Radial and tangential force of inertia, (n, 2) N, at positions beta (n,) rad and the drawing's crank speed.

    None where its `inertia` is off.

    >>> from stiffness_model import load_drive
    >>> drive = load_drive("drive_1", inertia="on", crank_speed="3000 rpm")
    >>> inertia_force(drive, np.array([0.0]), np.array([7e-3])).round(2)
    array([[ 0.91, -0.  ]])
    """
    crank = drive.beyond.crank_speed
    if not drive.beyond.has_inertia_forces:
        return np.zeros((len(beta), 2))
    cage = crank / drive.ratio
    along = crank - cage
    path, mass = drive.path, element_mass(drive, radius)
    radial = path.radius(beta) * cage**2 - path.second_slope(beta) * along**2
    tangential = -2 * path.slope(beta) * along * cage
    return np.stack([mass * radial, mass * tangential], axis=1)
