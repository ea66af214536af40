"""The lookup of a cycloidal drive: tables of torque, force and load share over twist and clearance, for models."""

from __future__ import annotations

from concurrent.futures import Executor

from ..drawing.twist_limits import twist_limit
from ..lookup.build_lookup import N_DRIVES, fitted_lookup, symmetric_axis
from ..lookup.table import Lookup
from ..numerics.arrays import Array
from .cycloidal_drive import CycloidalDrive
from .gear_equilibrium import solve_gears
from .part_deviations import spread_deviations

ERROR_BOUND = 1e-3
"""Target error of the tables' mean torque as a share of the full torque; chosen by judgement, far below the scatter of
drives and above that of `N_SPREAD` drives."""
N_SPREAD = 256
"""Drives of the mean torque; chosen by judgement. For the printed gear the mean then is within 1 % of that of 4096."""
TWIST_CELLS, CLEARANCE_CELLS = 40, 8
"""Cells of either half axis of the first tables; chosen by judgement."""
FINER = (1.0, 1.6)
"""Refinements of the axes that are tried; chosen by judgement."""


def cycloidal_lookup(
    drive: CycloidalDrive, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None
) -> Lookup:
    """The lookup of a drawing: mean torque, percentiles, force and load share over twist and profile clearance.

    The twist axis reaches to twice the drawing's max_twist, the clearance axis to half of the clearance that max_twist
    closes. executor: shares the clearances among workers; the numbers do not depend on it.
    """
    reach = min(2 * drive.max_twist, twist_limit(drive))
    widest = 0.5 * drive.eccentricity * drive.lobes * drive.max_twist
    lookup = None
    for finer in FINER:
        axes = (
            symmetric_axis(reach, reach / (TWIST_CELLS * finer)),
            symmetric_axis(widest, widest / (CLEARANCE_CELLS * finer)),
        )
        lookup = fitted_lookup(drive, axes, mean_gear_torque, n_drives, seed, executor)
        if lookup.error["torque_mean"] <= ERROR_BOUND:
            break
    assert lookup is not None
    return lookup


def mean_gear_torque(drive: CycloidalDrive, twist: Array, clearance: float = 0.0) -> Array:
    """Mean torque, (n_twist,) N.m, over the drives that the drawing allows (`part_deviations.spread_deviations`)."""
    return solve_gears(drive, spread_deviations(drive, N_SPREAD), twist, clearance).torque.mean(axis=0)
