"""`reefmu record`: what was understood of a measured record, and what can be diagnosed from it."""

from __future__ import annotations

import argparse
import json
import shlex

from reefmu.inspection import RecordInspection, inspect_record, inspection_text
from reefmu.record import read_column_map, read_file

from ..terminal.drawing_input import read_drawing
from ..terminal.notes import show_notes
from .record_names import reading_options, record_stem


def run(args: argparse.Namespace) -> int:
    """Print the inspection of one record, as text or as JSON."""
    columns = read_column_map(args.columns, dict(args.column))
    drive, notes = (None, []) if args.drive is None else read_drawing(args.drive)
    reading = read_file(args.record, columns, None if drive is None else drive.ratio)
    found = inspect_record(reading, drive, output_locked=args.locked == "output")
    command = diagnose_command(args, found)
    show_notes(notes)
    if args.json:
        print(json.dumps(found.to_dict() | {"next": command}, indent=2, ensure_ascii=False))
    else:
        print(inspection_text(found, command))
        if "crank_angle" in found.reading.record.missing and args.locked == "crank":
            print("  with --locked output if the rig locks the output and turns the crank")
        if args.drive is None:
            print("  with --drive DRAWING.toml in place of --power-law if there is a drawing")
    return 0


def diagnose_command(args: argparse.Namespace, found: RecordInspection) -> str:
    """The call of `reefmu diagnose` for the record, with the columns of this call."""
    words = ["reefmu", "diagnose", args.record]
    words += ["--power-law"] if args.drive is None else ["--drive", args.drive]
    return shlex.join([*words, *reading_options(args), "--out", f"{record_stem(args.record)}-diagnosis"])
