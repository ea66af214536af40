"""Known interventions on measured gears: what the comparison of states finds, against what physics expects.

    python -m tests.benchmarks.diagnosis.bench_interventions FOLDER [--columns MAP.toml] [--matched]

FOLDER holds a folder for each prototype with records MOMENT_posK.csv.gz, and perhaps preload_K.csv.gz beside them: the
prototype with moments preload1, preload2, ... at position 1 once more. The expectations apply to every prototype that
has both moments. docs/explanation/interventions.md states them with their reasons and when they were written.
"""

from __future__ import annotations

import argparse
import itertools
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reefmu.comparison import Change, DriveState, StateComparison, compare_states
from reefmu.comparison.comparison_text import estimate_text, probability_up_text
from reefmu.record import Columns, read_column_map, read_record

UP, DOWN, NOT_UP, NOT_DOWN, SAME = "up", "down", "not up", "not down", "unchanged"
EXPECTED: Mapping[tuple[str, str], Mapping[str, str]] = {
    ("runin", "preload5"): {"play": DOWN, "friction": UP, "stiffness_middle": NOT_DOWN},
    **{
        (a, b): {"play": NOT_UP, "friction": NOT_DOWN}
        for a, b in itertools.pairwise(["runin", *(f"preload{k}" for k in range(1, 6))])
    },
    ("init", "runin"): {"play": NOT_DOWN, "friction": DOWN},
    ("runin", "cold"): {"play": UP, "friction": NOT_DOWN, "stiffness_middle": NOT_DOWN},
    ("cold", "reamed"): {"play": UP, "friction": SAME, "stiffness_middle": SAME},
}
"""By the moments before and after; "not up" is a decrease that may lie within the spread of positions."""
ORDER = ("init", "runin", "cold", "reamed", *(f"preload{k}" for k in range(1, 10)))


@dataclass(frozen=True)
class Row:
    """One expectation and what was found."""

    prototype: str
    expected: str
    change: Change

    @property
    def result(self) -> str:
        """ "hit", "miss" where the opposite sign or an unexpected change is found, or "not decided" where a sign was
        expected and the interval contains zero."""
        found = self.change.direction
        if self.expected in (UP, DOWN):
            return "hit" if found == self.expected else "not decided" if found == "not decided" else "miss"
        wrong = {NOT_UP: (UP,), NOT_DOWN: (DOWN,), SAME: (UP, DOWN)}[self.expected]
        return "miss" if found in wrong else "hit"


def moments(folder: Path, columns: Columns) -> list[DriveState]:
    """The states of a prototype in the order in which they happened."""
    files: dict[str, list[Path]] = {}
    for path in sorted(folder.glob("*_pos*.csv*")):
        files.setdefault(path.name.split("_pos")[0], []).append(path)
    known = [name for name in ORDER if name in files] + sorted(set(files) - set(ORDER))
    return [DriveState(name, tuple(read_record(path, columns) for path in files[name])) for name in known]


def rows(prototype: str, found: StateComparison) -> Iterator[Row]:
    """The expectations that apply to a prototype."""
    for change in found.changes:
        expected = EXPECTED.get((change.start, change.end), {}).get(change.quantity)
        if expected is not None:
            yield Row(prototype, expected, change)


def positions_of_one_moment(states: Sequence[DriveState]) -> tuple[int, int]:
    """Pairs of positions of one moment whose difference excludes zero, and all such comparisons of play, friction and
    stiffness; the spread comes from the other moments.
    """
    wrong = total = 0
    for state in states:
        others = [other for other in states if other is not state and len(other.records) > 1]
        if len(others) < 2:
            continue
        known = compare_states(others).position_spread
        for pair in itertools.combinations(state.records, 2):
            single = [DriveState(f"position {k}", (record,)) for k, record in enumerate(pair)]
            for change in compare_states(single, known_spread=known).changes:
                total += 1
                wrong += change.direction != "not decided"
    return wrong, total


def repeats(folder: Path, prototypes: Mapping[str, Sequence[DriveState]], columns: Columns) -> list[str]:
    """preload_K against the same moment at position 1: once more, with the scatter of cycles alone."""
    lines: list[str] = []
    ringed = next((states for states in prototypes.values() if any(s.name == "preload1" for s in states)), None)
    if ringed is None:
        return lines
    first = {state.name: state.records[0] for state in ringed}
    for path in sorted(folder.glob("preload_*.csv*")):
        number = int(re.findall(r"preload_(\d+)", path.name)[0])
        moment = "runin" if number == 0 else f"preload{number}"
        again = DriveState("once more", (read_record(path, columns),))
        found = compare_states([DriveState("first", (first[moment],)), again])
        changed = [c.quantity for c in found.changes if c.direction != "not decided"]
        copy = "a copy of" if any("same samples" in note for note in found.notes) else "against"
        lines.append(f"{path.name}, {copy} {moment} at position 1: {', '.join(changed) or 'no change'}")
    return lines


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--columns", default="examples/cycloidal_columns.toml")
    parser.add_argument("--matched", action="store_true", help="position K is the same place in all moments")
    args = parser.parse_args(argv)
    columns = read_column_map(args.columns)
    prototypes = {
        path.name: states
        for path in sorted(args.folder.iterdir())
        if path.is_dir() and len(states := moments(path, columns)) >= 2
    }
    results: list[str] = []
    print("| prototype | from, to | quantity | expected | difference | probability of up | result |")
    print("|---|---|---|---|---|---|---|")
    for name, states in prototypes.items():
        found = compare_states(states, matched=args.matched)
        for row in rows(name, found):
            change = row.change
            cells = (
                name,
                f"{change.start}, {change.end}",
                change.quantity,
                row.expected,
                estimate_text(change.difference, signed=True),
                probability_up_text(change.probability_up),
                row.result,
            )
            print("| " + " | ".join(cells) + " |")
            results.append(row.result)
    print("\n" + ", ".join(f"{results.count(kind)} {kind}" for kind in ("hit", "not decided", "miss")))
    for name, states in prototypes.items():
        wrong, total = positions_of_one_moment(states)
        if total:
            print(f"{name}: {wrong} of {total} differences between positions of one moment exclude zero")
    print("\n".join(repeats(args.folder, prototypes, columns)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
