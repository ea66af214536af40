"""Many virtual drives at the same twists: torque, contact forces, load share."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ..contact.element_contacts import CONTACTS
from ..display import dataframe, html_table
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.twist_limits import expect_twists
from ..equilibrium.closed_form import MAX_PAIRS, Status
from ..errors import expect, expect_integer, expect_number, warn_not_converged
from ..frozen_mapping import FrozenMapping
from ..io.drawing_toml import DriveLike, as_any_drive
from ..kinds import kind_of
from ..memory import expect_memory
from ..numerics.arrays import Array, ArrayValue
from ..units import ARCMIN
from .drive_blocks import simulate_block
from .twist_torque_curve import BAND, TwistTorqueCurve, force_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOW_TORQUE_SHARE = 0.08
"""Share of the greatest mean torque below which load shares are not representative; chosen by judgement."""

_COPIED_SHARE = 1.14
"""Memory of copies made when results are read, relative to the results: twice the largest array, 8 of 7 parts."""
_BYTES_PER_PAIR = 250.0
"""Memory per element and twist while it is solved: 8 numbers and a status, and as much again in scratch and sums."""


@dataclass(frozen=True, eq=False)
class Population(ArrayValue):
    """Results of `simulate` for n_drives virtual drives at n_twist twists.

    drive, seed: as given to `simulate`. twist: (n_twist,) rad at the output. torque: (n_drives, n_twist) N.m exerted on
    the output, positive for positive twist. crank_torque: (n_drives, n_twist) N.m that holds the crank; torque/(ratio
    crank_torque) is 1 for small twists. contact_force: (n_drives, n_twist, 4) N, the greatest at gear, crank, cage t+
    and cage t-. load_share: (n_drives, n_twist), greatest torque of one element relative to the drive's torque; NaN at
    zero torque. status_counts: pairs of element and twist by `Status` name. Out of n_drives times the drive's elements,
    capped_count: elements whose bore conforms more closely than Hertz's theory allows (`hertz.CONFORMITY_LIMIT`);
    interference_count: elements larger than their bores, pressed by both walls.
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
    contact_names: ClassVar[tuple[str, ...]] = ("gear", "crank", "cage, loaded wall", "cage, other wall")
    """Labels of the contacts in pictures."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "status_counts", FrozenMapping(self.status_counts))

    @property
    def n_drives(self) -> int:
        """Number of virtual drives."""
        return len(self.torque)

    @property
    def representative(self) -> NDArray[np.bool_]:
        """Whether the load share is representative at each twist, (n_twist,), by `LOW_TORQUE_SHARE`.

        At lower torque a few drives that carry hardly any dominate the mean (section V of the paper excludes it too).
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

    def lines(self) -> list[str]:
        """Further results in words; none, because the command rates the loads (`reefmu curve`)."""
        return []

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
