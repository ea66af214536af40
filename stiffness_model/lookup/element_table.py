"""Torque of one element, averaged over the tolerances: a table over twist, gear clearance and position.

With rigid bearings and a rigid housing the elements do not affect each other, so a drive in which one element carries
nothing lacks just this torque. With a soft crank bearing or housing the other elements take over a part of it (half, in
drive 1 at 250 N/um), and the table holds the net loss.

The position is the angle beta of the eccentric past the element (paper, section III): at beta > 0 the element carries
positive twists, at beta < 0 negative ones, torque(-twist, -beta) = -torque(twist, beta), and beyond the limit, where
the profile is cut away, it carries nothing.
"""

from __future__ import annotations

import json
import os
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import qmc

from ..contact.element_contacts import build_contacts
from ..contact.usable_elements import is_usable, usable_elements
from ..display import one_line
from ..drawing.drive import Drive
from ..drawing.sampling import Deviations, quasi_random_drives
from ..drawing.twist_limits import clearance_reach, half_closed_clearance
from ..equilibrium.closed_form import solve
from ..errors import expect, expect_number
from ..geometry.ball_path import wrap
from ..io.atomic_files import atomic_file
from ..numerics.arrays import Array
from ..numerics.bspline import Axis, fit, locate, slope_weights, weights
from .table_files import expect_table, load_tables, parse_axis, require_keys

N_SAMPLES = 256
"""Elements per mean, evenly spread over the tolerances of the four parts; the mean is then right to 4e-4 of its value.
"""
N_DRIVES = 8
"""Drives per mean where a bearing or the housing couples the elements; the mean is then right to some 0.5 % of its
value. As other elements pass the limit, the mean jumps with the position; the spline smooths the jumps, and `error`
includes the difference.
"""
FADE_HALF_WIDTH = 0.01
"""Half the width, rad, over which the torque fades out at the limit, where a step would have no derivative; chosen by
judgement, far below the elements' spacing.
"""
_CELLS = (40, 12, 12)
"""Cells of twist, of the clearance as far as max_twist closes half of it, and of the position from 0 to the limit;
`error` states what they leave."""
_PARTS = ("element", "crank", "cage", "gear")


@dataclass(frozen=True)
class ElementTable:
    """Cubic B-splines over twist (rad at the output), gear clearance (m) and position (rad, 0 to limit).

    coefficients: (twist.size, clearance.size, position.size). error: maximum error at the cells' midpoints within the
    drawing's max_twist, as a share of the drive's torque there.
    """

    twist: Axis
    clearance: Axis
    position: Axis
    limit: float
    coefficients: Array
    error: float

    def __repr__(self) -> str:
        return one_line(self)

    @staticmethod
    def from_header(header: Any, coefficients: Array, where: str) -> ElementTable:
        """The table of a header (`header`) and its coefficients. Raises `InputError` for unsuitable ones."""
        axes = require_keys(header, ("axes", "limit", "error"), where)["axes"]
        expect(isinstance(axes, (list, tuple)) and len(axes) == 3, "three axes", axes, where)
        twist, clearance, position = (parse_axis(axis, where) for axis in axes)
        return ElementTable(
            twist,
            clearance,
            position,
            expect_number(header["limit"], "a limit of 0 ... pi", where, low=0.0, high=4.0),
            expect_table(coefficients, (twist.size, clearance.size, position.size), where),
            expect_number(header["error"], "a finite error", where),
        )

    def header(self) -> dict[str, Any]:
        """Everything but the coefficients, for a file; `from_header` reads it."""
        return {
            "axes": [astuple(a) for a in (self.twist, self.clearance, self.position)],
            "limit": self.limit,
            "error": self.error,
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write one .npz file, atomically."""
        with atomic_file(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, head=np.array(json.dumps(self.header())), coefficients=self.coefficients)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> ElementTable:
        """Read a file written by `save`. Raises `InputError` for any other file."""
        header, tables = load_tables(path, "a saved element table")
        return ElementTable.from_header(
            header, require_keys(tables, ("coefficients",), str(path))["coefficients"], str(path)
        )

    def torque(self, twist: ArrayLike, clearance: ArrayLike, position: ArrayLike) -> Array:
        """The element's torque, N.m; twist (rad), clearance (m) and position (rad) broadcast.

        Beyond the twist's range the torque is extrapolated linearly; the clearance is limited to its range.
        """
        return self.evaluate(twist, clearance, position)[0]

    def evaluate(
        self, twist: ArrayLike, clearance: ArrayLike, position: ArrayLike
    ) -> tuple[Array, Array, Array, Array]:
        """Torque, N.m, and its derivatives with respect to twist (N.m/rad), clearance (N) and position (N.m/rad)."""
        t, c, beta = np.broadcast_arrays(*(np.asarray(v, float) for v in (twist, clearance, position)))
        beta = beta - 2 * np.pi * np.floor(beta / (2 * np.pi) + 0.5)
        side = np.where(beta < 0, -1.0, 1.0)
        at = (side * t, c, np.minimum(np.abs(beta), self.limit + FADE_HALF_WIDTH))
        axes = (self.twist, self.clearance, self.position)
        starts, bases, slopes = [], [], []
        for axis, value, goes_on in zip(axes, at, (True, False, True), strict=True):
            cell, f = locate(axis, value)
            inside = np.clip(f, 0.0, 1.0)
            starts.append(cell)
            bases.append(np.stack(weights(f if goes_on else inside, inside)))
            slopes.append(np.stack(slope_weights(inside)) / axis.step * (goes_on | (f == inside)))
        size = self.coefficients.shape
        first = (starts[0] * size[1] + starts[1]) * size[2] + starts[2]
        corner = [(a * size[1] + b) * size[2] + d for a in range(4) for b in range(4) for d in range(4)]
        cells = np.stack([self.coefficients.ravel()[first + k] for k in corner]).reshape(4, 4, 4, *t.shape)
        value, by_twist, by_clearance, by_position = (
            np.einsum("abd...,a...,b...,d...->...", cells, *(slopes[k] if k == m else bases[k] for k in range(3)))
            for m in (-1, 0, 1, 2)
        )
        fade = (self.limit - np.abs(beta)) / (2 * FADE_HALF_WIDTH) + 0.5
        left = np.clip(fade, 0.0, 1.0)
        falls = np.where((fade > 0) & (fade < 1), -1 / (2 * FADE_HALF_WIDTH), 0.0)
        return side * left * value, left * by_twist, side * left * by_clearance, left * by_position + falls * value


def build_element_table(drive: Drive) -> ElementTable:
    """Solve one element of the drawing over the same ranges of twist and clearance as the lookup; about a second.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> table = build_element_table(load_drive("drive_1"))
    >>> ahead, behind = table.torque(6 * ARCMIN, 0.0, [1.2, -1.2])
    >>> bool(ahead > 10), bool(abs(behind) < 0.01), table.error < 3e-4
    (True, True, True)
    """
    cells_twist, cells_clearance, cells_position = _CELLS
    limit = drive.usable_limit
    widest = clearance_reach(drive)
    cells_clearance = 2 * int(np.ceil(cells_clearance / 2 * (widest / half_closed_clearance(drive))))
    step = limit / cells_position
    # One more cell at both ends of the position, since a spline is less accurate in its last cells.
    axes = (
        Axis(-2 * drive.max_twist, 4 * drive.max_twist / cells_twist, cells_twist),
        Axis(-widest, 2 * widest / cells_clearance, cells_clearance),
        Axis(-step, step, cells_position + 2),
    )
    coefficients = _mean_torques(drive, *(axis.nodes for axis in axes))
    for dimension, axis in enumerate(axes):
        coefficients = fit(axis, coefficients, dimension)
    table = ElementTable(*axes, limit, coefficients, 0.0)
    return replace(table, error=_measured_error(drive, table))


def _mean_torques(drive: Drive, twist: Array, clearance: Array, position: Array) -> Array:
    """Mean torque, (n_twist, n_clearance, n_position), N.m."""
    if drive.beyond.couples_elements:
        return _torque_loss(drive, twist, clearance, position)
    shape = (len(position), N_SAMPLES)
    # Shifted by half a step, the points of the sequence lie in the middles of their intervals.
    points = qmc.Sobol(len(_PARTS), scramble=False).random(N_SAMPLES) + 0.5 / N_SAMPLES
    normal = ndtri(points)
    nominal = dict.fromkeys(_PARTS, drive.element_radius) | {"crank": drive.crank_radius}
    radius = {}
    for column, part in enumerate(_PARTS):
        tolerance = drive.tolerances[part]
        radius[part] = np.broadcast_to(nominal[part] + tolerance.offset + tolerance.sigma * normal[:, column], shape)
    deviations = Deviations(np.broadcast_to(position[:, None], shape), **radius)
    means = np.empty((len(twist), len(clearance), len(position)))
    for k, shift in enumerate(clearance):
        contacts = build_contacts(drive, deviations, float(shift))
        for row, angle in enumerate(twist):
            means[row, k] = solve(contacts, angle * drive.ratio).output_torque.reshape(shape).mean(axis=1)
    return means


def _torque_loss(drive: Drive, twist: Array, clearance: Array, position: Array) -> Array:
    """Mean torque that whole drives lose without the element at `position`, shaped like `_mean_torques`: where the
    bodies yield, the other elements take over a part of its load.
    """
    parts = quasi_random_drives(drive, N_DRIVES)
    shape = (len(position), N_DRIVES, drive.elements)
    beta = wrap(position[:, None, None] + 2 * np.pi / drive.elements * np.arange(drive.elements))
    rows = {
        "beta": np.broadcast_to(beta, shape),
        **{part: np.broadcast_to(getattr(parts, part), shape) for part in _PARTS},
    }
    deviations = Deviations(**{name: values.reshape(-1, drive.elements) for name, values in rows.items()})
    keep = is_usable(drive, deviations.beta)
    keep[:, 0] = True  # the removed element, even where the profile is cut away
    drives = np.nonzero(keep)[0]
    others = np.nonzero(keep)[1] > 0
    lost = np.empty((len(twist), len(clearance), len(position)))
    for k, shift in enumerate(clearance):
        contacts = usable_elements(drive, deviations, float(shift), keep).contacts
        whole, without = (
            np.stack([np.bincount(owner, row, len(keep)) for row in solve(some, twist * drive.ratio).output_torque])
            for some, owner in ((contacts, drives), (contacts[others], drives[others]))
        )
        lost[:, k] = (whole - without).reshape(len(twist), *shape[:2]).mean(axis=2)
    return lost


def _measured_error(drive: Drive, table: ElementTable) -> float:
    middles = [axis.nodes[:-1] + axis.step / 2 for axis in (table.twist, table.clearance, table.position)]
    twist = middles[0][np.abs(middles[0]) < drive.max_twist][::2]
    clearance = middles[1][[1, len(middles[1]) // 2, -2]]
    position = middles[2][1:-1]
    solved = _mean_torques(drive, twist, clearance, position)
    found = table.torque(twist[:, None, None], clearance[:, None], position)
    around = np.linspace(-np.pi, np.pi, 721)[:-1]
    whole = drive.elements * table.torque(drive.max_twist, 0.0, around).mean()
    return float(np.abs(found - solved).max() / whole)
