"""`reefmu diagnose`: what a measured record says that the model does not know."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from reefmu.diagnosis import Diagnosis, diagnose_record
from reefmu.progress import Progress
from stiffness_model.errors import InputError, expect

from . import study


def run(args: argparse.Namespace) -> int:
    """Diagnose each record, print the verdicts, and write the results into the folder."""
    columns = _columns(args)
    drive, notes = (None, []) if args.drive is None else study.read_drawing(args.drive)
    folder = Path(args.out)
    records = [Path(record) for record in args.records]
    single = len(records) == 1
    expect(single or len({_stem(record) for record in records}) == len(records), "records with different names",
           ", ".join(_stem(record) for record in records), "diagnose")
    found: dict[str, Diagnosis] = {}
    for record in records:
        out = folder if single else folder / _stem(record)
        with Progress(f"diagnosing {record.name}", 100) as progress:
            found[_stem(record)] = diagnose_record(record, drive, args.curve, out, columns, _stepper(progress))
    study.show_notes(notes)
    for name, diagnosis in found.items():
        print(_sentence(name, diagnosis))
    if not single:
        print("\n" + _table(found))
    print(f"\nwritten to {folder}: diagnosis.json, report.html" + (", model.toml" if drive is not None else "")
          + ("" if single else " in a folder for each record"))
    return 0


def _columns(args: argparse.Namespace) -> dict[str, str] | None:
    """The column map of `--columns FILE.toml` (a table of texts) and of `--column FOREIGN=NAME [UNIT]`."""
    columns: dict[str, str] = dict(args.column)
    if args.columns is not None:
        try:
            table: dict[str, Any] = tomllib.loads(Path(args.columns).read_text("utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise InputError(f"{args.columns}: expected a column map in TOML, got {error}") from None
        for foreign, name in table.items():
            expect(isinstance(name, str), 'a text such as TIME = "time [s]"', name, f"{args.columns}: {foreign}")
        columns = {**table, **columns}
    return columns or None


def _stepper(progress: Progress) -> Callable[[str, float], None]:
    done = 0

    def step(_what: str, share: float) -> None:
        nonlocal done
        while done < int(100 * share):
            progress.step()
            done += 1

    return step


def _stem(record: Path) -> str:
    return record.name.removesuffix(".gz").removesuffix(".csv")


def _sentence(name: str, diagnosis: Diagnosis) -> str:
    names = ", ".join(effect.name for effect in diagnosis.effects)
    gap = diagnosis.gap
    verdict = f"{name}: {diagnosis.verdict}" + (f": {names}" if names else "")
    figures = f"gap {gap.before:.3g} -> {gap.after:.3g} {gap.unit}, noise {gap.noise:.3g}"
    lines = [verdict, f"  {figures}"]
    if diagnosis.alternatives:
        lines.append("  or: " + "; ".join(" + ".join(names) for names in diagnosis.alternatives))
    lines += [f"  next: {step}" for step in diagnosis.next_experiment[:3]]
    return "\n".join(lines)


def _table(found: dict[str, Diagnosis]) -> str:
    """Which effects come and go: a row for each record, the first parameter of each effect."""
    names = sorted({effect.name for diagnosis in found.values() for effect in diagnosis.effects})
    rows: list[list[str]] = []
    for name, diagnosis in found.items():
        sizes = {effect.name: next(iter(effect.parameters.values())) for effect in diagnosis.effects}
        rows.append([name, diagnosis.verdict, *(f"{sizes[n].value:.3g} {sizes[n].unit}" if n in sizes else "-"
                                                for n in names)])
    return study.table(["record", "verdict", *names], [""] * (2 + len(names)), rows)
