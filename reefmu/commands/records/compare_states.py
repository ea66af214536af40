"""`reefmu diagnose --compare`: what changed between states of one drive."""

from __future__ import annotations

import argparse
import glob
from collections.abc import Sequence
from pathlib import Path

from reefmu.comparison import DriveState, compare_states, comparison_text, write_comparison
from reefmu.comparison.comparison_files import read_spread
from reefmu.diagnosis.forward.base_curve import curve_base
from reefmu.diagnosis.preprocessing.audit import ratio_from_angles
from reefmu.diagnosis.report.html.origin import Origin
from reefmu.progress import Progress
from reefmu.record import Record, read_column_map, read_record, with_output_locked
from stiffness_model.errors import InputError, expect

from ..terminal.drawing_input import read_drawing
from ..terminal.notes import show_notes
from .record_names import reading_options, record_stem


def run(args: argparse.Namespace) -> int:
    """Compare the states that the records show, print the changes, and write the results into the folder."""
    expect(args.exponent is None, "no --exponent with --compare, which fits no power law", args.exponent, "--exponent")
    expect(args.priors is None, "no --priors with --compare, which compares no hypotheses", args.priors, "--priors")
    files = state_files(args.records)
    columns = read_column_map(args.columns, dict(args.column))
    drive, notes = (None, []) if args.drive is None else read_drawing(args.drive)
    known = None if args.spread_from is None else read_spread(args.spread_from)
    states: list[DriveState] = []
    ratios: set[float | None] = set()
    with Progress("reading", sum(len(paths) for paths in files.values())) as progress:
        for name, paths in files.items():
            records: list[Record] = []
            for path in paths:
                record = read_record(path, columns, None if drive is None else drive.ratio)
                if args.locked == "output":
                    # The twist is the same; the call fails for records that already tell what moves.
                    with_output_locked(record)
                ratios.add(ratio_from_angles(record) if drive is None else drive.ratio)
                records.append(record)
                progress.step()
            states.append(DriveState(name, tuple(records)))
    # A record whose crank is locked shows no ratio, and does not depend on it.
    shown = sorted(ratio for ratio in ratios if ratio is not None)
    expect(len(shown) <= 1, "records of one ratio", shown, "compare")
    ratio = shown[0] if shown else None
    if args.curve is not None:
        curve_base(args.curve, ratio)
    if drive is not None or args.curve is not None or args.power_law:
        notes.append("a comparison needs no base curve: of the drive it uses the ratio alone")
    found = compare_states(states, ratio, known, args.matched)
    sources = [str(path) for paths in files.values() for path in paths]
    write_comparison(found, args.out, Origin(args.command_line, args.drive or "", reading_options(args)), sources)
    show_notes(notes)
    print(comparison_text(found))
    print(f"\nwritten to {Path(args.out)}: compare.json with all pairs of states, compare.html")
    return 0


def state_files(words: Sequence[str]) -> dict[str, list[Path]]:
    """Files of each state: a word is the record of a state, or NAME=FILE,FILE,... with patterns such as cold_*.csv.

    Raises `InputError` for names that repeat, a file given twice and a pattern without files.
    """
    files: dict[str, list[Path]] = {}
    for word in words:
        name, equals, rest = word.partition("=")
        if not equals or Path(word).exists():
            name, paths = record_stem(word), [Path(word)]
        else:
            expect(bool(name) and bool(rest), "NAME=FILE,FILE", repr(word), "compare")
            paths = [path for part in rest.split(",") if part for path in _matching_files(part)]
        if name in files:
            raise InputError(
                f"compare: expected states with different names, got {name!r} twice; give a state its name with "
                "NAME=FILE, and all its files at once with NAME=FILE,FILE"
            )
        files[name] = paths
    expect(len(files) >= 2, "at least two states to compare", ", ".join(files), "compare")
    places = [path.resolve() for paths in files.values() for path in paths]
    twice = next((str(place) for k, place in enumerate(places) if place in places[:k]), None)
    if twice is not None:
        raise InputError(f"compare: expected every file once, got {Path(twice).name} twice")
    return files


def _matching_files(pattern: str) -> list[Path]:
    """The files of a pattern in the order of their names; a plain name is itself."""
    if not glob.has_magic(pattern) or Path(pattern).exists():
        return [Path(pattern)]
    found = sorted(Path(path) for path in glob.glob(pattern))
    expect(bool(found), "files that match the pattern", "none", pattern)
    return found
