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

import stiffness_model
from stiffness_model.drawing_file import drive_to_dict
from stiffness_model.drive import Drive
from stiffness_model.element_table import ElementTable, build_element_table
from stiffness_model.errors import InputError
from stiffness_model.lookup import N_DRIVES, QUANTITIES, Lookup, build_lookup
from stiffness_model.spline import Axis, slope_weights, weights

Table = TypeVar("Table", Lookup, ElementTable)


def lookup_function(lookup: Lookup) -> ca.Function:
    """(twist rad, clearance m, band) -> (torque, stiffness, max contact force, load share, in range).

    The same splines as `Lookup`, with its weights; the tables stand once in generated code, derivatives are
    taken of the weights.
    """
    twist, clearance, band = ca.MX.sym("twist"), ca.MX.sym("clearance"), ca.MX.sym("band")
    n_q, _, n_c = lookup.coefficients.shape
    i, f = locate(lookup.twist, twist)
    j, g = locate(lookup.clearance, clearance)
    inside, held = clip(f), clip(g)
    # Quantities lie innermost, so that one gather fetches the 4 x 4 cell of all of them.
    table = ca.MX(ca.DM(lookup.coefficients.transpose(1, 2, 0).ravel()))
    offsets = [(a * n_c + b) * n_q + q for a in range(4) for b in range(4) for q in range(n_q)]
    cell = table[(i * n_c + j) * n_q + ca.DM(offsets)]
    in_range = ca.logic_and(ca.logic_and(f >= 0, f <= 1), ca.logic_and(g >= 0, g <= 1))
    return ca.Function(
        "lookup", [twist, clearance, band],
        [*_cell_function(n_q, lookup.twist.step)(cell, f, inside, held, band), in_range],
        ["twist", "clearance", "band"], ["torque", "stiffness", "max_contact_force", "load_share", "in_range"],
    )


def _cell_function(n_q: int, step: float) -> ca.Function:
    """(coefficients of a cell, its coordinates, band) -> (torque, stiffness, max contact force, load share).

    In scalars: straight-line code, several times faster than matrices where the function is interpreted and
    where it is compiled.
    """
    assert QUANTITIES[3:] == ("max_contact_force", "load_share")
    cell, f, inside, held, band = (ca.SX.sym(name, n) for name, n in
                                   (("cell", 16 * n_q), ("f", 1), ("inside", 1), ("held", 1), ("band", 1)))
    along_clearance = weights(held, held)
    rows = [[sum(along_clearance[b] * cell[(4 * a + b) * n_q + q] for b in range(4)) for a in range(4)]
            for q in range(n_q)]
    torques = [_blend([row[a] for row in rows[:3]], band) for a in range(4)]
    along_twist, slopes = weights(f, inside), slope_weights(inside)
    force, share = (sum(w * c for w, c in zip(along_twist, row, strict=True)) for row in rows[3:5])
    return ca.Function("cell", [cell, f, inside, held, band], [
        sum(w * c for w, c in zip(along_twist, torques, strict=True)),
        sum(w * c for w, c in zip(slopes, torques, strict=True)) / step, force, share],
        # Coefficients are constants: without their derivatives the Jacobian's code is a fraction of the size.
        {"is_diff_in": [False, True, True, True, True]})


def locate(axis: Axis, x: ca.MX) -> tuple[ca.MX, ca.MX]:
    """The cell of x, the outermost beyond the axis, and the coordinate in it."""
    u = (x - axis.start) / axis.step
    cell = ca.fmax(ca.fmin(ca.floor(u), axis.cells - 1), 0)
    return cell, u - cell


def clip(f: ca.MX) -> ca.MX:
    """f held to 0 ... 1, with slope 1 at both ends.

    A cell's coordinate is exactly 0 at every node, and the drawn clearance is one: there fmin and fmax would have
    half of the slope.
    """
    return ca.if_else(f < 0, 0, ca.if_else(f > 1, 1, f))


def _blend(values: Sequence[Any], band: ca.SX) -> ca.SX:
    mean, p10, p90 = values
    return mean + ca.fmax(band, 0) * (p90 - mean) + ca.fmax(-band, 0) * (p10 - mean)


def cache_folder() -> Path:
    """Folder of precomputed tables: $REEFMU_CACHE, else the user's cache folder."""
    if folder := os.environ.get("REEFMU_CACHE"):
        return Path(folder)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "reefmu"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "reefmu"


def cached_lookup(drive: Drive, n_drives: int = N_DRIVES, seed: int = 0, executor: Executor | None = None) -> Lookup:
    """The drawing's lookup, from the cache if it was built before by the same code, else built (some seconds).

    A cache that cannot be written is no error: the tables are then built anew every time.
    """
    return _cached(f"lookup-{fingerprint(drive, n_drives, seed)}.npz", Lookup.load,
                   lambda: build_lookup(drive, n_drives, seed, executor))


def cached_element_table(drive: Drive) -> ElementTable:
    """The drawing's table of one element, cached likewise (half a second)."""
    return _cached(f"element-{fingerprint(drive)}.npz", ElementTable.load, lambda: build_element_table(drive))


def _cached(name: str, load: Callable[[Path], Table], build: Callable[[], Table]) -> Table:
    path = cache_folder() / name
    with contextlib.suppress(InputError):  # missing, truncated or foreign: build it
        return load(path)
    table = build()
    with contextlib.suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        table.save(path)
    return table


def fingerprint(drive: Drive, n_drives: int = 0, seed: int = 0) -> str:
    """A name for what is computed from this drawing by this code: it changes with either."""
    drawing: dict[str, Any] = drive_to_dict(drive)
    text = json.dumps([drawing, n_drives, seed, np.lib.NumpyVersion(np.__version__).major], sort_keys=True)
    digest = hashlib.sha256(text.encode())
    for source in sorted(Path(stiffness_model.__file__).parent.rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:24]
