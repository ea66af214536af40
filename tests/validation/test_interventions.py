"""Known interventions on measured gears, whose records are not part of this repository.

docs/explanation/interventions.md has the table with its misses; a change of these figures belongs there.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from reefmu.comparison import DriveState, StateComparison, compare_states
from reefmu.record import Columns, read_column_map, read_record
from tests.benchmarks.diagnosis.bench_interventions import moments, positions_of_one_moment, rows

ROOT = Path(__file__).parents[2]
RECORDS = ROOT.parent / "shared/data/cycloidal"
PROTOTYPES = ("base_910", "base_onyx", "conic_onyx")


@pytest.fixture(scope="module")
def columns() -> Columns:
    return read_column_map(ROOT / "examples/cycloidal_columns.toml")


@pytest.fixture(scope="module")
def prototypes(columns: Columns) -> dict[str, list[DriveState]]:
    if not RECORDS.exists():
        pytest.skip(f"measured records, which are not part of this repository: none in {RECORDS}")
    return {name: moments(RECORDS / name, columns) for name in PROTOTYPES}


@pytest.fixture(scope="module")
def found(prototypes: dict[str, list[DriveState]]) -> dict[str, StateComparison]:
    return {name: compare_states(states) for name, states in prototypes.items()}


@pytest.mark.slow
def test_every_record_has_its_large_cycles(found: dict[str, StateComparison]) -> None:
    for comparison in found.values():
        assert all((state.positions, state.cycles) == (3, 9) for state in comparison.states)
        assert any("mostly stick" in note for note in comparison.notes)


@pytest.mark.slow
def test_preload_adds_friction_and_running_in_takes_it(found: dict[str, StateComparison]) -> None:
    friction = {(c.start, c.end): c for c in found["conic_onyx"].changes if c.quantity == "friction"}
    assert friction["runin", "preload5"].direction == "up"
    assert friction["init", "runin"].direction == "down"


@pytest.mark.slow
def test_the_table_of_interventions_has_two_misses(found: dict[str, StateComparison]) -> None:
    every = [row for name, comparison in found.items() for row in rows(name, comparison)]
    misses = {(row.prototype, row.change.start, row.change.quantity) for row in every if row.result == "miss"}
    assert misses == {("base_910", "init", "friction"), ("base_910", "runin", "play")}
    assert len(every) == 25


@pytest.mark.slow
def test_positions_of_one_moment_rarely_differ(prototypes: dict[str, list[DriveState]]) -> None:
    counts = [positions_of_one_moment(prototypes[name]) for name in ("base_910", "conic_onyx")]
    wrong, total = (sum(count[k] for count in counts) for k in (0, 1))
    assert total == 198
    assert wrong <= 0.08 * total


@pytest.mark.slow
def test_a_copy_shows_no_change(prototypes: dict[str, list[DriveState]], columns: Columns) -> None:
    first = {state.name: state.records[0] for state in prototypes["conic_onyx"]}
    for number in range(6):
        moment = f"preload{number}" if number else "runin"
        again = read_record(RECORDS / f"preload_{number}.csv.gz", columns)
        comparison = compare_states([DriveState("first", (first[moment],)), DriveState("again", (again,))])
        assert any("same samples" in note for note in comparison.notes)
        assert all(change.direction == "not decided" for change in comparison.changes)
