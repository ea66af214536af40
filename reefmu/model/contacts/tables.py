"""The lookup as a CasADi function, and the cache of lookups on disk."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

import stiffness_model
from reefmu.verbosity import show_detail
from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.io.drawing_toml import drive_to_dict
from stiffness_model.kinds import AnyDrive, kind_of
from stiffness_model.lookup.build_lookup import N_DRIVES, QUANTITIES, Lookup, build_lookup
from stiffness_model.lookup.element_table import ElementTable, build_element_table
from stiffness_model.numerics.bspline import Axis

Table = TypeVar("Table", Lookup, ElementTable)


def lookup_function(lookup: Lookup) -> ca.Function:
    """(twist rad, clearance m, band) -> (torque, stiffness, max contact force, load share, in range).

    The same splines as `Lookup`, to rounding. They are extrapolated linearly in twist; the clearance is limited to its
    range.
    """
    assert QUANTITIES[3:] == ("max_contact_force", "load_share")
    twist, clearance, band = ca.MX.sym("twist"), ca.MX.sym("clearance"), ca.MX.sym("band")
    axes = (lookup.twist, lookup.clearance)
    at = expanded("held", [twist, clearance], [ca.vertcat(clamped(axes[0], twist), clamped(axes[1], clearance))])(
        twist, clearance
    )
    values = spline_function("values", axes, lookup.coefficients)(at)
    slopes = spline_function("slopes", axes, lookup.coefficients, slope=True)(at)
    outputs = _extrapolated(len(lookup.coefficients)).call([values, slopes, at, twist, clearance, band])
    return ca.Function(
        "lookup",
        [twist, clearance, band],
        outputs,
        ["twist", "clearance", "band"],
        ["torque", "stiffness", "max_contact_force", "load_share", "in_range"],
    )


def _extrapolated(n: int) -> ca.Function:
    """(values (n,), slopes (n,) at the point (2,), that point, twist, clearance, band) -> outputs of the lookup."""
    values, slopes, at = ca.MX.sym("values", n), ca.MX.sym("slopes", n), ca.MX.sym("at", 2)
    twist, clearance, band = ca.MX.sym("twist"), ca.MX.sym("clearance"), ca.MX.sym("band")
    along = values + (twist - at[0]) * slopes
    in_range = ca.logic_and(twist == at[0], clearance == at[1])
    return expanded(
        "continued",
        [values, slopes, at, twist, clearance, band],
        [_blend(ca.vertsplit(along)[:3], band), _blend(ca.vertsplit(slopes)[:3], band), along[3], along[4], in_range],
    )


def expanded(name: str, arguments: list[ca.MX], results: list[ca.MX]) -> ca.Function:
    """A function in scalar operations, several times faster than in matrices, interpreted or compiled."""
    return ca.Function(name, arguments, results).expand()


def spline_function(
    name: str, axes: Sequence[Axis], coefficients: NDArray[np.float64], *, slope: bool = False
) -> ca.Function:
    """(point (n_axes,)) -> values (m,) of splines on these axes, or their slopes along the first one.

    coefficients: (m, *sizes of the axes) as in `numerics.bspline`. The point must lie on the axes; extrapolation is up
    to the caller. CasADi's own splines are used because an expression that indexes a constant table copies the whole
    table at every call.
    """
    degrees = [3] * len(axes)
    knots = [axis.start + axis.step * np.arange(-3, axis.cells + 4) for axis in axes]
    if slope:
        # The derivative of a uniform B-spline is a spline of one degree less, of the coefficients' differences.
        coefficients, degrees[0], knots[0] = np.diff(coefficients, axis=1) / axes[0].step, 2, knots[0][1:-1]
    return ca.Function.bspline(
        name, [k.tolist() for k in knots], coefficients.ravel(order="F").tolist(), degrees, len(coefficients)
    )


def clamped(axis: Axis, x: ca.MX) -> ca.MX:
    """x limited to the axis; with slope 1 at both ends, which belong to the axis."""
    return ca.if_else(x < axis.start, axis.start, ca.if_else(x > axis.stop, axis.stop, x))


def locate(axis: Axis, x: ca.MX) -> tuple[ca.MX, ca.MX]:
    """The cell of x (the outermost one beyond the axis) and the coordinate in it."""
    u = (x - axis.start) / axis.step
    cell = ca.fmax(ca.fmin(ca.floor(u), axis.cells - 1), 0)
    return cell, u - cell


def clamped_to_unit(f: ca.MX) -> ca.MX:
    """f limited to 0 ... 1, with slope 1 at both ends.

    A cell's coordinate is exactly 0 at every node, and the drawn clearance is a node: CasADi's fmin and fmax have half
    the slope there.
    """
    return ca.if_else(f < 0, 0, ca.if_else(f > 1, 1, f))


def _blend(values: Sequence[ca.MX], band: ca.MX) -> ca.MX:
    mean, p10, p90 = values
    return mean + ca.fmax(band, 0) * (p90 - mean) + ca.fmax(-band, 0) * (p10 - mean)


def cache_folder() -> Path:
    """Folder of computed tables: $REEFMU_CACHE, else the cache folder of the user."""
    if folder := os.environ.get("REEFMU_CACHE"):
        return Path(folder)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "reefmu"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "reefmu"


def cached_lookup(drive: AnyDrive, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None) -> Lookup:
    """The drive's lookup, from the cache if the same code built it before, else built (some seconds).

    If the cache cannot be written, the tables are built every time; that is no error. A kind whose lookup needs no
    solving is not cached.
    """
    if not kind_of(drive).is_cached:
        return build_lookup(drive, n_drives, seed, executor)
    return _cached(
        f"lookup-{fingerprint(drive, n_drives, seed)}.npz",
        Lookup.load,
        lambda: build_lookup(drive, n_drives, seed, executor),
    )


def cached_element_table(drive: Drive) -> ElementTable:
    """The drawing's table of one element, cached in the same way (built in half a second)."""
    return _cached(f"element-{fingerprint(drive)}.npz", ElementTable.load, lambda: build_element_table(drive))


def _cached(name: str, load: Callable[[Path], Table], build: Callable[[], Table]) -> Table:
    path = cache_folder() / name
    with contextlib.suppress(InputError):  # missing, truncated, or no such table
        table = load(path)
        show_detail(f"tables from {path}")
        return table
    show_detail(f"no tables in {path}; solving them")
    table = build()
    with contextlib.suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        table.save(path)
    return table


def fingerprint(drive: AnyDrive, n_drives: int = 0, seed: int = 0) -> str:
    """A name for the tables that this code computes from this drawing; it changes with either."""
    drawing: dict[str, Any] = drive_to_dict(drive)
    text = json.dumps([drawing, n_drives, seed, np.lib.NumpyVersion(np.__version__).major], sort_keys=True)
    digest = hashlib.sha256(text.encode())
    for source in sorted(Path(stiffness_model.__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:24]
