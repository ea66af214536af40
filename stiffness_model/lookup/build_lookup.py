"""Builds the lookup: spline tables over twist and gear clearance, fitted to the solver's results.

The clearance axis is physical: a shift of every drive's gear clearance (m) enters the solver; the curve is not shifted
afterwards. The tables hold the mean, the 10th and the 90th percentile of the torque. The mean is that of all drives the
drawing allows, integrated over elements spread evenly over positions and tolerances; the distance of the percentiles
from it is that of a number of drawn drives. Torque is an odd function of the twist (each percentile mirrors the other),
force and load share are even functions; the tables are symmetrised, which averages out sampling noise.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import build_contacts
from ..contact.usable_elements import usable_elements
from ..drawing.drive import Drive
from ..drawing.sampling import quasi_random_drives, quasi_random_elements
from ..drawing.twist_limits import clearance_deviation, clearance_reach, expect_twists, half_closed_clearance
from ..equilibrium.closed_form import solve, solve_chunks
from ..errors import expect
from ..io.drawing_toml import DriveLike, as_any_drive, drive_to_dict
from ..kinds import AnyDrive, kind_of
from ..montecarlo.population import Population, simulate
from ..montecarlo.twist_torque_curve import BAND
from ..numerics.arrays import Array
from ..numerics.bspline import Axis, evaluate, fit
from ..version import __version__
from .table import QUANTITIES, Lookup, describe

__all__ = [
    "ERROR_BOUND",
    "N_DRIVES",
    "N_QUADRATURE_ELEMENTS",
    "QUANTITIES",
    "Lookup",
    "build_lookup",
    "describe",
    "mean_torque",
]

MeanTorque = Callable[[Any, Array, float], Array]
"""From a drive, twists (n_twist,), rad, and a clearance, m, to the mean torque, (n_twist,) N.m."""
ERROR_BOUND = 1e-4
"""Target error of the mean torque as a share of the full torque; chosen by judgement, far below the scatter of drives.
"""
N_DRIVES = 250
"""Virtual drives for the percentiles, the force and the load share; chosen by judgement."""
N_QUADRATURE_ELEMENTS = 2**13
"""Evenly spread elements for the mean torque; chosen by judgement, tests hold it against drawn drives."""
N_QUADRATURE_DRIVES = 256
"""Evenly spread drives for the mean torque where bearings or housing couple the elements; chosen by judgement."""


def build_lookup(drive: DriveLike, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None) -> Lookup:
    """The lookup of a drive of any kind: mean torque over twist and clearance, and percentiles of `n_drives` drives.

    executor: shares the work; the numbers do not depend on it. Raises `InputError` for a drive without a lookup.
    """
    found = as_any_drive(drive)
    return kind_of(found).call("lookup", found, n_drives, seed, executor)


def build_drawing_lookup(
    drive: Drive, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None
) -> Lookup:
    """`build_lookup` for a rolling element eccentric drive.

    The twist axis reaches to twice the drawing's max_twist, the clearance axis to `clearance_reach`. The grid spacing
    follows the scatter of the contact clearances, over which the contacts set in smoothly; the grid is refined while
    the mean torque misses `ERROR_BOUND`. executor: shares the clearances among workers; the numbers do not depend on
    it. Raises `InputError` for a drawing with inertia switched on, whose forces depend on the crank's speed, which is
    no axis of the tables.
    """
    expect(
        not drive.beyond.has_inertia_forces,
        "inertia 'off', since the crank's speed is no axis of the tables",
        drive.beyond.inertia,
        drive.name,
    )
    per_twist = drive.eccentricity * abs(drive.ratio)
    scatter, half_closed = clearance_deviation(drive), half_closed_clearance(drive)
    clearance_step = float(np.clip(0.85 * scatter, half_closed / 30, half_closed / 12))
    twist_step = float(np.clip(1.05 * scatter / per_twist, drive.max_twist / 60, drive.max_twist / 26))
    refinements = (1.0, 1.5, 2.25)
    for finer in refinements:
        axes = (
            symmetric_axis(2 * drive.max_twist, twist_step / finer),
            symmetric_axis(clearance_reach(drive), clearance_step / finer),
        )
        lookup = fitted_lookup(drive, axes, mean_torque, n_drives, seed, executor)
        if lookup.error["torque_mean"] <= 0.8 * ERROR_BOUND or finer == refinements[-1]:
            return lookup
    raise AssertionError("the last refinement returns")


def fitted_lookup(
    drive: AnyDrive, axes: tuple[Axis, Axis], mean: MeanTorque, n_drives: int, seed: int, executor: Executor | None
) -> Lookup:
    """The lookup of a drive on given axes of twist and clearance, with its interpolation error.

    mean: (drive, twist, clearance) -> mean torque, (n_twist,) N.m, of all drives that the drawing allows.
    """
    work = partial(_tables, drive, mean, n_drives, seed)
    solved = _solve(work, axes[0].nodes, axes[1].nodes, executor)
    tables = np.stack([table for table, _ in solved], -1)
    coefficients = fit(axes[1], fit(axes[0], tables, 1), 2)
    coefficients[:3] = _monotone(coefficients[:3])
    full_torque = float(evaluate(axes, coefficients[0], drive.max_twist, 0.0))
    error = _measured_error(work, axes, coefficients, drive.max_twist, executor)
    return Lookup(axes[0], axes[1], coefficients, full_torque, error, drive_to_dict(drive), n_drives, seed, __version__)


def symmetric_axis(reach: float, step: float) -> Axis:
    """An axis from -reach to reach in an even number of cells no wider than `step`."""
    cells = 2 * int(np.ceil(reach / step))
    return Axis(-reach, 2 * reach / cells, cells)


_Tables = tuple[Array, NDArray[np.bool_]]


def _solve(
    work: Callable[[Array, float], _Tables], twist: Array, clearances: Array, executor: Executor | None
) -> list[_Tables]:
    """`_tables` at every clearance, distributed over the executor's workers."""
    return list((map if executor is None else executor.map)(partial(work, twist), clearances.tolist()))


def _tables(drive: AnyDrive, mean_of: MeanTorque, n_drives: int, seed: int, twist: Array, clearance: float) -> _Tables:
    """The five quantities over a symmetric twist grid at one clearance, (5, n_twist), and where the load share is
    representative, (n_twist,).
    """
    population = simulate(drive, twist, n_drives, seed, clearance=clearance)
    mean = mean_of(drive, twist, clearance)
    low, high = np.percentile(population.torque, BAND, axis=0) - population.torque.mean(axis=0) + mean
    force = population.contact_force.max(axis=2).mean(axis=0)
    share = _extended_load_share(population)
    tables = np.stack(
        [
            (mean - mean[::-1]) / 2,
            (low - high[::-1]) / 2,
            (high - low[::-1]) / 2,
            (force + force[::-1]) / 2,
            (share + share[::-1]) / 2,
        ]
    )
    return tables, population.representative


def mean_torque(drive: Drive, twist: Array, clearance: float = 0.0) -> Array:
    """Mean torque, (n_twist,) N.m, over all drives that the drawing allows, by elements spread evenly over positions
    and tolerances (`sampling.spread`).

    Where a bearing or the housing couples the elements, whole drives are spread instead (`sampling.spread_drives`).
    twist: (n_twist,) rad at the output; clearance: m, added to the gear's clearance.
    """
    twist = expect_twists(drive, twist)
    if drive.beyond.couples_elements:
        drives = quasi_random_drives(drive, N_QUADRATURE_DRIVES)
        contacts = usable_elements(drive, drives, clearance).contacts
        return solve(contacts, twist * drive.ratio).output_torque.sum(axis=1) / N_QUADRATURE_DRIVES
    elements = quasi_random_elements(drive, N_QUADRATURE_ELEMENTS)
    contacts = build_contacts(drive, elements, clearance)
    mean = np.empty(len(twist))
    for part, solution in solve_chunks(contacts, twist * drive.ratio):
        mean[part] = solution.output_torque.mean(axis=1)
    return mean * drive.elements * drive.usable_limit / np.pi


def _extended_load_share(population: Population) -> Array:
    """Mean load share, (n_twist,); where the torque is too low for it, the nearest representative value."""
    known = population.representative
    share = np.where(np.isfinite(population.load_share), np.minimum(population.load_share, 1.0), 1.0).mean(axis=0)
    if not known.any():
        return np.ones_like(share)
    index = np.flatnonzero(known)
    nearest = index[np.abs(index[:, None] - np.arange(len(share))).argmin(axis=0)]
    return share[nearest]


def _monotone(coefficients: Array) -> Array:
    """Coefficients made non-decreasing along the twist, from the middle outwards; the spline is then monotone, too.

    Without this, interpolation undershoots by some 1e-6 of the full torque where contact sets in.
    """
    middle = coefficients.shape[1] // 2
    upper = np.maximum.accumulate(coefficients[:, middle:], axis=1)
    lower = np.minimum.accumulate(coefficients[:, middle::-1], axis=1)[:, ::-1]
    return np.concatenate([lower[:, :-1], upper], axis=1)


def _measured_error(
    work: Callable[[Array, float], _Tables],
    axes: tuple[Axis, Axis],
    coefficients: Array,
    max_twist: float,
    executor: Executor | None,
) -> dict[str, float]:
    """Maximum error of each quantity at the cells' midpoints, relative to its maximum within max_twist."""
    twist, clearance = axes
    middles = twist.nodes[:-1] + twist.step / 2
    worst = np.zeros(len(QUANTITIES))
    around = np.unique(
        np.clip(
            clearance.cells // 2 + np.array([-clearance.cells // 3, -1, 0, 3, clearance.cells // 3]),
            0,
            clearance.cells - 1,
        )
    )
    between = clearance.start + clearance.step * (around + 0.5)
    for c, (solved, representative) in zip(between, _solve(work, middles, between, executor), strict=True):
        difference = np.abs(evaluate(axes, coefficients, middles, c) - solved)
        # Next to the range where the load share is representative, a cell interpolates towards an extended value.
        inner = representative & np.roll(representative, 1) & np.roll(representative, -1)
        difference[4, ~inner] = 0.0
        worst = np.maximum(worst, difference.max(axis=1))
    scale = np.abs(evaluate(axes, coefficients, np.linspace(-1, 1, 41) * max_twist, 0.0)).max(axis=1)
    scale[:3] = scale[0]
    return dict(zip(QUANTITIES, (float(v) for v in worst / scale), strict=True))
