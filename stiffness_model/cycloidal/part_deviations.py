"""Virtual cycloidal drives: the random deviations of every pin, lobe, hole and roller, in seeded blocks.

As for REE drives, a drive's deviations depend only on the seed and on its own index: neither on the number of drives
nor on the process that computes a block.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..drawing.sampling import BLOCK, blocks, check_seed
from ..drawing.tolerances import SIGMAS_IN_WINDOW
from ..numerics.arrays import Array, ArrayValue, Index
from .cycloidal_drive import CycloidalDrive


@dataclass(frozen=True, eq=False)
class PartDeviations(ArrayValue):
    """Deviations of n drives with N pins, z lobes, M discs and m output rollers, m.

    crank_angle: (n,) rad; stiffness: (n,), factor of all moduli and of the stiffness of all bodies. pin, (n, N):
    radius; pin_position, (n, N, 2): radial and tangential; lobe, (n, M, z): flank along its outer normal; hole,
    (n, M, m), and hole_position, (n, M, m, 2); roller, (n, m), and roller_position, (n, m, 2).
    """

    crank_angle: Array
    stiffness: Array
    pin: Array
    pin_position: Array
    lobe: Array
    hole: Array
    hole_position: Array
    roller: Array
    roller_position: Array

    def __len__(self) -> int:
        return len(self.crank_angle)

    def __getitem__(self, index: Index | slice) -> PartDeviations:
        """The deviations of some of the drives, (k,) indices or a slice."""
        return PartDeviations(*(getattr(self, f.name)[index] for f in fields(self)))

    def at_angles(self, crank_angle: Array) -> PartDeviations:
        """One drive, the first, at each of the crank angles (k,), rad."""
        same = self[np.zeros(len(crank_angle), np.intp)]
        return PartDeviations(crank_angle, *(getattr(same, f.name) for f in fields(self)[1:]))


def joined(parts: list[PartDeviations]) -> PartDeviations:
    """The drives of several parts, one after the other."""
    return PartDeviations(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(PartDeviations)))


def without_deviations(drive: CycloidalDrive, crank_angle: Array) -> PartDeviations:
    """The drive as drawn at crank angles (n,), rad."""
    n, discs, rollers = len(crank_angle), drive.discs, drive.output_rollers
    return PartDeviations(
        crank_angle=np.asarray(crank_angle, float),
        stiffness=np.ones(n),
        pin=np.zeros((n, drive.pins)),
        pin_position=np.zeros((n, drive.pins, 2)),
        lobe=np.zeros((n, discs, drive.lobes)),
        hole=np.zeros((n, discs, rollers)),
        hole_position=np.zeros((n, discs, rollers, 2)),
        roller=np.zeros((n, rollers)),
        roller_position=np.zeros((n, rollers, 2)),
    )


def draw_deviations(drive: CycloidalDrive, block: int, n_drives: int, seed: int) -> PartDeviations:
    """The first `n_drives` virtual drives of one block. Raises `InputError` for a bad seed.

    All deviations are normal. The limits of a diameter, a profile and a coordinate of a position are three standard
    deviations from its mean (section III of Fritsch et al. for diameters; ISO 1101 defines the zones). The crank angle
    is uniform over a turn; the logarithm of the factor of stiffness has the standard deviation `stiffness_scatter`.
    """
    check_seed(seed)
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=(block,))))

    def normal(width: float, *shape: int) -> Array:
        return width / SIGMAS_IN_WINDOW * rng.standard_normal((BLOCK, *shape))

    discs, rollers = drive.discs, drive.output_rollers
    angle, factor = rng.uniform(0.0, 2 * np.pi, BLOCK), np.exp(drive.stiffness_scatter * rng.standard_normal(BLOCK))
    profile = normal(drive.profile_clearance_tolerance, 1, 1)
    holes = normal(drive.hole_clearance_tolerance, 1, 1)
    drawn = PartDeviations(
        crank_angle=angle,
        stiffness=factor,
        # Half of the widths that are diameters: these are deviations of radii.
        pin=normal(drive.pin_tolerance / 2, drive.pins),
        pin_position=normal(drive.pin_position_tolerance, drive.pins, 2),
        lobe=normal(drive.profile_tolerance, discs, drive.lobes) - profile,
        hole=normal(drive.hole_tolerance / 2, discs, rollers) + holes,
        hole_position=normal(drive.hole_position_tolerance, discs, rollers, 2),
        roller=normal(drive.roller_tolerance / 2, rollers),
        roller_position=normal(drive.roller_position_tolerance, rollers, 2),
    )
    return drawn[:n_drives]


def spread_deviations(drive: CycloidalDrive, count: int) -> PartDeviations:
    """`count` virtual drives for means over all that the drawing allows; `count` is best a power of 2.

    Crank angles and factors of stiffness, of which all contacts of a drive depend, are spread evenly by Sobol's
    sequence; the deviations of the many parts, which average out within a drive, are drawn.
    """
    from scipy.special import ndtri
    from scipy.stats import qmc

    drawn = joined([draw_deviations(drive, block, n, 0) for block, n in blocks(count)])
    points = qmc.Sobol(2, scramble=False).random(count) + 0.5 / count
    return replace(
        drawn,
        crank_angle=2 * np.pi * points[:, 0],
        stiffness=np.exp(drive.stiffness_scatter * ndtri(points[:, 1])),
    )
