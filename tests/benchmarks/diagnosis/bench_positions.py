"""Positions of one gear as replicates: how often the 95 % intervals of its effects overlap between them.

    python -m tests.benchmarks.diagnosis.bench_positions FOLDER [--columns MAP.toml] [--drive DRIVE]

FOLDER holds a folder for each prototype with records MOMENT_posK.csv.gz, of a rig that locks the output; the records of
one moment are of one gear at several of its angles. Without a drive every record gets a power law of its own.
Independent estimates with exact 95 % intervals of equal width overlap in 99.4 % of the pairs.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from reefmu.diagnosis import Diagnosis, diagnose_record
from reefmu.record import Columns, read_column_map
from tests.benchmarks.diagnosis.bench_interventions import moments


def diagnosed(folder: Path, columns: Columns, drive: str | None) -> Iterator[list[Diagnosis]]:
    """The diagnoses of the positions of every moment."""
    for prototype in sorted(path for path in folder.iterdir() if path.is_dir()):
        for state in moments(prototype, columns):
            print(f"{prototype.name} {state.name}", file=sys.stderr)
            yield [diagnose_record(record, drive, output_locked=True) for record in state.records]


def overlaps(first: Diagnosis, second: Diagnosis) -> Iterator[tuple[str, bool]]:
    """By parameter of the effects that both name, whether its intervals overlap."""
    others = {effect.name: effect.parameters for effect in second.effects}
    for effect in first.effects:
        for name, value in effect.parameters.items() if effect.name in others else ():
            other = others[effect.name][name]
            yield f"{effect.name}.{name}", value.low <= other.high and other.low <= value.high


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the share of overlapping intervals by parameter, and of all together."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--columns", default="examples/cycloidal_columns.toml")
    parser.add_argument("--drive")
    options = parser.parse_args(arguments)
    found: dict[str, list[bool]] = {}
    for positions in diagnosed(options.folder, read_column_map(options.columns), options.drive):
        for pair in itertools.combinations(positions, 2):
            for name, overlap in overlaps(*pair):
                found.setdefault(name, []).append(overlap)
    for name, pairs in (*sorted(found.items()), ("all", list(itertools.chain(*found.values())))):
        print(f"{name:38s} {sum(pairs):3d} of {len(pairs)}")


if __name__ == "__main__":
    main()
