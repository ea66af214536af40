"""The way in: one record, or several states of the same drive."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from stiffness_model import load_drive
from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import expect

from ..record import Record, read_record, with_output_locked
from .analysis import Analysis
from .estimation.worker_pool import ignore_overflow
from .pipeline import analyse
from .schema import Diagnosis
from .shared_exponent import fixed_exponent_base

PathLike = str | os.PathLike[str]


def diagnose_record(
    paths: PathLike | Record | Sequence[PathLike],
    drive: PathLike | Drive | None = None,
    curve: PathLike | None = None,
    out: PathLike | None = None,
    columns: Mapping[str, str] | None = None,
    progress: Callable[[str, float], None] | None = None,
    exponent: float | None = None,
    output_locked: bool = False,
    executor: Executor | None = None,
) -> Diagnosis:
    """Diagnose one record.

    paths: of a record file (see `reefmu.record.read_record`), of several files of one record, or a `Record`.
    drive: a preset's name, the path of a drawing or a `Drive`; curve: path of a curve file for a gear without a
    drawing; with neither, the base curve is a free power law. out: folder for diagnosis.json, report.html and,
    with a drawing, model.toml; nothing is written without it. columns: column map for foreign files. progress:
    called with (what is done, share done). exponent: of the power law, held; free if None. output_locked: of a record
    of a twist alone: the crank turned, not the output (see `reefmu.record.with_output_locked`). executor: of processes
    on this machine that share the fits; the result is the same without.

    Raises `InputError` for files that cannot be read or written, for both a drive and a curve, and for an exponent
    beside either.
    """
    expect(drive is None or curve is None, "a drive or a curve", "both", "diagnose")
    expect(
        exponent is None or (drive is None and curve is None),
        "an exponent of a power law only",
        "one beside a drive or a curve",
        "diagnose",
    )
    record = paths if isinstance(paths, Record) else _read(paths, columns)
    drawn = drive
    if drive is not None and not isinstance(drive, Drive):
        drawn = load_drive(drive if isinstance(drive, str) else Path(drive))
    assert drawn is None or isinstance(drawn, Drive)
    if output_locked:
        record = with_output_locked(record, 1.0 if drawn is None else drawn.ratio)
    base_of = None if exponent is None else fixed_exponent_base(exponent)
    with ignore_overflow():
        found = analyse(record, drawn, curve, progress, base_of, executor)
    if out is not None:
        from .report.files import write_results

        write_results(found, out)
    return found.diagnosis if isinstance(found, Analysis) else found


def _read(paths: PathLike | Sequence[PathLike], columns: Mapping[str, str] | None) -> Record:
    if isinstance(paths, str | os.PathLike):
        return read_record(paths, columns)
    from ..record import join_records

    return join_records([read_record(p, columns) for p in paths])


def diagnose_records(
    paths: Sequence[PathLike],
    drive: PathLike | Drive | None = None,
    curve: PathLike | None = None,
    columns: Mapping[str, str] | None = None,
) -> dict[str, Diagnosis]:
    """Diagnoses of several separate records (the same drive in several states), by path."""
    return {str(path): diagnose_record(path, drive, curve, columns=columns) for path in paths}
