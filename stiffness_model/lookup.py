"""The precomputed lookup: torque, force and load share over twist x gear clearance, from the solver.

The clearance axis is physical: a shift of every drive's gear clearance (m), solved for and not bent into the
curve. Mean, 10th and 90th percentile of the torque stand beside each other. The mean is that of all drives the
drawing allows, by elements spread evenly over positions and tolerances; the band lies about it as it does in a
number of drawn drives. Torque is odd in the twist (the
percentiles mirror each other), force and load share are even; sampling noise against that is averaged out.
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import asdict, astuple, dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contacts import build_contacts, usable
from .curve import BAND
from .drawing_file import drive_to_dict
from .drive import Drive
from .element_table import ElementTable
from .equilibrium import solve
from .errors import InputError, expect
from .files import whole_file
from .modulus import ModulusShares
from .population import Population, simulate
from .sampling import spread, spread_drives
from .spline import Axis, evaluate, fit
from .units import ARCMIN, MICROMETRE

Array = NDArray[np.float64]

QUANTITIES = ("torque_mean", "torque_p10", "torque_p90", "max_contact_force", "load_share")
"""First axis of `Lookup.coefficients`."""
ERROR_BOUND = 1e-4
"""The error of the mean torque that `build_lookup` aims at, as a share of the full torque."""
N_DRIVES = 250
"""Virtual drives behind band, force and load share."""
N_SPREAD = 2**13
"""Evenly spread elements behind the mean torque."""
N_SPREAD_DRIVES = 256
"""Evenly spread drives behind it where their elements feel each other."""
_FORMAT = 1


@dataclass(frozen=True)
class Lookup:
    """Spline tables over twist (rad at the output) and gear clearance (m).

    coefficients: (5, twist.size, clearance.size) of uniform cubic B-splines, in the order of `QUANTITIES`.
    full_torque: mean torque at the drawing's max_twist without clearance, N.m. error: greatest deviation from
    the solver at the middles of cells, as a share of the greatest value within max_twist, for each quantity.
    drawing, n_drives, seed, version: what made it. modulus, element: only where something asks what another
    modulus or one element does to the torque.
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

    def torque(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        """Torque, N.m, at twists (rad) and gear clearances (m).

        Beyond the twist's range the last slope goes on; a clearance beyond the range counts as its end, for
        there a straight line could fall with the twist. `in_range` tells both.
        band: 0 the mean, -1 the 10th and +1 the 90th percentile, linear between.
        """
        return self._blend(evaluate(self.axes, self.coefficients[:3], twist, clearance), band)

    def stiffness(self, twist: ArrayLike, clearance: ArrayLike = 0.0, band: ArrayLike = 0.0) -> Array:
        """Derivative of `torque` by the twist, N.m/rad."""
        return self._blend(evaluate(self.axes, self.coefficients[:3], twist, clearance, slope=True), band)

    def max_contact_force(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        """Mean over the drives of the greatest contact force, N."""
        return evaluate(self.axes, self.coefficients[3], twist, clearance)

    def load_share(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> Array:
        """Greatest torque of one element over the drive's; held where the torque is too low to tell."""
        return evaluate(self.axes, self.coefficients[4], twist, clearance)

    def in_range(self, twist: ArrayLike, clearance: ArrayLike = 0.0) -> NDArray[np.bool_]:
        """Whether points lie inside the tables; outside, values are extrapolated."""
        t, c = np.asarray(twist, float), np.asarray(clearance, float)
        return ((self.twist.start <= t) & (t <= self.twist.stop)
                & (self.clearance.start <= c) & (c <= self.clearance.stop))

    def twist_at(self, torque: ArrayLike, clearance: float = 0.0, band: float = 0.0) -> Array:
        """Twist, rad, that carries the torque, N.m: the inverse of `torque`, by bisection and Newton's method.

        Where there is play, a twist within the play. Raises `InputError` for a torque that is not finite.
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
        """Write to one .npz file, whole or not at all; `Lookup.load` gives back an equal lookup."""
        head = {
            "format": _FORMAT, "full_torque": self.full_torque, "error": dict(self.error),
            "drawing": self.drawing, "n_drives": self.n_drives, "seed": self.seed, "version": self.version,
            "twist": astuple(self.twist), "clearance": astuple(self.clearance),
            "modulus": None if self.modulus is None else asdict(self.modulus),
        }
        tables = {"coefficients": self.coefficients}
        if self.element is not None:
            head["element"], tables["element"] = self.element.head(), self.element.coefficients
        with whole_file(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, head=np.array(json.dumps(head)), **tables)  # type: ignore[arg-type]

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Lookup:
        """Read what `save` wrote. Raises `InputError` for anything else."""
        try:
            with open(path, "rb") as file, np.load(file, allow_pickle=False) as data:
                head, coefficients = json.loads(str(data["head"])), data["coefficients"]
                element = data["element"] if head.get("element") else None
        except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error) as error:
            raise InputError(f"{path}: expected a saved lookup (.npz), got {error}") from None
        expect(head.get("format") == _FORMAT, f"a lookup of format {_FORMAT}", head.get("format"), str(path))
        twist, clearance = (Axis(start, step, int(cells)) for start, step, cells in (head["twist"], head["clearance"]))
        expect(coefficients.shape == (len(QUANTITIES), twist.size, clearance.size)
               and bool(np.isfinite(coefficients).all()), "finite tables of the size the head states",
               coefficients.shape, str(path))
        return Lookup(twist, clearance, coefficients, head["full_torque"], head["error"], head["drawing"],
                      head["n_drives"], head["seed"], head["version"],
                      ModulusShares(**head["modulus"]) if head.get("modulus") else None,
                      None if element is None else ElementTable.of(head["element"], element, str(path)))


def build_lookup(drive: Drive, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None) -> Lookup:
    """Solve the drawing over twist x clearance and lay splines through the mean, and the band of `n_drives` drives.

    Twist reaches to twice the drawing's max_twist, clearance to half of what max_twist closes. The grids follow
    the scatter of the contact clearances, which is the length over which contact sets in smoothly; if the mean
    torque misses `ERROR_BOUND` they are refined. Raises `InputError` for a drawing with inertia switched on: its
    forces follow the crank's speed, which the tables do not know.
    """
    expect(not drive.beyond.moves, "inertia 'off': tables over twist and clearance do not know the crank's speed",
           drive.beyond.inertia, drive.name)
    per_twist = drive.eccentricity * abs(drive.ratio)
    scatter = float(np.sqrt(sum(drive.tolerances[part].sigma**2 for part in ("gear", "crank", "element"))))
    widest = 0.5 * per_twist * drive.max_twist
    clearance_step = float(np.clip(0.85 * scatter, widest / 30, widest / 12))
    twist_step = float(np.clip(1.05 * scatter / per_twist, drive.max_twist / 60, drive.max_twist / 26))
    refinements = (1.0, 1.5, 2.25)
    for finer in refinements:
        axes = (_symmetric(2 * drive.max_twist, twist_step / finer), _symmetric(widest, clearance_step / finer))
        lookup = _build_on(drive, axes, n_drives, seed, executor)
        if lookup.error["torque_mean"] <= 0.8 * ERROR_BOUND or finer == refinements[-1]:
            return lookup
    raise AssertionError("the last refinement returns")


def _build_on(drive: Drive, axes: tuple[Axis, Axis], n_drives: int, seed: int, executor: Executor | None) -> Lookup:
    """The lookup on given axes, with its measured error."""
    solved = _solve(drive, axes[0].nodes, axes[1].nodes, n_drives, seed, executor)
    tables = np.stack([table for table, _ in solved], -1)
    coefficients = fit(axes[1], fit(axes[0], tables, 1), 2)
    coefficients[:3] = _rising(coefficients[:3])
    full_torque = float(evaluate(axes, coefficients[0], drive.max_twist, 0.0))
    error = _measured_error(drive, axes, coefficients, n_drives, seed, executor)
    return Lookup(axes[0], axes[1], coefficients, full_torque, error, drive_to_dict(drive), n_drives, seed, _version())


def _symmetric(reach: float, step: float) -> Axis:
    cells = 2 * int(np.ceil(reach / step))
    return Axis(-reach, 2 * reach / cells, cells)


def _solve(drive: Drive, twist: Array, clearances: Array, n_drives: int, seed: int, executor: Executor | None
           ) -> list[tuple[Array, NDArray[np.bool_]]]:
    """`_tables` at every clearance, shared among the executor's workers."""
    work = partial(_tables, drive, twist, n_drives, seed)
    return list((map if executor is None else executor.map)(work, clearances.tolist()))


def _tables(drive: Drive, twist: Array, n_drives: int, seed: int, clearance: float
            ) -> tuple[Array, NDArray[np.bool_]]:
    """The five quantities over a symmetric twist grid at one clearance, (5, n_twist), and where the load share
    is representative.
    """
    population = simulate(drive, twist, n_drives, seed, gear_shift=clearance)
    mean = mean_torque(drive, twist, clearance)
    low, high = np.percentile(population.torque, BAND, axis=0) - population.torque.mean(axis=0) + mean
    force = population.contact_force.max(axis=2).mean(axis=0)
    share = _held_share(population)
    tables = np.stack([
        (mean - mean[::-1]) / 2,
        (low - high[::-1]) / 2,
        (high - low[::-1]) / 2,
        (force + force[::-1]) / 2,
        (share + share[::-1]) / 2,
    ])
    return tables, population.representative


def mean_torque(drive: Drive, twist: Array, clearance: float = 0.0) -> Array:
    """Mean torque, (n_twist,) N.m, of all drives of the drawing, by elements spread evenly (`sampling.spread`).

    Where a bearing or the housing couples the elements, by whole drives (`sampling.spread_drives`).
    """
    if drive.beyond.couples:
        drives = spread_drives(drive, N_SPREAD_DRIVES)
        contacts = build_contacts(drive, drives, clearance)[usable(drive, drives.beta).ravel()]
        return solve(contacts, twist * drive.ratio).output_torque.sum(axis=1) / N_SPREAD_DRIVES
    elements = spread(drive, N_SPREAD)
    contacts = build_contacts(drive, elements, clearance)
    mean = [solve(contacts, [angle * drive.ratio]).output_torque.mean() for angle in twist]
    return np.array(mean) * drive.elements * drive.usable_limit / np.pi


def _held_share(population: Population) -> Array:
    """Mean load share over the twist, the nearest representative value where the torque is too low."""
    known = population.representative
    share = np.where(np.isfinite(population.load_share), np.minimum(population.load_share, 1.0), 1.0).mean(axis=0)
    if not known.any():
        return np.ones_like(share)
    index = np.flatnonzero(known)
    nearest = index[np.abs(index[:, None] - np.arange(len(share))).argmin(axis=0)]
    return share[nearest]


def _rising(coefficients: Array) -> Array:
    """Coefficients that do not fall along the twist, from the middle outwards: then neither does the spline.

    Interpolation undershoots by some 1e-6 of the full torque where contact sets in; this takes it away.
    """
    middle = coefficients.shape[1] // 2
    upper = np.maximum.accumulate(coefficients[:, middle:], axis=1)
    lower = np.minimum.accumulate(coefficients[:, middle::-1], axis=1)[:, ::-1]
    return np.concatenate([lower[:, :-1], upper], axis=1)


def _measured_error(drive: Drive, axes: tuple[Axis, Axis], coefficients: Array, n_drives: int, seed: int,
                    executor: Executor | None) -> dict[str, float]:
    """Greatest deviation of each quantity at middles of cells, over its greatest value within max_twist."""
    twist, clearance = axes
    middles = twist.nodes[:-1] + twist.step / 2
    worst = np.zeros(len(QUANTITIES))
    around = np.unique(np.clip(clearance.cells // 2 + np.array([-clearance.cells // 3, -1, 0, 3, clearance.cells // 3]),
                               0, clearance.cells - 1))
    between = clearance.start + clearance.step * (around + 0.5)
    for c, (solved, representative) in zip(between, _solve(drive, middles, between, n_drives, seed, executor),
                                           strict=True):
        difference = np.abs(evaluate(axes, coefficients, middles, c) - solved)
        # A cell at the edge of the representative part interpolates towards a held value.
        inner = representative & np.roll(representative, 1) & np.roll(representative, -1)
        difference[4, ~inner] = 0.0
        worst = np.maximum(worst, difference.max(axis=1))
    scale = np.abs(evaluate(axes, coefficients, np.linspace(-1, 1, 41) * drive.max_twist, 0.0)).max(axis=1)
    scale[:3] = scale[0]
    return dict(zip(QUANTITIES, (float(v) for v in worst / scale), strict=True))


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("reefmu")
    except PackageNotFoundError:
        return "unknown"


def describe(lookup: Lookup) -> str:
    """One line on what the lookup covers and how exact it is."""
    return (f"twist +-{lookup.twist.stop / ARCMIN:.3g} arcmin, gear clearance "
            f"+-{lookup.clearance.stop / MICROMETRE:.3g} um, band of {lookup.n_drives} drives, seed {lookup.seed}; "
            f"mean torque within {lookup.error['torque_mean']:.1e} of full torque")
