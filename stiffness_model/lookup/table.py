"""The lookup: torque, force and load share over twist x gear clearance, read from spline tables.

`build_lookup` makes them from the solver. Torque is an odd function of the twist (each percentile mirrors the other),
force and load share are even. The clearance axis is physical: a shift of every drive's gear clearance, m.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..display import dataframe, html_table, view
from ..errors import expect, expect_number
from ..io.atomic_files import atomic_file
from ..numerics.arrays import Array
from ..numerics.bspline import Axis, evaluate
from ..units import ARCMIN, MICROMETRE
from .element_table import ElementTable
from .modulus import ModulusShares
from .table_files import MAX_ENTRY, expect_table, load_tables, parse_axis, require_keys

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = ("torque_mean", "torque_p10", "torque_p90", "max_contact_force", "load_share")
"""First axis of `Lookup.coefficients`."""
_FORMAT = 1


@dataclass(frozen=True)
class Lookup:
    """Spline tables over twist (rad at the output) and gear clearance (m).

    coefficients: (5, twist.size, clearance.size) of uniform cubic B-splines, in the order of `QUANTITIES`.
    full_torque: mean torque at the drawing's max_twist without additional clearance, N.m. error: by quantity, maximum
    deviation from the solver at the cells' midpoints, relative to the maximum within max_twist. drawing, n_drives,
    seed, version: what the tables were made from. modulus, element: only where an effect inside needs the influence of
    the modulus or of one element.
    """

    twist: Axis
    clearance: Axis
    coefficients: Array
    full_torque: float
    error: Mapping[str, float]
    drawing: Mapping[str, Any]
    n_drives: int
    seed: int
    version: str
    modulus: ModulusShares | None = None
    element: ElementTable | None = None

    @property
    def has_contacts(self) -> bool:
        """Whether contact forces, load shares and a band of the population are known."""
        return True

    @property
    def drive_table(self) -> Mapping[str, Any] | None:
        """The drawing of the drive inside, as `drive_from_dict` reads it; None for a curve without one."""
        return self.drawing

    def torque(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        """Torque, N.m, at twists (rad) and gear clearances (m).

        Beyond the twist's range the torque is extrapolated linearly. The clearance is limited to its range, since
        linear extrapolation there could make the torque fall with the twist. `in_range` tells where either happens.
        band: 0 for the mean, -1 for the 10th and +1 for the 90th percentile, linear between.
        """
        return self._blend(evaluate(self.axes, self.coefficients[:3], twist, clearance), band)

    def stiffness(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        """Derivative of `torque` with respect to the twist, N.m/rad."""
        return self._blend(evaluate(self.axes, self.coefficients[:3], twist, clearance, slope=True), band)

    def max_contact_force(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        """Mean over the drives of the greatest contact force, N, at twists (rad) and gear clearances (m)."""
        return evaluate(self.axes, self.coefficients[3], twist, clearance)

    def load_share(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        """Greatest share of one element in the drive's torque; the nearest meaningful value where the torque is too
        low.
        """
        return evaluate(self.axes, self.coefficients[4], twist, clearance)

    def in_range(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> NDArray[np.bool_]:
        """Whether points lie inside the tables; outside, values are extrapolated."""
        t, c = np.asarray(twist, float), np.asarray(clearance, float)
        return (
            (self.twist.start <= t) & (t <= self.twist.stop) & (self.clearance.start <= c) & (c <= self.clearance.stop)
        )

    def twist_at(self, torque: ArrayLike, clearance: float = 0.0, band: float = 0.0) -> Array:
        """Twist, rad, at which the torque, N.m, is carried: the inverse of `torque`, by bisection and Newton's method.

        Where there is backlash, a twist within it. Raises `InputError` for a torque that is not finite.
        """
        wanted = np.asarray(torque, float)
        expect(bool(np.isfinite(wanted).all()), "finite torques", torque, "torque")
        nodes = self.twist.nodes
        values = self.torque(nodes, clearance, band)
        x = np.interp(wanted, values, nodes)
        end_slope = self.stiffness(nodes[[0, -1]], clearance, band)
        x = np.where(wanted > values[-1], nodes[-1] + (wanted - values[-1]) / end_slope[1], x)
        x = np.where(wanted < values[0], nodes[0] + (wanted - values[0]) / end_slope[0], x)
        low, high = x - self.twist.step, x + self.twist.step
        for _ in range(60):
            gap = self.torque(x, clearance, band) - wanted
            low, high = np.where(gap < 0, x, low), np.where(gap > 0, x, high)
            slope = self.stiffness(x, clearance, band)
            newton = x - gap / np.where(slope > 0, slope, np.inf)
            x = np.where((newton > low) & (newton < high), newton, np.where(gap == 0, x, (low + high) / 2))
        return x

    def __repr__(self) -> str:
        return f"Lookup({describe(self)})"

    def _repr_html_(self) -> str:
        rows = {
            "twist [arcmin]": f"+-{self.twist.stop / ARCMIN:.4g}, {self.twist.cells} cells",
            "clearance [um]": f"+-{self.clearance.stop / MICROMETRE:.4g}, {self.clearance.cells} cells",
            "full torque [N.m]": f"{self.full_torque:.4g}",
            "drives in the band": f"{self.n_drives}, seed {self.seed}",
            **{f"error of {name} [1]": f"{value:.1e}" for name, value in self.error.items()},
        }
        return html_table("lookup", rows)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque, mean and band, as drawn (no additional clearance), on `ax` or on new axes, which are
        returned.
        """
        twist = np.linspace(self.twist.start, self.twist.stop, 4 * self.twist.cells + 1)
        mean, low, high = (self.torque(twist, band=band) for band in (0.0, -1.0, 1.0))
        return view("stiffness_model.plotting.curves:twist_over_torque_band")(twist, mean, low, high, ax=ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each node of twist and clearance. Raises `InputError` without pandas."""
        twist, clearance = (v.ravel() for v in np.meshgrid(self.twist.nodes, self.clearance.nodes, indexing="ij"))
        mean, low, high = (self.torque(twist, clearance, band) for band in (0.0, -1.0, 1.0))
        return dataframe(
            {
                "twist [arcmin]": twist / ARCMIN,
                "clearance [um]": clearance / MICROMETRE,
                "torque_mean [N.m]": mean,
                "torque_p10 [N.m]": low,
                "torque_p90 [N.m]": high,
                "stiffness [N.m/arcmin]": self.stiffness(twist, clearance) * ARCMIN,
                "max_contact_force [N]": self.max_contact_force(twist, clearance),
                "load_share [1]": self.load_share(twist, clearance),
            }
        )

    @property
    def axes(self) -> tuple[Axis, Axis]:
        """Twist and clearance axis."""
        return self.twist, self.clearance

    @staticmethod
    def _blend(values: Array, band: ArrayLike) -> Array:
        b = np.asarray(band, float)
        mean, p10, p90 = values
        return mean + np.maximum(b, 0.0) * (p90 - mean) + np.maximum(-b, 0.0) * (p10 - mean)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write one .npz file, atomically; `Lookup.load` returns an equal lookup."""
        header = {
            "format": _FORMAT,
            "full_torque": self.full_torque,
            "error": dict(self.error),
            "drawing": self.drawing,
            "n_drives": self.n_drives,
            "seed": self.seed,
            "version": self.version,
            "twist": astuple(self.twist),
            "clearance": astuple(self.clearance),
            "modulus": None if self.modulus is None else asdict(self.modulus),
        }
        tables = {"coefficients": self.coefficients}
        if self.element is not None:
            header["element"], tables["element"] = self.element.header(), self.element.coefficients
        with atomic_file(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, head=np.array(json.dumps(header)), **tables)  # type: ignore[arg-type]

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Lookup:
        """Read a file written by `save`. Raises `InputError` for any other file."""
        header, tables = load_tables(path, "a saved lookup")
        where = str(path)
        expect(header.get("format") == _FORMAT, f"a lookup of format {_FORMAT}", header.get("format"), where)
        require_keys(tables, ("coefficients", *(("element",) if header.get("element") else ())), where)
        return Lookup.from_header(header, tables["coefficients"], tables.get("element"), where)

    @staticmethod
    def from_header(header: Mapping[str, Any], coefficients: Array, element: Array | None, where: str) -> Lookup:
        """The lookup of a header, with the tables beside it. Raises `InputError` for unsuitable ones.

        The tables of an individual, which needs none, have size zero (`reefmu.fmu.model.table_encoding`).
        """
        require_keys(
            header,
            ("twist", "clearance", "full_torque", "error", "drawing", "n_drives", "seed", "version", "modulus"),
            where,
        )
        twist, clearance = (parse_axis(header[name], f"{where}: {name}") for name in ("twist", "clearance"))
        if coefficients.size:
            expect_table(coefficients, (len(QUANTITIES), twist.size, clearance.size), where)
        if isinstance(header["drawing"], Mapping) and "curve" in header["drawing"]:
            return view("stiffness_model.lookup.curve_lookup:curve_lookup_from_drawing")(header["drawing"], where)
        error = require_keys(header["error"], QUANTITIES, f"{where}: error")
        expect(isinstance(header["version"], str), "a text as version", header["version"], where)
        return Lookup(
            twist,
            clearance,
            coefficients,
            expect_number(header["full_torque"], "a full torque above zero, N.m", where, low=1e-12, high=MAX_ENTRY),
            {name: expect_number(error[name], "a finite error", f"{where}: {name}") for name in QUANTITIES},
            require_keys(header["drawing"], (), f"{where}: drawing"),
            _whole(header["n_drives"], 1, f"{where}: n_drives"),
            _whole(header["seed"], 0, f"{where}: seed"),
            header["version"],
            None if header["modulus"] is None else ModulusShares.from_dict(header["modulus"], f"{where}: modulus"),
            None if element is None else ElementTable.from_header(header.get("element"), element, f"{where}: element"),
        )


def _whole(value: Any, low: int, where: str) -> int:
    expect(
        isinstance(value, int) and not isinstance(value, bool) and value >= low,
        f"a whole number of at least {low}",
        value,
        where,
    )
    return value


def describe(lookup: Lookup) -> str:
    """One line on the lookup's range and accuracy."""
    return (
        f"twist +-{lookup.twist.stop / ARCMIN:.3g} arcmin, gear clearance "
        f"+-{lookup.clearance.stop / MICROMETRE:.3g} um, band of {lookup.n_drives} drives, seed {lookup.seed}; "
        f"mean torque within {lookup.error['torque_mean']:.1e} of full torque"
    )
