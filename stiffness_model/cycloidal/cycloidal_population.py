"""Many virtual cycloidal drives at the same twists: torque, contact forces, load share, curve."""

from __future__ import annotations

import warnings
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..drawing.sampling import BLOCK, blocks, check_seed
from ..drawing.twist_limits import expect_twists
from ..errors import NotConvergedWarning, expect_integer, expect_number
from ..memory import expect_memory
from ..montecarlo.virtual_drives import VirtualDrives
from ..numerics.arrays import Array
from .cycloidal_drive import CycloidalDrive
from .discs.disc_equilibrium import DiscStatus
from .gear_equilibrium import GearEquilibrium, solve_gears
from .part_deviations import draw_deviations, joined

CYCLOIDAL_CONTACTS = ("ring", "crank", "roller t+", "roller t-")
"""Last axis of the contact forces: ring pins; crank bearings; output rollers that turn the output forwards, and those
that turn it backwards."""
BLOCKS_PER_TASK = 4
"""Blocks of drives that are solved together; chosen by measurement. Results agree with those of single blocks to the
solver's tolerance."""
_BYTES_PER_CONTACT = 400.0
"""Memory per contact and twist of the drives that are solved together: results, pose and scratch."""


@dataclass(frozen=True, eq=False, repr=False)
class CycloidalPopulation(VirtualDrives):
    """Results of `simulate_cycloidal`, as `VirtualDrives` describes them.

    load_share: greatest moment of one pin about its disc's centre relative to the drive's torque. status_counts: pairs
    of drive and twist by `DiscStatus` name.
    """

    drive: CycloidalDrive
    contacts: ClassVar[tuple[str, ...]] = CYCLOIDAL_CONTACTS
    contact_names: ClassVar[tuple[str, ...]] = ("ring", "crank bearing", "rollers forwards", "rollers backwards")
    counted: ClassVar[str] = "drives"

    def lines(self) -> list[str]:
        """Further results in words, a line each."""
        greatest = zip(self.contact_names, self.contact_force.max((0, 1)), strict=True)
        found = [f"{name} {force:.4g} N" for name, force in greatest]
        lines = [f"greatest contact forces: {', '.join(found)}"]
        limit = self.status_counts["limit"]
        if limit:
            lines.append(
                f"{limit} of {self.torque.size} states are beyond the validity of the contact geometry "
                "(a flank's normal turned by more than 27 deg)"
            )
        return lines


def simulate_cycloidal(
    drive: CycloidalDrive,
    twist: ArrayLike,
    n_drives: int = 1000,
    seed: int = 0,
    *,
    clearance: float = 0.0,
    executor: Executor | None = None,
) -> CycloidalPopulation:
    """Torque and forces of `n_drives` virtual drives whose output is locked while the crank turns.

    Each drive has its own deviations and its own crank angle. twist: (n_twist,) rad at the output; clearance: m, added
    to the profile's clearance in all drives. executor: a concurrent.futures executor that computes the blocks of
    drives; the numbers do not depend on it. Raises `InputError` for twists that are not finite or beyond the limits
    (`twist_limits`), and for less than one drive; warns with `NotConvergedWarning` of drives without equilibrium.
    """
    angles = expect_twists(drive, twist)
    count = expect_integer(n_drives, "at least one drive", "n_drives")
    expect_number(clearance, "a finite clearance in m", "clearance")
    check_seed(seed)
    contacts = drive.discs * (drive.pins + drive.output_rollers)
    expect_memory(
        8.0 * (3 + len(CYCLOIDAL_CONTACTS)) * 2 * count * len(angles)
        + _BYTES_PER_CONTACT * contacts * len(angles) * min(count, BLOCK * BLOCKS_PER_TASK),
        f"{count} virtual drives at {len(angles)} twists",
        "take fewer drives or twists, or allow more memory",
    )
    listed = list(blocks(count))
    tasks = [listed[k : k + BLOCKS_PER_TASK] for k in range(0, len(listed), BLOCKS_PER_TASK)]
    work = partial(_simulate_blocks, drive, angles, int(seed), float(clearance))
    parts = list((map if executor is None else executor.map)(work, tasks))
    torque, crank_torque, force, share = (
        np.concatenate(arrays) for arrays in zip(*(part.arrays for part in parts), strict=True)
    )
    counts = sum((part.counts for part in parts), np.zeros(len(DiscStatus), np.int64))
    if counts[DiscStatus.NOT_CONVERGED]:
        warnings.warn(
            f"{drive.name}: {counts[DiscStatus.NOT_CONVERGED]} of {counts.sum()} states (a drive at a twist) found no "
            "equilibrium; their torques are those of the last step; reduce twists, interferences or compliances",
            NotConvergedWarning,
            stacklevel=2,
        )
    return CycloidalPopulation(
        drive=drive,
        twist=angles,
        seed=int(seed),
        torque=torque,
        crank_torque=crank_torque,
        contact_force=force,
        load_share=share,
        status_counts={status.name.lower(): int(counts[status]) for status in DiscStatus},
    )


class _Part(NamedTuple):
    """Torque, crank torque, contact forces and load share of some drives, and the counts of their states."""

    arrays: tuple[Array, Array, Array, Array]
    counts: NDArray[np.int64]


def _simulate_blocks(
    drive: CycloidalDrive, twist: Array, seed: int, clearance: float, task: list[tuple[int, int]]
) -> _Part:
    """The results of some blocks of drives."""
    deviations = joined([draw_deviations(drive, block, n_drives, seed) for block, n_drives in task])
    found = solve_gears(drive, deviations, twist, clearance)
    counts = np.bincount(found.status.ravel(), minlength=len(DiscStatus))
    return _Part((found.torque, found.crank_torque, greatest_forces(found), load_share(found)), counts)


def greatest_forces(found: GearEquilibrium) -> Array:
    """The greatest force, N, of each of `CYCLOIDAL_CONTACTS`, (n, T, 4)."""
    forwards = found.roller_torque > 0
    return np.stack(
        [
            found.pin_force.max((2, 3)),
            found.bearing_force.max(2),
            np.where(forwards, found.roller_force, 0.0).max((2, 3)),
            np.where(forwards, 0.0, found.roller_force).max((2, 3)),
        ],
        -1,
    )


def load_share(found: GearEquilibrium) -> Array:
    """Greatest moment of one pin in the torque's sense relative to the torque, (n, T); NaN where the torque is 0."""
    sense = np.where(found.torque >= 0, 1.0, -1.0)
    greatest = (sense[..., None, None] * found.pin_torque).max((2, 3))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(found.torque != 0, greatest / np.abs(found.torque), np.nan)
