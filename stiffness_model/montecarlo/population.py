"""Many virtual drives at the same twists: torque, contact forces, load share."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..contact.element_contacts import CONTACTS
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.twist_limits import expect_twists
from ..equilibrium.closed_form import MAX_PAIRS, Status
from ..errors import expect_integer, expect_number, warn_not_converged
from ..io.drawing_toml import DriveLike, as_any_drive
from ..kinds import kind_of
from ..memory import expect_memory
from .drive_blocks import simulate_block
from .virtual_drives import VirtualDrives

_COPIED_SHARE = 1.14
"""Memory of copies made when results are read, relative to the results: twice the largest array, 8 of 7 parts."""
_BYTES_PER_PAIR = 250.0
"""Memory per element and twist while it is solved: 8 numbers and a status, and as much again in scratch and sums."""


@dataclass(frozen=True, eq=False, repr=False)
class Population(VirtualDrives):
    """Results of `simulate` for rolling element eccentric drives, as `VirtualDrives` describes them.

    contact_force: the greatest at gear, crank, cage t+ and cage t-. load_share: greatest torque of one element relative
    to the drive's. status_counts: pairs of element and twist by `Status` name. Out of n_drives times the drive's
    elements, capped_count: elements whose bore conforms more closely than Hertz's theory allows
    (`hertz.CONFORMITY_LIMIT`); interference_count: elements larger than their bores, pressed by both walls.
    """

    drive: Drive
    capped_count: int
    interference_count: int
    contacts: ClassVar[tuple[str, ...]] = CONTACTS
    contact_names: ClassVar[tuple[str, ...]] = ("gear", "crank", "loaded cage wall", "other cage wall")
    counted: ClassVar[str] = "elements"


def simulate(
    drive: DriveLike,
    twist: ArrayLike,
    n_drives: int = 1000,
    seed: int = 0,
    *,
    clearance: float = 0.0,
    executor: Executor | None = None,
) -> Population:
    """Torque and forces of `n_drives` virtual drives with cage and gear fixed and the crank twisted.

    drive: a drive of any kind, its name or a drawing's path; the population of another kind than rolling element
    eccentric has the results of that kind (`stiffness_model.kinds`). twist: (n_twist,) rad at the output. seed: of the
    tolerances; the same seed gives the same drives. clearance: m, added to the gear's clearance in all drives
    (positive: backlash). executor: a concurrent.futures executor that computes the blocks of drives; the numbers do not
    depend on it. Raises `InputError` for twists that are not finite or far beyond the drawing's max_twist
    (`twist_limits`), and for less than one drive. Warns with `NotConvergedWarning` of elements without an equilibrium
    (`status_counts`).

    >>> from stiffness_model import load_drive
    >>> population = simulate(load_drive("drive_1"), [0.0, 0.002], n_drives=50)
    >>> population.torque.shape, population.contact_force.shape
    ((50, 2), (50, 2, 4))
    """
    found = as_any_drive(drive)
    return kind_of(found).call("simulate", found, twist, n_drives, seed, clearance=clearance, executor=executor)


def simulate_drawing(
    drive: Drive,
    twist: ArrayLike,
    n_drives: int = 1000,
    seed: int = 0,
    *,
    clearance: float = 0.0,
    executor: Executor | None = None,
) -> Population:
    """`simulate` for a rolling element eccentric drive."""
    angles = expect_twists(drive, twist)
    expect_integer(n_drives, "at least one drive", "n_drives")
    expect_number(clearance, "a finite clearance in m", "clearance")
    sampling.check_seed(seed)
    expect_memory(
        memory_needed(drive, int(n_drives), len(angles)),
        f"{n_drives} virtual drives at {len(angles)} twists",
        "take fewer drives or twists, or allow more memory",
    )
    work = partial(simulate_block, drive, angles, int(seed), float(clearance))
    tasks = list(sampling.blocks(int(n_drives)))
    shape = (int(n_drives), len(angles))
    torque, crank_torque, share, force = np.empty(shape), np.empty(shape), np.empty(shape), np.empty((*shape, 4))
    counts, capped, interfering = np.zeros(len(Status), np.int64), 0, 0
    # Every block is copied into the results as it arrives, so that no second copy of all blocks exists.
    for (block, count), part in zip(tasks, (map if executor is None else executor.map)(work, tasks), strict=True):
        here = slice(block * sampling.BLOCK, block * sampling.BLOCK + count)
        torque[here], crank_torque[here] = part.torque, part.crank_torque
        share[here], force[here] = part.share, part.force
        counts = counts + part.counts
        capped, interfering = capped + part.capped_count, interfering + part.interference_count
    warn_not_converged(int(counts[Status.NOT_CONVERGED]), int(counts.sum()), drive.name)
    return Population(
        drive=drive,
        twist=angles,
        seed=int(seed),
        torque=torque,
        crank_torque=crank_torque,
        contact_force=force,
        load_share=share,
        status_counts={s.name.lower(): int(counts[s]) for s in Status},
        capped_count=capped,
        interference_count=interfering,
    )


def memory_needed(drive: Drive, n_drives: int, n_twist: int) -> float:
    """Estimated memory, bytes, of `simulate`, a curve and figures of its results.

    >>> from stiffness_model import load_drive
    >>> f"{memory_needed(load_drive('drive_1'), 10_000_000, 61) / 1e9:.0f} GB"
    '73 GB'
    """
    results = 8.0 * (3 + len(CONTACTS)) * n_drives * n_twist
    pairs = min(sampling.BLOCK * drive.elements * n_twist, MAX_PAIRS)
    return (1 + _COPIED_SHARE) * results + _BYTES_PER_PAIR * pairs
