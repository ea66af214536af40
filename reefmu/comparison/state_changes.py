"""Differences between states of a drive, with intervals that count what repeats of one state differ by."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from stiffness_model.errors import expect
from stiffness_model.numerics.arrays import Array

from .drive_states import DriveState, Position, common_load, state_positions
from .loop_quantities import CRANK_QUANTITIES, QUANTITIES, STIFFNESS_LOADS
from .position_scatter import Basis, KnownSpread, ScatterPosterior, state_means

SCHEMA = 1
"""Version of the keys of `StateComparison.to_dict`."""
INTERVAL = (0.025, 0.975)
"""Quantiles of the intervals."""
DECIDED = 0.975
"""Probability of a sign from which it is stated: then the interval excludes zero."""


@dataclass(frozen=True)
class Estimate:
    """Posterior median with the ends of the 95 % interval, all in `unit`."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Change:
    """start, end: names of the states; difference: end minus start; probability_up: that it is positive."""

    start: str
    end: str
    quantity: str
    difference: Estimate
    probability_up: float

    @property
    def direction(self) -> str:
        """ "up", "down", or "not decided" where the interval contains zero."""
        if self.probability_up >= DECIDED:
            return "up"
        return "down" if self.probability_up <= 1 - DECIDED else "not decided"


@dataclass(frozen=True)
class StateSummary:
    """records: sources of the positions; positions, cycles: numbers that count; values: by quantity."""

    name: str
    records: tuple[str, ...]
    positions: int
    cycles: int
    values: Mapping[str, Estimate]


@dataclass(frozen=True)
class StateComparison:
    """The result. load: N.m, that all cycles reach; basis: by quantity, what its intervals rest on; position_spread,
    cycle_spread: by quantity, standard deviations between positions of one state and between cycles at one position;
    matched: whether position k is the same in all states; notes: what a reader must know."""

    states: tuple[StateSummary, ...]
    changes: tuple[Change, ...]
    load: float
    basis: Mapping[str, Basis]
    position_spread: Mapping[str, KnownSpread]
    cycle_spread: Mapping[str, KnownSpread]
    matched: bool
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """All fields for JSON, in SI units."""
        changes = [
            {
                "from": change.start,
                "to": change.end,
                "quantity": change.quantity,
                "difference": asdict(change.difference),
                "probability_up": change.probability_up,
                "direction": change.direction,
                "counts_positions": self.basis[change.quantity] != "cycles",
            }
            for change in self.changes
        ]
        return {
            "schema": SCHEMA,
            "changes": changes,
            "states": [asdict(state) for state in self.states],
            "common_load": {"value": self.load, "unit": "N.m"},
            "stiffness_loads": {name: share * self.load for name, share in STIFFNESS_LOADS.items()},
            "basis": dict(self.basis),
            "matched_positions": self.matched,
            "position_spread": {name: asdict(spread) for name, spread in self.position_spread.items()},
            "cycle_spread": {name: asdict(spread) for name, spread in self.cycle_spread.items()},
            "notes": list(self.notes),
        }


def compare_states(
    states: Sequence[DriveState],
    ratio: float | None = None,
    known_spread: Mapping[str, KnownSpread] | None = None,
    matched: bool = False,
) -> StateComparison:
    """What changed between states of one drive, for every pair of states in the order given.

    ratio: signed, crank to output, for records with a crank angle. known_spread: by quantity, the standard deviation
    between positions in its unit, from other records of the drive or its series. matched: the k-th position is the
    same in all states. Raises `InputError` for fewer than two states, names that repeat, torques that were measured at
    different sides, and records without cycles that count.
    """
    names = [state.name for state in states]
    expect(len(states) >= 2, "at least two states to compare", ", ".join(names) or "none", "compare")
    expect(len(set(names)) == len(names), "states with different names", ", ".join(names), "compare")
    sides = {record.torque_side for state in states for record in state.records}
    expect(len(sides) == 1, "torques measured at one side in all records", " and ".join(sorted(sides)), "compare")
    same = _same_samples(states)
    positions = {state.name: state_positions(state, ratio) for state in states}
    numbers = {name: len(found) for name, found in positions.items()}
    equal = len(set(numbers.values())) == 1
    expect(equal or not matched, "matched positions: as many in every state", numbers, "compare")
    load = common_load([one for found in positions.values() for one in found])
    values = {name: [one.values(load) for one in found] for name, found in positions.items()}
    posteriors = {
        quantity: state_means(table, (known_spread or {}).get(quantity), matched)
        for quantity in QUANTITIES
        if (table := _table(values, quantity, matched)) is not None
    }
    found = {quantity: posterior for quantity, posterior in posteriors.items() if posterior is not None}
    expect(bool(found), "two positions of a state or two cycles of every record", "nothing that repeats", "compare")
    return StateComparison(
        tuple(_summary(k, name, positions[name], found) for k, name in enumerate(names)),
        tuple(
            _change(names, pair, quantity, posterior.draws)
            for pair in itertools.combinations(range(len(names)), 2)
            for quantity, posterior in found.items()
        ),
        load,
        {quantity: posterior.basis for quantity, posterior in found.items()},
        {q: p.spread for q, p in found.items() if p.spread is not None},
        {q: p.cycle_spread for q, p in found.items() if p.cycle_spread is not None},
        matched,
        (*same, *_notes(positions, found, sides == {"motor"})),
    )


def _same_samples(states: Sequence[DriveState]) -> list[str]:
    """Notes on records of two states that hold the same samples.

    Raises `InputError` for two of one state: copies would count as positions without scatter.
    """
    notes: list[str] = []
    every = [(state.name, record) for state in states for record in state.records]
    for (name, record), (other_name, other) in itertools.combinations(every, 2):
        if np.array_equal(record.output_torque, other.output_torque) and np.array_equal(record.time, other.time):
            pair = f"{record.source} and {other.source}"
            expect(name != other_name, "different measurements at the positions of a state", f"copies: {pair}", name)
            notes.append(f"{pair} hold the same samples: they are one measurement, and no repeat")
    return notes


def _table(
    values: Mapping[str, Sequence[Mapping[str, Array]]], quantity: str, matched: bool
) -> list[list[Array]] | None:
    """Values of the cycles by state and position, without positions that do not show the quantity; None where a state
    has none. Matched positions are left out in all states.
    """
    table = [[one[quantity] for one in found] for found in values.values()]
    if matched:
        shown = [k for k in range(len(table[0])) if all(len(state[k]) for state in table)]
        table = [[state[k] for k in shown] for state in table]
    else:
        table = [[cycles for cycles in state if len(cycles)] for state in table]
    return table if all(table) else None


def _estimate(draws: Array, quantity: str) -> Estimate:
    low, value, high = np.quantile(draws, [INTERVAL[0], 0.5, INTERVAL[1]]).tolist()
    return Estimate(value, low, high, QUANTITIES[quantity])


def _change(names: Sequence[str], pair: tuple[int, int], quantity: str, draws: Array) -> Change:
    difference = draws[:, pair[1]] - draws[:, pair[0]]
    probability = float((difference > 0).mean() + (difference == 0).mean() / 2)
    return Change(names[pair[0]], names[pair[1]], quantity, _estimate(difference, quantity), probability)


def _summary(k: int, name: str, positions: Sequence[Position], found: Mapping[str, ScatterPosterior]) -> StateSummary:
    return StateSummary(
        name,
        tuple(dict.fromkeys(one.source for one in positions)),
        len(positions),
        sum(len(one.loops) for one in positions),
        {quantity: _estimate(posterior.draws[:, k], quantity) for quantity, posterior in found.items()},
    )


def _notes(
    positions: Mapping[str, Sequence[Position]], found: Mapping[str, ScatterPosterior], motor: bool
) -> list[str]:
    """What a reader must know: what the intervals leave out, cycles that do not count, and what the torque contains."""
    notes: list[str] = []
    if any(posterior.basis == "cycles" for posterior in found.values()):
        notes.append(
            "every state was measured at one position: the intervals count the scatter of cycles only, and cannot "
            "count what positions of one state differ by; a difference may be that of the positions. Measure each "
            "state at several positions (NAME=FILE,FILE), or state the spread of an earlier comparison (--spread-from)"
        )
    every = [one for state in positions.values() for one in state]
    shows_crank = any(loop.crank_width is not None for one in every for loop in one.loops)
    expected = [name for name in QUANTITIES if shows_crank or name not in CRANK_QUANTITIES]
    if absent := [name for name in expected if name not in found]:
        notes.append(f"not in every record, or without repeats: {', '.join(absent)}")
    if sticking := sum(one.sticking for one in every):
        size = max(one.largest_sticking for one in every)
        low, high = (f(one.friction for one in every) for f in (min, max))
        notes.append(
            f"{sticking} cycles of up to {size:.3g} N.m left out: their torque does not exceed twice the friction at "
            f"small load ({low:.2g} to {high:.2g} N.m), so that they mostly stick"
        )
    if small := sum(one.small for one in every):
        notes.append(f"{small} cycles left out: smaller than half the largest of their record")
    if motor:
        notes.append("the torque is the motor's: friction is that of motor, crank and drive together")
    return notes
