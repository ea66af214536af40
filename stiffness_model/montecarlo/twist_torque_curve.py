"""The twist-over-torque curve: mean and band, stiffness, backlash, lost motion, inverse."""

from __future__ import annotations

import csv
import functools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from ..contact.element_contacts import CONTACTS
from ..display import dataframe, html_table, view
from ..errors import InputError, expect
from ..frozen_mapping import FrozenMapping
from ..io.atomic_files import atomic_file
from ..numerics.arrays import Array, ArrayValue
from ..numerics.roots import bracketed_root
from ..units import ARCMIN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOST_MOTION_SHARE = 0.03
"""Lost motion is the twist between plus and minus this share of the rated torque, as in gear makers' catalogues."""
BACKLASH_SHARE = 1e-3
"""Backlash is the twist across which no more than this share of the rated torque is carried; chosen by judgement."""
BAND = (10.0, 90.0)
"""Percentiles of the drives' torque that bound the band."""


def force_column(contact: str) -> str:
    """Header of the column of one of `CONTACTS`.

    >>> force_column("cage t+")
    'force_cage_tplus [N]'
    """
    return f"force_{contact.replace(' ', '_').replace('+', 'plus').replace('-', 'minus')} [N]"


@dataclass(frozen=True, eq=False)
class TwistTorqueCurve(ArrayValue):
    """Mean torque and its band over the twist at the output.

    twist: (n,) rad, rising; torque, torque_p10, torque_p90, stiffness: (n,) N.m and N.m/rad. contact_force:
    (n, 4) N, mean of the drives' greatest at gear, crank, cage t+ and cage t-; load_share: (n,), NaN where it is not
    representative. name: of the drive; notes: how the curve was computed; contacts: names along the last axis of the
    contact forces. Between the points the mean is interpolated by a monotone cubic (PCHIP), whose slope is the
    stiffness.
    """

    twist: Array
    torque: Array
    torque_p10: Array
    torque_p90: Array
    stiffness: Array
    contact_force: Array
    load_share: Array
    name: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    contacts: tuple[str, ...] = CONTACTS

    def __post_init__(self) -> None:
        object.__setattr__(self, "notes", FrozenMapping(self.notes))

    def torque_at(self, twist: ArrayLike) -> Array:
        """Mean torque, N.m, of the shape of `twist` (any), rad.

        A curve that starts at zero twist is continued as an odd function. Raises `InputError` beyond the curve's range:
        it is not extrapolated.
        """
        t = np.asarray(twist, float)
        if self._one_sided:
            return np.where(t < 0, -1.0, 1.0) * self._evaluate(self._mean, np.abs(t))
        return self._evaluate(self._mean, t)

    def stiffness_at(self, twist: ArrayLike) -> Array:
        """Stiffness, N.m/rad, of the shape of `twist` (any), rad. Raises `InputError` beyond the curve's range."""
        t = np.asarray(twist, float)
        return self._evaluate(self._mean.derivative(), np.abs(t) if self._one_sided else t)

    def twist_at(self, torque: ArrayLike) -> Array:
        """Twist, rad, at which the mean curve carries `torque`, N.m, of the same shape (any).

        The inverse of `torque_at`. Within the backlash, the twist furthest from zero. Raises `InputError` beyond the
        curve's torque.
        """
        values = np.asarray(torque, float)
        sign = np.sign(values) if self._one_sided else np.ones_like(values)
        wanted = sign * values
        low, high = float(self.torque.min()), float(self.torque.max())
        if self._one_sided:
            low = min(low, 0.0)
        outside = (wanted < low) | (wanted > high) | ~np.isfinite(wanted)
        if outside.any():
            raise InputError(
                f"torque: expected a torque within {low:.4g} ... {high:.4g} N.m, "
                f"got {np.extract(outside, values)[0]:.4g}"
            )
        return sign * np.vectorize(self._solve, otypes=[float])(wanted)

    def backlash(self, torque: float | None = None) -> float:
        """Twist, rad, across which no more than a thousandth of `torque`, N.m, is carried (default: the greatest)."""
        return self._width(BACKLASH_SHARE, torque)

    def lost_motion(self, torque: float | None = None) -> float:
        """Twist, rad, between plus and minus 3 % of `torque`, N.m (default: the greatest)."""
        return self._width(LOST_MOTION_SHARE, torque)

    @property
    def full_torque(self) -> float:
        """Greatest mean torque, N.m."""
        return float(self.torque.max())

    @property
    def _one_sided(self) -> bool:
        return bool(self.twist[0] >= 0)

    @functools.cached_property
    def _mean(self) -> PchipInterpolator:
        return PchipInterpolator(self.twist, self.torque, extrapolate=False)

    def _evaluate(self, function: Callable[[Array], Array], twist: Array) -> Array:
        # A rounding error beyond the last point is not an extrapolation.
        rounding = 1e-12 * float(np.abs(self.twist).max())
        outside = (twist < self.twist[0] - rounding) | (twist > self.twist[-1] + rounding) | ~np.isfinite(twist)
        if outside.any():
            raise InputError(
                f"twist: expected a twist within {self.twist[0] / ARCMIN:.4g} ... "
                f"{self.twist[-1] / ARCMIN:.4g} arcmin, got {np.extract(outside, twist)[0] / ARCMIN:.4g}"
            )
        return function(np.clip(twist, self.twist[0], self.twist[-1]))

    def _solve(self, torque: float) -> float:
        i = int(np.clip(np.searchsorted(self.torque, torque, side="right"), 1, len(self.twist) - 1))
        low, high = float(self.torque[i - 1]), float(self.torque[i])
        if torque >= high:
            return float(self.twist[i])
        if torque <= low:
            return float(self.twist[i - 1])
        # The cubic of this interval, evaluated without the interpolator's checks of every argument.
        start, (a, b, c, d) = float(self.twist[i - 1]), (float(x) for x in self._mean.c[:, i - 1])
        return bracketed_root(
            lambda x: ((a * (x - start) + b) * (x - start) + c) * (x - start) + d - torque, start, float(self.twist[i])
        )

    def _width(self, share: float, torque: float | None) -> float:
        full = self.full_torque if torque is None else torque
        expect(full > 0 and share * full <= self.full_torque, "a torque the curve reaches, in N.m", torque, "torque")
        high = float(self.twist_at(share * full))
        if self._one_sided:
            return 2 * high
        return high - float(self.twist_at(-share * full))

    def columns(self) -> dict[str, Array]:
        """The columns of `curve.csv`, (n,) each, by their headers; twist in arcmin."""
        return {
            "twist [arcmin]": self.twist / ARCMIN,
            "torque_mean [N.m]": self.torque,
            "torque_p10 [N.m]": self.torque_p10,
            "torque_p90 [N.m]": self.torque_p90,
            "stiffness [N.m/arcmin]": self.stiffness * ARCMIN,
            "load_share [1]": self.load_share,
            **{force_column(contact): self.contact_force[:, k] for k, contact in enumerate(self.contacts)},
        }

    def __repr__(self) -> str:
        return (
            f"TwistTorqueCurve({self.name!r}, {len(self.twist)} twists to {self.twist[-1] / ARCMIN:.4g} arcmin, "
            f"{self.full_torque:.4g} N.m)"
        )

    def _repr_html_(self) -> str:
        rows = {
            "twist [arcmin]": f"{self.twist[0] / ARCMIN:.4g} ... {self.twist[-1] / ARCMIN:.4g}",
            "greatest mean torque [N.m]": f"{self.full_torque:.4g}",
            "greatest stiffness [N.m/arcmin]": f"{float(self.stiffness.max()) * ARCMIN:.4g}",
            **self.notes,
        }
        return html_table(self.name or "twist over torque", rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque, mean and band, on `ax` or on new axes, which are returned."""
        return view("stiffness_model.plotting.curves:twist_over_torque")(self, ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with the columns of `curve.csv`. Raises `InputError` without pandas."""
        return dataframe(self.columns())

    def write_csv(self, path: str | os.PathLike[str], further: Mapping[str, Array] | None = None) -> None:
        """Write `columns` as CSV to `path`, atomically.

        further: columns (n,) after them by their headers, such as "pressure_gear [MPa]". Raises `InputError` if the
        file cannot be written.
        """
        columns = {**self.columns(), **(further or {})}
        with atomic_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            writer.writerows(zip(*([f"{v:.9g}" for v in values] for values in columns.values()), strict=True))
