"""Twist sweep over many virtual drives: torque, contact forces, load share."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ..contact.element_contacts import CONTACTS
from ..contact.usable_elements import UsableElements, usable_elements
from ..display import dataframe, html_table
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.twist_limits import expect_twists
from ..equilibrium.closed_form import MAX_PAIRS, Equilibrium, Status, solve_chunks
from ..errors import expect, expect_number, warn_not_converged
from ..io.drawing_toml import DriveLike, as_drive
from ..memory import expect_memory
from ..numerics.arrays import Array
from ..units import ARCMIN
from .twist_torque_curve import BAND, TwistTorqueCurve, force_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOW_TORQUE_SHARE = 0.08
"""Share of the greatest torque below which load shares are not representative."""

_COPIES, _PER_PAIR = 1.14, 250.0
"""What is copied of the results where they are read, as a share of them (the greatest array twice: 8 of 7 parts), and
bytes for an element at a twist while it is solved (8 numbers and a status, as much again in scratch and sums)."""


@dataclass(frozen=True)
class Population:
    """Results of `simulate` for n_drives virtual drives at n_twist twists.

    twist: (n_twist,) rad at the output. torque: (n_drives, n_twist) N.m exerted on the output, positive for
    positive twist. crank_torque: (n_drives, n_twist) N.m that holds the crank; torque/(ratio crank_torque) is
    1 for small twists. contact_force: (n_drives, n_twist, 4) N, the greatest at gear, crank, cage t+ and
    cage t-. load_share: (n_drives, n_twist), greatest torque of one element over the drive's torque; not
    representative at low torque, NaN at none. status_counts: elements times twists by `Status` name. capped_count:
    elements whose cage bore conforms more closely than Hertz's theory allows (`hertz.CONFORMITY_LIMIT`).
    interference_count: elements larger than their bores, pressed by both walls. Both counts are out of n_drives times
    the drive's elements.
    """

    drive: Drive
    twist: Array
    seed: int
    torque: Array
    crank_torque: Array
    contact_force: Array
    load_share: Array
    status_counts: Mapping[str, int]
    capped_count: int
    interference_count: int

    @property
    def n_drives(self) -> int:
        """Number of virtual drives."""
        return len(self.torque)

    @property
    def representative(self) -> NDArray[np.bool_]:
        """Twists, (n_twist,), at which the load share means something: at least `LOW_TORQUE_SHARE` of the greatest.

        Below, single drives with hardly any torque rule the mean (section V of the paper excludes it too).
        """
        mean = np.abs(self.torque.mean(axis=0))
        return mean >= LOW_TORQUE_SHARE * mean.max()

    def __repr__(self) -> str:
        return (
            f"Population({self.drive.name!r}, {self.n_drives} drives, {len(self.twist)} twists, seed {self.seed}, "
            f"{float(self.torque.mean(axis=0).max()):.4g} N.m)"
        )

    def _repr_html_(self) -> str:
        rows = {
            "virtual drives": self.n_drives,
            "seed": self.seed,
            "twist [arcmin]": f"{self.twist.min() / ARCMIN:.4g} ... {self.twist.max() / ARCMIN:.4g}",
            "greatest mean torque [N.m]": f"{float(self.torque.mean(axis=0).max()):.4g}",
            "greatest contact force [N]": f"{float(self.contact_force.max()):.4g}",
            **{f"elements at twists, {name}": count for name, count in self.status_counts.items() if count},
        }
        return html_table(self.drive.name, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque, mean and band of the drives, on `ax` or on new axes, which are returned."""
        return self.curve().plot(ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each drive and twist. Raises `InputError` without pandas."""
        n_drives, n_twist = self.torque.shape
        return dataframe(
            {
                "drive": np.repeat(np.arange(n_drives), n_twist),
                "twist [arcmin]": np.tile(self.twist / ARCMIN, n_drives),
                "torque [N.m]": self.torque.ravel(),
                "crank_torque [N.m]": self.crank_torque.ravel(),
                "load_share [1]": self.load_share.ravel(),
                **{force_column(name): self.contact_force[..., k].ravel() for k, name in enumerate(CONTACTS)},
            }
        )

    def curve(self) -> TwistTorqueCurve:
        """Mean, band (10th and 90th percentile) and stiffness over the twist, sorted.

        Raises `InputError` with fewer than two different twists.
        """
        order = np.argsort(self.twist)
        twist, torque = self.twist[order], self.torque[:, order]
        rising = len(twist) >= 2 and bool((np.diff(twist) > 0).all())
        expect(rising, "at least two different twists", self.twist, "twist")
        mean = torque.mean(axis=0)
        p10, p90 = np.percentile(torque, BAND, axis=0)
        share = np.where(self.representative, self.load_share, np.nan).mean(axis=0)[order]
        return TwistTorqueCurve(
            twist=twist,
            torque=mean,
            torque_p10=p10,
            torque_p90=p90,
            stiffness=PchipInterpolator(twist, mean).derivative()(twist),
            contact_force=self.contact_force[:, order].mean(axis=0),
            load_share=share,
            name=self.drive.name,
            notes={"drives": str(self.n_drives), "seed": str(self.seed)},
        )


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

    drive: itself, a preset's name or a drawing's path. twist: 1-D, rad at the output. clearance: m, added to the
    gear's clearance in all drives (positive: play). executor: any concurrent.futures executor to share the blocks of
    drives among; the numbers do not depend on it. Raises `InputError` for twists that are not finite or far beyond the
    drawing's max_twist (`twist_limits`), and for less than one drive. Warns with `NotConvergedWarning` of elements
    without an equilibrium (`status_counts`).

    >>> from stiffness_model import load_drive
    >>> population = simulate(load_drive("drive_1"), [0.0, 0.002], n_drives=50)
    >>> population.torque.shape, population.contact_force.shape
    ((50, 2), (50, 2, 4))
    """
    drive = as_drive(drive)
    angles = expect_twists(drive, twist)
    whole = isinstance(n_drives, (int, np.integer)) and not isinstance(n_drives, bool)
    expect(whole and n_drives >= 1, "at least one drive", n_drives, "n_drives")
    expect_number(clearance, "a finite clearance in m", "clearance")
    sampling.check_seed(seed)
    expect_memory(
        memory_needed(drive, int(n_drives), len(angles)),
        f"{n_drives} virtual drives at {len(angles)} twists",
        "take fewer drives or twists, or allow more memory",
    )
    work = partial(_simulate_block, drive, angles, int(seed), float(clearance))
    tasks = list(sampling.blocks(int(n_drives)))
    shape = (int(n_drives), len(angles))
    torque, crank_torque, share, force = np.empty(shape), np.empty(shape), np.empty(shape), np.empty((*shape, 4))
    counts, capped, tight = np.zeros(len(Status), np.int64), 0, 0
    # Blocks are put in their place as they come: beside the results stands no second copy of them.
    for (block, count), part in zip(tasks, (map if executor is None else executor.map)(work, tasks), strict=True):
        here = slice(block * sampling.BLOCK, block * sampling.BLOCK + count)
        torque[here], crank_torque[here] = part.torque, part.crank_torque
        share[here], force[here] = part.share, part.force
        counts, capped, tight = counts + part.counts, capped + part.capped_count, tight + part.interference_count
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
        interference_count=tight,
    )


def memory_needed(drive: Drive, n_drives: int, n_twist: int) -> float:
    """About how many bytes `simulate` takes, and a curve and pictures of its results after it.

    >>> from stiffness_model import load_drive
    >>> f"{memory_needed(load_drive('drive_1'), 10_000_000, 61) / 1e9:.0f} GB"
    '73 GB'
    """
    results = 8.0 * (3 + len(CONTACTS)) * n_drives * n_twist
    pairs = min(sampling.BLOCK * drive.elements * n_twist, MAX_PAIRS)
    return (1 + _COPIES) * results + _PER_PAIR * pairs


class _Part(NamedTuple):
    """Results of one block of drives."""

    torque: Array
    crank_torque: Array
    force: Array
    share: Array
    counts: NDArray[np.int64]
    capped_count: int
    interference_count: int


def _simulate_block(drive: Drive, twist: Array, seed: int, clearance: float, task: tuple[int, int]) -> _Part:
    block, n_drives = task
    deviations = sampling.draw(drive, block, n_drives, seed)
    elements = usable_elements(drive, deviations, clearance)
    torque, crank_torque = np.zeros((n_drives, len(twist))), np.zeros((n_drives, len(twist)))
    force, best = np.zeros((n_drives, len(twist), 4)), np.zeros((n_drives, len(twist)))
    counts = np.zeros(len(Status), np.int64)
    counts[Status.EXCLUDED] = elements.n_excluded * len(twist)
    for part, result in solve_chunks(elements.contacts, twist * drive.ratio):
        torque[:, part], crank_torque[:, part], best[:, part] = _torques(result, elements)
        for k, values in enumerate((result.gear, result.crank, result.cage_plus, result.cage_minus)):
            force[:, part, k] = elements.reduce_per_drive(np.maximum, values).T
        counts += np.bincount(result.status.ravel(), minlength=len(Status))
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(torque != 0, best / np.abs(torque), np.nan)
    tight = int((deviations.cage < deviations.element).sum())
    return _Part(torque, crank_torque, force, share, counts, int(elements.contacts.capped.sum()), tight)


def _torques(result: Equilibrium, elements: UsableElements) -> tuple[Array, Array, Array]:
    """Sums of output and crank torque, and the greatest contribution in the sum's direction, (n_drives, m) N.m."""
    torque = elements.reduce_per_drive(np.add, result.output_torque).T
    crank_torque = elements.reduce_per_drive(np.add, result.crank_torque).T
    highest = elements.reduce_per_drive(np.maximum, result.output_torque).T
    lowest = elements.reduce_per_drive(np.minimum, result.output_torque).T
    return torque, crank_torque, np.where(torque >= 0, highest, -lowest)
