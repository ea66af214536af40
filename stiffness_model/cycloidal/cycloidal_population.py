"""Many virtual cycloidal drives at the same twists: torque, contact forces, load share, curve."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ..display import dataframe, html_table
from ..drawing.sampling import BLOCK, blocks, check_seed
from ..drawing.twist_limits import expect_twists
from ..errors import NotConvergedWarning, expect, expect_integer, expect_number
from ..frozen_mapping import FrozenMapping
from ..memory import expect_memory
from ..montecarlo.population import LOW_TORQUE_SHARE
from ..montecarlo.twist_torque_curve import BAND, TwistTorqueCurve, force_column
from ..numerics.arrays import Array, ArrayValue
from ..units import ARCMIN
from .cycloidal_drive import CycloidalDrive
from .discs.disc_equilibrium import DiscStatus
from .gear_equilibrium import GearEquilibrium, solve_gears
from .part_deviations import draw_deviations, joined

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CYCLOIDAL_CONTACTS = ("ring", "crank", "roller t+", "roller t-")
"""Last axis of the contact forces: ring pins; crank bearings; output rollers that turn the output forwards, and those
that turn it backwards."""
BLOCKS_PER_TASK = 4
"""Blocks of drives that are solved together; chosen by measurement. Results agree with those of single blocks to the
solver's tolerance."""
_BYTES_PER_CONTACT = 400.0
"""Memory per contact and twist of the drives that are solved together: results, pose and scratch."""


@dataclass(frozen=True, eq=False)
class CycloidalPopulation(ArrayValue):
    """Results of `simulate_cycloidal` for n_drives virtual drives at n_twist twists.

    twist: (n_twist,) rad at the output. torque: (n_drives, n_twist) N.m on the output, positive for positive twist.
    crank_torque: (n_drives, n_twist) N.m that holds the crank; torque/(ratio crank_torque) is 1 for small twists.
    contact_force: (n_drives, n_twist, 4) N, the greatest of `CYCLOIDAL_CONTACTS`. load_share: (n_drives, n_twist),
    greatest moment of one pin about its disc's centre relative to the drive's torque; NaN at zero torque.
    status_counts: pairs of drive and twist by `DiscStatus` name.
    """

    drive: CycloidalDrive
    twist: Array
    seed: int
    torque: Array
    crank_torque: Array
    contact_force: Array
    load_share: Array
    status_counts: Mapping[str, int]
    contact_names: ClassVar[tuple[str, ...]] = ("ring", "crank bearing", "rollers forwards", "rollers backwards")
    """Labels of the contacts in pictures."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "status_counts", FrozenMapping(self.status_counts))

    @property
    def n_drives(self) -> int:
        """Number of virtual drives."""
        return len(self.torque)

    @property
    def representative(self) -> NDArray[np.bool_]:
        """Whether the load share is representative at each twist, (n_twist,), by `LOW_TORQUE_SHARE`."""
        mean = np.abs(self.torque.mean(axis=0))
        return mean >= LOW_TORQUE_SHARE * mean.max()

    def __repr__(self) -> str:
        return (
            f"CycloidalPopulation({self.drive.name!r}, {self.n_drives} drives, {len(self.twist)} twists, seed "
            f"{self.seed}, {float(self.torque.mean(axis=0).max()):.4g} N.m)"
        )

    def _repr_html_(self) -> str:
        rows = {
            "virtual drives": self.n_drives,
            "seed": self.seed,
            "twist [arcmin]": f"{self.twist.min() / ARCMIN:.4g} ... {self.twist.max() / ARCMIN:.4g}",
            "greatest mean torque [N.m]": f"{float(self.torque.mean(axis=0).max()):.4g}",
            "greatest contact force [N]": f"{float(self.contact_force.max()):.4g}",
            **{f"drives at twists, {name}": count for name, count in self.status_counts.items() if count},
        }
        return html_table(self.drive.name, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque, mean and band of the drives, on `ax` or on new axes, which are returned."""
        return self.curve().plot(ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each drive and twist. Raises `InputError` without pandas."""
        n_drives, n_twist = self.torque.shape
        forces = {force_column(n): self.contact_force[..., k].ravel() for k, n in enumerate(CYCLOIDAL_CONTACTS)}
        return dataframe(
            {
                "drive": np.repeat(np.arange(n_drives), n_twist),
                "twist [arcmin]": np.tile(self.twist / ARCMIN, n_drives),
                "torque [N.m]": self.torque.ravel(),
                "crank_torque [N.m]": self.crank_torque.ravel(),
                "load_share [1]": self.load_share.ravel(),
                **forces,
            }
        )

    def lines(self) -> list[str]:
        """Further results in words, a line each."""
        found = [f"{CYCLOIDAL_CONTACTS[k]} {force:.4g} N" for k, force in enumerate(self.contact_force.max((0, 1)))]
        lines = [f"greatest contact forces: {', '.join(found)}"]
        limit = self.status_counts["limit"]
        if limit:
            lines.append(
                f"{limit} of {self.torque.size} states are beyond the validity of the contact geometry "
                "(a flank's normal turned by more than 27 deg)"
            )
        return lines

    def curve(self) -> TwistTorqueCurve:
        """Mean, band (10th and 90th percentile) and stiffness over the sorted twists.

        Raises `InputError` for fewer than two different twists.
        """
        order = np.argsort(self.twist)
        twist, torque = self.twist[order], self.torque[:, order]
        distinct = len(twist) >= 2 and bool((np.diff(twist) > 0).all())
        expect(distinct, "at least two different twists", self.twist, "twist")
        mean = torque.mean(axis=0)
        p10, p90 = np.percentile(torque, BAND, axis=0)
        return TwistTorqueCurve(
            twist=twist,
            torque=mean,
            torque_p10=p10,
            torque_p90=p90,
            stiffness=PchipInterpolator(twist, mean).derivative()(twist),
            contact_force=self.contact_force[:, order].mean(axis=0),
            load_share=np.where(self.representative, self.load_share, np.nan).mean(axis=0)[order],
            name=self.drive.name,
            notes={"drives": str(self.n_drives), "seed": str(self.seed)},
            contacts=CYCLOIDAL_CONTACTS,
        )


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
