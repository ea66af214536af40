"""States of a drive, each with records at one or several positions, and their cycles that count.

Cycles whose torque hardly exceeds the friction stick for most of their time: their loop shows neither play nor
stiffness, and its width is no friction of a moving drive. They are left out, as are cycles far smaller than the largest
ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.errors import InputError, expect
from stiffness_model.numerics.arrays import Array

from ..record import Record
from ..record.torque_cycles import CRANK_TOLERANCE
from .loop_quantities import QUANTITIES, loop_quantities
from .torque_loops import TorqueLoop, torque_loops

STICKS = 2.0
"""Amplitude of the torque over the friction at small load, below which a cycle mostly sticks: less than the friction
itself is left for the load. Chosen by judgement."""
LARGE = 0.5
"""Share of a record's greatest amplitude from which a cycle counts. Chosen by judgement: cycles of other sizes stop at
other loads, and would reduce the load that all of them reach."""
ONE_SIDED = 0.25
"""Share of a loop's reach in one direction, below which the other direction counts as not loaded. Chosen by
judgement."""


@dataclass(frozen=True, eq=False)
class DriveState:
    """A state of a drive. records: one for each position, without repeats."""

    name: str
    records: tuple[Record, ...]


@dataclass(frozen=True)
class Position:
    """Cycles of a state at one position.

    source: of the record; loops: cycles that count; small, sticking: number of cycles left out because they are smaller
    than half the largest one, or hardly exceed the friction; largest_sticking: N.m, greatest amplitude of these;
    friction: N.m, at small load.
    """

    source: str
    loops: tuple[TorqueLoop, ...]
    small: int
    sticking: int
    largest_sticking: float
    friction: float

    def values(self, load: float) -> Mapping[str, Array]:
        """The quantities (cycles,) of this position, without those that a cycle does not show; load: N.m."""
        found = [loop_quantities(loop, load) for loop in self.loops]
        values = {name: np.array([one[name] for one in found]) for name in QUANTITIES}
        return {name: value[np.isfinite(value)] for name, value in values.items()}


def state_positions(state: DriveState, ratio: float | None) -> tuple[Position, ...]:
    """The positions of a state; a record whose cycles turn about several crank angles has several.

    ratio: signed, crank to output. Raises `InputError` for a record without a cycle that counts.
    """
    return tuple(position for record in state.records for position in _positions(record, ratio))


def common_load(positions: Sequence[Position]) -> float:
    """N.m, load that the positions' cycles reach, in the median of each, in every direction that they load."""
    return min(float(np.median([_reach(loop) for loop in position.loops])) for position in positions)


def _reach(loop: TorqueLoop) -> float:
    """N.m, load that a loop reaches in all directions that it loads."""
    return min(reach for reach in loop.reach if reach >= ONE_SIDED * max(loop.reach))


def _positions(record: Record, ratio: float | None) -> list[Position]:
    where = record.source or "record"
    loops, stuck = torque_loops(record, ratio)
    expect(
        bool(loops) or stuck > 0,
        "at least one full cycle of the torque, up and down again",
        "none; a run that ends before its torque returns is no full cycle",
        where,
    )
    largest = max((loop.amplitude for loop in loops), default=0.0)
    large = [loop for loop in loops if loop.amplitude >= LARGE * largest]
    friction = float(np.median([loop.friction_at_small_load for loop in large])) if large else float("nan")
    used = [loop for loop in large if loop.amplitude > STICKS * friction]
    if not used:
        raise InputError(
            f"{where}: expected cycles of more than {STICKS:.3g} times the friction, got cycles of up to "
            f"{largest:.3g} N.m at a friction of {friction:.3g} N.m; the twist sticks, a larger torque is needed"
        )
    rest = [loop for loop in loops if loop not in used]
    sticking = [loop for loop in rest if loop.amplitude <= STICKS * friction]
    found: list[Position] = []
    for group in _by_crank_angle(record, used):
        first = not found
        found.append(
            Position(
                where,
                tuple(group),
                (len(rest) - len(sticking)) * first,
                (len(sticking) + stuck) * first,
                max((loop.amplitude for loop in sticking), default=0.0),
                friction,
            )
        )
    return found


def _by_crank_angle(record: Record, loops: Sequence[TorqueLoop]) -> list[list[TorqueLoop]]:
    """Loops of each crank angle; all together where the crank angle was not measured or turns within a cycle."""
    if "crank_angle" in record.missing:
        return [list(loops)]
    turned = max(float(np.ptp(record.crank_angle[record.run == loop.run])) for loop in loops)
    tolerance = max(CRANK_TOLERANCE, turned)
    groups: list[list[TorqueLoop]] = []
    for loop in loops:
        near = next((group for group in groups if abs(group[0].crank - loop.crank) <= tolerance), None)
        if near is None:
            groups.append([loop])
        else:
            near.append(loop)
    return groups
