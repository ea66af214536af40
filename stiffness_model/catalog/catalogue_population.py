"""What functions for any drive get of a catalogue drive: population, curve, lookup and inherent effects."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PPoly

from ..display import one_line
from ..drawing import sampling
from ..drawing.twist_limits import expect_twists
from ..errors import InputError, expect_integer, expect_number
from ..kinds import CONTACT_FORCES, lacking
from ..lookup.curve_lookup import NOMINAL_LEVER, CurveLookup, curve_lookup
from ..montecarlo.twist_torque_curve import TwistTorqueCurve
from ..montecarlo.virtual_drives import drives_dataframe, expect_curve_twists
from ..numerics.arrays import Array, ArrayValue
from ..transmission_losses import tabulated_efficiency, tabulated_friction
from ..units import format_quantity, quantity_text
from .catalogue_drive import CatalogueDrive, stated_values
from .catalogue_toml import write_catalogue

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class MissingResultError(InputError, AttributeError):
    """A result that a kind of drives does not have."""


@dataclass(frozen=True, eq=False, repr=False)
class SheetCurve(TwistTorqueCurve):
    """A curve of straight lines between its points, without contact forces and load shares."""

    @cached_property
    def _mean(self) -> Any:
        lines = np.zeros((4, len(self.twist) - 1))
        lines[2], lines[3] = np.diff(self.torque) / np.diff(self.twist), self.torque[:-1]
        return PPoly(lines, self.twist, extrapolate=False)

    def columns(self) -> dict[str, Array]:
        """The columns of `curve.csv`, (n,) each, by their headers; twist in arcmin."""
        known = ("twist", "torque", "stiffness")
        return {head: values for head, values in super().columns().items() if head.startswith(known)}


@dataclass(frozen=True, eq=False)
class CataloguePopulation(ArrayValue):
    """The torque of a catalogue drive; its `n_drives` drives are all alike, since a sheet states one curve.

    twist: (n_twist,) rad at the output. torque, crank_torque: (n_drives, n_twist) N.m, without losses. Contact forces
    and load shares raise `MissingResultError`.
    """

    drive: CatalogueDrive
    twist: Array
    seed: int
    torque: Array
    crank_torque: Array

    def __getattr__(self, name: str) -> NoReturn:
        if name in ("contact_force", "load_share", "status_counts", "representative"):
            raise MissingResultError(f"{name}: {lacking(self.drive, CONTACT_FORCES)}")
        raise AttributeError(name)

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def n_drives(self) -> int:
        """Number of drives."""
        return len(self.torque)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Twist over torque on `ax` or on new axes, which are returned."""
        return self.curve().plot(ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with a row for each drive and twist. Raises `InputError` without pandas."""
        return drives_dataframe(self.twist, {"torque [N.m]": self.torque, "crank_torque [N.m]": self.crank_torque})

    def curve(self) -> TwistTorqueCurve:
        """The sheet's curve at the sorted twists and, between them, at its corners; the band is the curve itself.

        Raises `InputError` for fewer than two different twists.
        """
        twist = expect_curve_twists(self.twist)
        corners = self.drive.line.twist
        twist = np.union1d(twist, corners[(corners > twist[0]) & (corners < twist[-1])])
        torque = self.drive.line.at(twist)
        nothing = np.full((len(twist), 4), np.nan)
        stiffness = self.drive.line.slope_at(twist)
        notes = {"source": self.drive.source}
        return SheetCurve(twist, torque, torque, torque, stiffness, nothing, nothing[:, 0], self.drive.name, notes)

    def lines(self) -> list[str]:
        """What the sheet states, with its sources, line by line."""
        drive = self.drive
        title = " ".join(text for text in (drive.maker, drive.type, drive.gear_type) if text)
        lines = [f"{title or drive.name}, ratio {drive.ratio:g}; source: {drive.source}"]
        for name, text in stated_values(drive).items():
            own = f"  ({drive.sources[name]})" if name in drive.sources else ""
            same = f" = {quantity_text(getattr(drive, name), 'N.m/rad')}" if text.endswith("N.m/rad") else ""
            lines.append(f"  {name.replace('_', ' '):22} {text}{same}{own}")
        if drive.hysteresis_loss is not None:
            limit = ", an upper limit" if "hysteresis_loss" in drive.upper_limits else ""
            torque = format_quantity(round(drive.hysteresis_torque, 3), "torque")
            lines.append(f"models contain the effect hysteresis of {torque}, half the width of the sheet's loop{limit}")
        if drive.efficiency is not None:
            low, high = (f(value for row in drive.efficiency.value for value in row) for f in (min, max))
            lines.append(f"  efficiency             {low:g} ... {high:g} over speed and load")
            parameters, deviation = fitted_friction(drive)
            if parameters:
                stated = ", ".join(f"{name} {value:.3g}" for name, value in parameters.items())
                lines.append(
                    f"models contain the effect crank_friction ({stated}), which meets these to {deviation:.3f}"
                )
        return [*lines, drive.note] if drive.note else lines


def simulate_catalogue(
    drive: CatalogueDrive,
    twist: ArrayLike,
    n_drives: int = 1000,
    seed: int = 0,
    *,
    clearance: float = 0.0,
    executor: Executor | None = None,
) -> CataloguePopulation:
    """`stiffness_model.simulate` for a catalogue drive.

    clearance: m, as an effect `backlash` of the model (`NOMINAL_LEVER`). Raises `InputError` for twists that are not
    finite or far beyond max_twist (`twist_limits`), and for less than one drive.
    """
    expect_integer(n_drives, "at least one drive", "n_drives")
    expect_number(clearance, "a finite clearance in m", "clearance")
    sampling.check_seed(seed)
    angles = expect_twists(drive, twist)
    torque = drive.line.at(angles)
    if clearance:
        torque = catalogue_lookup(drive).torque(angles, clearance)
    torque = np.broadcast_to(torque, (int(n_drives), len(angles)))
    return CataloguePopulation(drive, angles, int(seed), torque, torque / drive.ratio)


def catalogue_lookup(
    drive: CatalogueDrive, n_drives: int = 1, seed: int = 0, executor: Executor | None = None
) -> CurveLookup:
    """The lookup of a catalogue drive: its lines with rounded corners, exact elsewhere; it needs no other argument."""
    line = drive.line
    return curve_lookup(line.twist, line.torque, NOMINAL_LEVER, drive.name, drive.ratio, write_catalogue(drive))


def catalogue_effects(drive: CatalogueDrive) -> dict[str, dict[str, float]]:
    """The sheet's hysteresis loss as parameters of the effect `hysteresis` and its efficiencies as those of
    `crank_friction`, by effect and name; without what the sheet does not state."""
    found = {} if drive.hysteresis_loss is None else {"hysteresis": {"torque": drive.hysteresis_torque}}
    friction, _ = fitted_friction(drive)
    return {**found, **({"crank_friction": friction} if friction else {})}


def fitted_friction(drive: CatalogueDrive) -> tuple[dict[str, float], float]:
    """Parameters of `crank_friction` by name, and the greatest difference of their efficiencies from the sheet's.

    No parameters for a sheet without efficiencies under load.
    """
    table = drive.efficiency
    if table is None or max(table.torque) <= 0:
        return {}, 0.0
    speed, torque = (a.ravel() for a in np.meshgrid(table.speed, table.torque, indexing="ij"))
    loaded = torque > 0
    speed, useful = speed[loaded], torque[loaded] / abs(drive.ratio)
    efficiency = np.array(table.value).ravel()[loaded]
    parameters = tabulated_friction(speed, useful, efficiency)
    return parameters, float(np.abs(tabulated_efficiency(parameters, speed, useful) - efficiency).max())
