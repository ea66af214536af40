"""`reefmu diagnose`: the effects that a measured record shows and the model does not have."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from reefmu.diagnosis import Diagnosis, diagnose_record
from reefmu.diagnosis.forward.base_curve import PLAY
from reefmu.diagnosis.hypotheses import hypothesis_text, likeliest, probability_text
from reefmu.diagnosis.probabilities.priors import NO_PRIORS, load_priors
from reefmu.diagnosis.report.files import PROTOCOL
from reefmu.diagnosis.report.html.next_commands import MODEL
from reefmu.diagnosis.report.html.origin import Origin
from reefmu.diagnosis.report.text import (
    DISAGREEMENT,
    amplitude_text,
    bound_text,
    faint_alternatives_text,
    losses_text,
    no_model_text,
    sensor_text,
    sets_text,
)
from reefmu.diagnosis.shared_exponent import SharedExponent, shared_exponent
from reefmu.model.chosen_effects import inherent_effects, undiagnosed_effects
from reefmu.model.contacts.tables import cached_lookup
from reefmu.planning import propose_protocol
from reefmu.progress import Progress
from reefmu.record import Record, read_column_map, read_record, with_output_locked
from stiffness_model.errors import InputError, expect
from stiffness_model.units import ARCMIN, quantity_text

from ..terminal.drawing_input import read_drawing
from ..terminal.notes import show_notes
from ..terminal.text_table import aligned_table
from ..terminal.worker_processes import pool_with_progress, process_pool
from . import compare_states
from .record_names import reading_options, record_stem


def run(args: argparse.Namespace) -> int:
    """Diagnose each record, print the verdicts, and write the results into the folder."""
    if args.compare:
        return compare_states.run(args)
    expect(not args.matched, "--matched with --compare only", "no --compare", "--matched")
    expect(args.spread_from is None, "--spread-from with --compare only", "no --compare", "--spread-from")
    columns = read_column_map(args.columns, dict(args.column))
    drive, notes = (None, []) if args.drive is None else read_drawing(args.drive)
    if drive is not None and (open_effects := inherent_effects(drive).keys() - undiagnosed_effects(drive).keys()):
        stated = ", ".join(sorted(open_effects))
        notes.append(f"the base curve of {drive.name} is without its sheet's {stated}: the record decides")
    priors = NO_PRIORS if args.priors is None else load_priors(args.priors)
    folder = Path(args.out)
    paths = [Path(record) for record in args.records]
    single = len(paths) == 1
    expect(
        single or len({record_stem(path) for path in paths}) == len(paths),
        "records with different names",
        ", ".join(record_stem(path) for path in paths),
        "diagnose",
    )
    records = {path: read_record(path, columns, None if drive is None else drive.ratio) for path in paths}
    locked = args.locked == "output"
    exponent = _exponent(args, list(records.values()), locked)
    if drive is not None:
        # Solved here on all cores; every diagnosis then finds it in the cache.
        with pool_with_progress("solving the lookup (once: it is cached)") as executor:
            cached_lookup(drive, executor=executor)
    found: dict[str, Diagnosis] = {}
    places = {path: folder if single else folder / record_stem(path) for path in paths}
    with process_pool() as pool:
        for path, record in records.items():
            with Progress(f"diagnosing {path.name}", 100) as progress:
                found[record_stem(path)] = diagnose_record(
                    record,
                    drive,
                    args.curve,
                    places[path],
                    None,
                    lambda stage, share, shown=progress: shown.advance_to(share, stage),
                    exponent,
                    locked,
                    pool,
                    Origin(args.command_line, args.drive or args.curve or "", reading_options(args), _assumed(args)),
                    partial(propose_protocol, spread=pool.map),
                    priors,
                )
    show_notes(notes)
    for name, diagnosis in found.items():
        print(diagnosis_text(name, diagnosis))
    if not single:
        print("\n" + _table(found))
    print("\n" + _written(folder, list(places.values())))
    return 0


def _assumed(args: argparse.Namespace) -> tuple[str, ...]:
    """The options of what is known beside a record."""
    given = {"--priors": args.priors, "--exponent": None if args.exponent == "shared" else args.exponent}
    return tuple(word for option, value in given.items() if value is not None for word in (option, value))


def _written(folder: Path, places: Sequence[Path]) -> str:
    """What was written to a folder, in which every record has its place."""
    models = [(place / MODEL).exists() for place in places]
    texts = ["diagnosis.json, report.html" + (f", {MODEL}" if all(models) else "")]
    texts[0] += "" if len(places) == 1 else " in a folder for each record"
    texts += [f"{MODEL} where there is a corrected model"] if any(models) and not all(models) else []
    texts += [f"{PROTOCOL} where a protocol decides"] if any((place / PROTOCOL).exists() for place in places) else []
    return f"written to {folder}: {'; '.join(texts)}"


def _exponent(args: argparse.Namespace, records: Sequence[Record], locked: bool) -> float | SharedExponent | None:
    """The exponent of `--exponent`: None for a free one, a number, or the one that all records share."""
    if args.exponent is None:
        return None
    expect(args.power_law, "--exponent with --power-law only", args.exponent, "--exponent")
    if args.exponent != "shared":
        try:
            return float(args.exponent)
        except ValueError:
            raise InputError(f"--exponent: expected a number or 'shared', got {args.exponent!r}") from None
    with Progress("one exponent for all records", 100) as progress:
        shared = shared_exponent(
            [with_output_locked(r) for r in records] if locked else records,
            lambda _stage, share: progress.advance_to(share),
        )
    print(shared)
    return shared


def diagnosis_text(name: str, diagnosis: Diagnosis) -> str:
    """What the command prints for the record `name`: verdict, likeliest hypotheses, gap, alternatives, next steps."""
    names = ", ".join(effect.name for effect in diagnosis.effects)
    gap = diagnosis.gap
    verdict = f"{name}: {diagnosis.verdict}" + (f": {names}" if names else "")
    figures = f"gap {gap.before:.3g} -> {gap.after:.3g} {gap.unit}, noise {gap.noise:.3g}"
    if gap.raw_before is not None and gap.raw_after is not None:
        figures += f"; with the angles as measured {gap.raw_before:.3g} -> {gap.raw_after:.3g}"
    chances = [f"  {probability_text(h.probability):>6}  {hypothesis_text(h)}" for h in likeliest(diagnosis.hypotheses)]
    lines = [verdict, *chances, f"  {figures}"]
    if diagnosis.verdict == "insufficient":
        lines = [verdict, f"  {diagnosis.sentence}"]
    if diagnosis.alternatives:
        head = "or" if diagnosis.verdict == "ambiguous" else "not excluded"
        told = [sets_text(diagnosis.shown_alternatives), faint_alternatives_text(diagnosis)]
        lines.append(f"  {head}: {'; or '.join(text for text in told if text)}")
    lines += [f"  {refusal}"] if (refusal := no_model_text(diagnosis)) else []
    lines += [f"  {bound_text(found)}" for found in diagnosis.at_bounds]
    lines += [f"  {amplitude_text(test)}" for test in diagnosis.amplitudes if test.p < DISAGREEMENT]
    if diagnosis.losses is not None:
        lines += [f"  {text}" for text in (losses_text(diagnosis.losses), *sensor_text(diagnosis.losses))]
    lines += [f"  next: {step}" for step in diagnosis.next_experiment[:3]]
    return "\n".join(lines)


def _table(found: dict[str, Diagnosis]) -> str:
    """The effects of the records: a row for each record, with the first parameter of each effect."""
    names = sorted({effect.name for diagnosis in found.values() for effect in diagnosis.effects})
    bands = any(PLAY in diagnosis.base for diagnosis in found.values())
    rows: list[list[str]] = []
    for name, diagnosis in found.items():
        sizes = {effect.name: next(iter(effect.parameters.values())) for effect in diagnosis.effects}
        play = [f"{diagnosis.base[PLAY] / ARCMIN:.3g} arcmin" if PLAY in diagnosis.base else "-"] if bands else []
        rows.append(
            [
                name,
                diagnosis.verdict,
                *play,
                *(quantity_text(sizes[n].value, sizes[n].unit) if n in sizes else "-" for n in names),
                f"{diagnosis.remainder:.3g} N.m",
            ]
        )
    heads = ["record", "verdict", *["play"] * bands, *names, "remainder"]
    return aligned_table(heads, [""] * len(heads), rows)
