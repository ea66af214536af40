"""What populations of all kinds of drives have in common: arrays over drives and twists, their table and curve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from ..display import dataframe, html_table
from ..errors import expect
from ..frozen_mapping import FrozenMapping
from ..kinds import AnyDrive
from ..numerics.arrays import Array, ArrayValue
from ..units import ARCMIN
from .twist_torque_curve import BAND, TwistTorqueCurve, force_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOW_TORQUE_SHARE = 0.08
"""Share of the greatest mean torque below which load shares are not representative; chosen by judgement."""


def expect_curve_twists(twist: Array) -> Array:
    """The twists (n,) of a curve, sorted. Raises `InputError` for fewer than two different ones."""
    ordered = np.sort(twist)
    distinct = len(ordered) >= 2 and bool((np.diff(ordered) > 0).all())
    expect(distinct, "at least two different twists", twist, "twist")
    return ordered


def drives_dataframe(twist: Array, columns: Mapping[str, Array]) -> Any:
    """A `pandas.DataFrame` with a row for each drive and twist; columns: (n_drives, n_twist) each, by their headers.

    twist: (n_twist,) rad. Raises `InputError` without pandas.
    """
    n_drives = len(next(iter(columns.values())))
    drives = np.repeat(np.arange(n_drives), len(twist))
    return dataframe(
        {"drive": drives, "twist [arcmin]": np.tile(twist / ARCMIN, n_drives)}
        | {head: values.ravel() for head, values in columns.items()}
    )


@dataclass(frozen=True, eq=False)
class VirtualDrives(ArrayValue):
    """Results for n_drives virtual drives with contacts at n_twist twists.

    twist: (n_twist,) rad at the output. seed: of the tolerances. torque: (n_drives, n_twist) N.m exerted on the output,
    positive for positive twist. crank_torque: (n_drives, n_twist) N.m that holds the crank; torque/(ratio crank_torque)
    is 1 for small twists. contact_force: (n_drives, n_twist, 4) N, the greatest of `contacts`. load_share: (n_drives,
    n_twist), greatest contribution of one element to the drive's torque, relative to it; NaN at zero torque.
    status_counts: states by the name of their status.
    """

    drive: AnyDrive
    twist: Array
    seed: int
    torque: Array
    crank_torque: Array
    contact_force: Array
    load_share: Array
    status_counts: Mapping[str, int]
    contacts: ClassVar[tuple[str, ...]]
    """Last axis of the contact forces."""
    contact_names: ClassVar[tuple[str, ...]]
    """Labels of the contacts in pictures."""
    counted: ClassVar[str]
    """What has a status, in the plural."""

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
            f"{type(self).__name__}({self.drive.name!r}, {self.n_drives} drives, {len(self.twist)} twists, seed "
            f"{self.seed}, {float(self.torque.mean(axis=0).max()):.4g} N.m)"
        )

    def _repr_html_(self) -> str:
        rows = {
            "virtual drives": self.n_drives,
            "seed": self.seed,
            "twist [arcmin]": f"{self.twist.min() / ARCMIN:.4g} ... {self.twist.max() / ARCMIN:.4g}",
            "greatest mean torque [N.m]": f"{float(self.torque.mean(axis=0).max()):.4g}",
            "greatest contact force [N]": f"{float(self.contact_force.max()):.4g}",
            **{f"{self.counted} at twists, {name}": count for name, count in self.status_counts.items() if count},
        }
        return html_table(self.drive.name, rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque, mean and band of the drives, on `ax` or on new axes, which are returned."""
        return self.curve().plot(ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each drive and twist. Raises `InputError` without pandas."""
        columns = {
            "torque [N.m]": self.torque,
            "crank_torque [N.m]": self.crank_torque,
            "load_share [1]": self.load_share,
            **{force_column(name): self.contact_force[..., k] for k, name in enumerate(self.contacts)},
        }
        return drives_dataframe(self.twist, columns)

    def lines(self) -> list[str]:
        """Further results in words, a line each."""
        return []

    def curve(self) -> TwistTorqueCurve:
        """Mean, band (10th and 90th percentile) and stiffness over the sorted twists.

        Raises `InputError` for fewer than two different twists.
        """
        twist, order = expect_curve_twists(self.twist), np.argsort(self.twist)
        torque = self.torque[:, order]
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
            contacts=self.contacts,
        )
