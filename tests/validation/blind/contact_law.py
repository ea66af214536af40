"""The contacts of a simulated drive: torque over twist for every sample of a test, and its inverse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .elements import Array, Individual, individual_torque
from .tables import MODULI, Tables

REST = 0.5
"""Stiffness of the rig in parallel with the drive, over full torque per full twist. As in a real loading device, it
moves the twist through the drive's play at a finite speed. Chosen by judgement."""

NODES = 12
"""Nodes of an individual's rotation over the distance of two elements: several within the edge of the profile, where
elements enter and leave."""


@dataclass(frozen=True)
class ContactLaw:
    """Torque tables of one simulated drive, over contact twist and clearance, and over the rotation of an individual.

    torque: (n_turn or 1, nx, nc) N.m; less: (n_beta, nx, nc) N.m, of a missing element, or None; less_start: its
    position on the profile at crank angle 0, rad; turns: (n_turn,) numbers of the nodes of the rotation,
    ascending, None of the mean drive.
    """

    tables: Tables
    torque: Array
    clearance: Array
    less: Array | None = None
    less_start: float = 0.0
    turns: NDArray[np.intp] | None = None

    def rows(self, clearance: Array, crank: Array) -> Array:
        """Torque over `tables.x` for every sample, (n, nx); crank: rad, clearance: m."""
        turn = turn_past_cage(self.tables, crank[:, None], self.tables.x)
        if self.turns is None:
            rows = _along_clearance(self.clearance, self.torque, np.zeros(turn.shape, int), clearance)
        else:
            low, high, part = _turn_nodes(self.tables, turn)
            lower, upper = (np.searchsorted(self.turns, number) for number in (low, high))
            rows = (1 - part) * _along_clearance(self.clearance, self.torque, lower, clearance)
            rows += part * _along_clearance(self.clearance, self.torque, upper, clearance)
        if self.less is not None:
            rows -= self._missing(turn, clearance)
        return rows

    def _missing(self, turn: Array, clearance: Array) -> Array:
        assert self.less is not None
        grid = self.tables.beta
        beta = (self.less_start + turn + np.pi) % (2 * np.pi) - np.pi
        place = (beta - grid[0]) / (grid[1] - grid[0])
        inside = (place >= 0) & (place <= len(grid) - 1)
        lower = np.clip(np.floor(place).astype(int), 0, len(grid) - 2)
        part = np.clip(place - lower, 0, 1)
        coarse = np.linspace(self.tables.c[0], self.tables.c[-1], self.less.shape[2])
        low, high = (_along_clearance(coarse, self.less, lower + k, clearance) for k in (0, 1))
        return inside * ((1 - part) * low + part * high)


def turn_past_cage(tables: Tables, crank: Array, twist: Array) -> Array:
    """Rotation past the cage, rad, of the crank without load, from which the crank is twisted: it turns with the
    output, and the cage by the ratio less. The twist is that of the contacts."""
    ratio = tables.drive.ratio
    return (ratio - 1) * (crank / ratio - twist)


def mean_law(tables: Tables, modulus: float = 1.0, missing: float | None = None) -> ContactLaw:
    """The mean drive, with a modulus of gear and cage of `modulus` times that of the drawing, and without the ball
    whose position on the profile at crank angle 0 is `missing`, rad.
    """
    torque = tables.mean + _modulus_part(tables, modulus)
    less = None if missing is None else tables.element
    return ContactLaw(tables, torque[None], tables.c, less, missing or 0.0)


def individual_law(
    tables: Tables, one: Individual, crank: Array, clearance: Array, modulus: float = 1.0, missing: float | None = None
) -> ContactLaw:
    """One individual, solved for the angles of the crank (n,), rad, and over the range of the clearances (n,), m, of a
    test; `modulus` and `missing` as in `mean_law`."""
    drive, low, high = tables.drive, clearance.min(), clearance.max()
    nodes = np.array([low]) if high - low < 1e-9 else np.linspace(low, high, 4)
    numbers = np.unique(_turn_nodes(tables, turn_past_cage(tables, crank[:, None], tables.x))[:2])
    turn = numbers * 2 * np.pi / (NODES * drive.elements)
    few = tables.x[::2]  # the number of nodes is odd, so that both ends are included
    gone = None if missing is None else int(np.argmin(np.abs(_wrapped(one.start - missing))))
    torque = np.stack([_finer(few, individual_torque(drive, one, turn, few, c, gone), tables.x) for c in nodes], -1)
    if modulus != 1.0:
        torque = torque + _at(tables.c, _modulus_part(tables, modulus), nodes)
    return ContactLaw(tables, torque, nodes, turns=numbers)


def torque_at(x: Array, rows: Array, twist: Array) -> Array:
    """Torque at one twist per row, by a cubic through the four surrounding nodes; linear beyond the ends."""
    step = x[1] - x[0]
    place = (twist - x[0]) / step
    cell = np.clip(np.floor(place).astype(int), 1, len(x) - 3)
    part = np.clip(place - cell, -1, 2)
    beyond = (place - cell - part) * step
    rows = np.broadcast_to(rows, (len(twist), len(x)))
    a, b, c, d = (rows[np.arange(len(twist)), cell + k] for k in (-1, 0, 1, 2))
    slope_1, slope_2 = (c - a) / 2, (d - b) / 2
    inside = np.clip(part, 0, 1)
    bent = (3 * (c - b) - 2 * slope_1 - slope_2) + inside * (2 * (b - c) + slope_1 + slope_2)
    value = b + inside * (slope_1 + inside * bent)
    outside = np.where(part > 1, (part - 1) * slope_2, np.where(part < 0, part * slope_1, 0.0))
    return value + outside + beyond * np.where(part > 1, d - c, b - a) / step


def rest(tables: Tables, rows: Array, command: Array) -> tuple[Array, Array]:
    """Contact twist, rad, and torque, N.m, at which drive and rig are in equilibrium under `command` (1: full load)."""
    x, spring = tables.x, REST * tables.full_torque / tables.full_twist
    rows = np.broadcast_to(rows, (len(command), len(x)))
    wanted = command * (1 + REST) * tables.full_torque
    cell = np.clip((rows + spring * x < wanted[:, None]).sum(axis=1) - 1, 1, len(x) - 3)
    low, high = x[cell], x[cell + 1]
    for _ in range(40):
        middle = (low + high) / 2
        below = torque_at(x, rows, middle) + spring * middle < wanted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low, wanted - spring * low


def mean_torque_at(tables: Tables, twist: Array) -> Array:
    """Torque, N.m, of the mean drive of the drawing, from which a diagnosis starts."""
    return torque_at(tables.x, tables.mean[None, :, len(tables.c) // 2], twist)


def _turn_nodes(tables: Tables, turn: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Numbers of the nodes of an individual's rotation before and after some rotations, rad, and the part of the way
    between them, arrays alike. Where the elements have met all lobes the nodes start anew."""
    count = NODES * tables.drive.elements
    place = turn * count / (2 * np.pi)
    below = np.floor(place).astype(np.intp)
    rounds = count * tables.drive.lobes
    return below % rounds, (below + 1) % rounds, place - below


def _modulus_part(tables: Tables, modulus: float) -> Array:
    """Change of the torque by the modulus, (nx, nc), N.m: a polynomial in its logarithm through the tables."""
    nodes, at = np.log(np.append(MODULI, 1.0)), np.log(modulus)
    weights = [np.prod([(at - b) / (a - b) for b in nodes if b != a]) for a in nodes[:-1]]
    return np.einsum("k,kxc->xc", weights, tables.softer)


def _along_clearance(nodes: Array, table: Array, row: Array, clearance: Array) -> Array:
    """Values (n, nx) of a table (rows, nx, nc) at the rows (n, nx) and the clearances (n,), by a cubic through the four
    surrounding nodes."""
    column = np.arange(table.shape[1])
    if len(nodes) == 1:
        return np.array(table[row, column, 0])
    if np.ptp(clearance) == 0:
        return np.take_along_axis(_at(nodes, table, clearance[:1])[..., 0], row, axis=0)
    place = np.clip((clearance - nodes[0]) / (nodes[1] - nodes[0]), 0, len(nodes) - 1)
    cell = np.clip(np.floor(place).astype(int) - 1, 0, len(nodes) - 4)
    weights = _cubic_weights(place - cell)
    return sum(w[:, None] * table[row, column, cell[:, None] + k] for k, w in enumerate(weights))


def _at(nodes: Array, table: Array, clearance: Array) -> Array:
    """table (..., nc) at some clearances, (..., len(clearance))."""
    place = np.clip((clearance - nodes[0]) / (nodes[1] - nodes[0]), 0, len(nodes) - 1)
    cell = np.clip(np.floor(place).astype(int) - 1, 0, len(nodes) - 4)
    return sum(w * table[..., cell + k] for k, w in enumerate(_cubic_weights(place - cell)))


def _cubic_weights(u: Array) -> tuple[Array, Array, Array, Array]:
    """Lagrange weights of four nodes 0, 1, 2, 3 at u."""
    return (
        -(u - 1) * (u - 2) * (u - 3) / 6,
        u * (u - 2) * (u - 3) / 2,
        -u * (u - 1) * (u - 3) / 2,
        u * (u - 1) * (u - 2) / 6,
    )


def _finer(few: Array, values: Array, x: Array) -> Array:
    return CubicSpline(few, values, axis=1)(x)


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2 * np.pi) - np.pi
