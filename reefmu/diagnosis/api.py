"""The public functions: the diagnosis of one record, or of several states of the same drive."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

from stiffness_model.errors import expect
from stiffness_model.io.drawing_toml import DriveLike, as_any_drive

from ..record import Columns, Record, join_records, read_record, with_output_locked
from .analysis import Analysis, ProposedExperiment
from .estimation.worker_pool import ignore_overflow
from .pipeline import analyse
from .preparation import BaseCurveSource
from .probabilities.priors import NO_PRIORS, Priors, load_priors
from .report.html.origin import Origin
from .schema import Diagnosis
from .shared_exponent import SharedExponent, fixed_exponent_base

PathLike = str | os.PathLike[str]


def diagnose_record(
    paths: PathLike | Record | Sequence[PathLike],
    drive: DriveLike | None = None,
    curve: PathLike | None = None,
    out: PathLike | None = None,
    columns: Columns | None = None,
    progress: Callable[[str, float], None] | None = None,
    exponent: float | SharedExponent | None = None,
    output_locked: bool = False,
    executor: Executor | None = None,
    origin: Origin | None = None,
    propose: Callable[[Analysis], ProposedExperiment | None] | None = None,
    priors: PathLike | Priors = NO_PRIORS,
) -> Diagnosis:
    """Diagnose one record.

    paths: of a record file (see `reefmu.record.read_record`), of several files of one record, or a `Record`.
    drive: a drive of any kind, its name or the path of its drawing. curve: path of a curve file, for a gear without a
    drawing. With neither, the base curve is a power law that is fitted to the record. out: folder for diagnosis.json,
    report.html and model.toml, the last only where there is a corrected model; without it nothing is written. columns:
    map from foreign column names to `name [unit]`. progress: called with the present stage and the share done.
    exponent: fixed exponent of the power law, within 0.3 ... 6, or one that several records share; fitted if None.
    output_locked: for a record of a twist alone, that the crank turned while the output was locked (see
    `reefmu.record.with_output_locked`). executor: of processes on this machine that share the fits; the result is the
    same without it. origin: command and drawing that the report states, by default the arguments of this call.
    propose: plans the next experiment, such as `reefmu.planning.propose_protocol`; its protocol is written to
    next_protocol.csv. priors: what is known of the drive before the record is seen, or the path of a TOML file with it
    (see `reefmu.diagnosis.load_priors`).

    Raises `InputError` for files that cannot be read or written, for both a drive and a curve, and for an exponent
    together with either.
    """
    expect(drive is None or curve is None, "a drive or a curve", "both", "diagnose")
    expect(
        exponent is None or (drive is None and curve is None),
        "an exponent of a power law only",
        "one beside a drive or a curve",
        "diagnose",
    )
    record = paths if isinstance(paths, Record) else _read(paths, columns)
    drawn = None if drive is None else as_any_drive(drive)
    if output_locked:
        record = with_output_locked(record, None if drawn is None else drawn.ratio)
    source = BaseCurveSource(drawn, curve, None if exponent is None else fixed_exponent_base(exponent))
    known = priors if isinstance(priors, Priors) else load_priors(priors)
    with ignore_overflow():
        found = analyse(record, source, progress, executor, known)
        if propose is not None and isinstance(found, Analysis):
            found = found.with_proposal(propose(found))
    if out is not None:
        # Drawing the report loads matplotlib, which a diagnosis without files does not need.
        from .report.files import write_results

        given = drive if isinstance(drive, str | os.PathLike) else curve
        named = Origin(base="" if given is None else str(given))
        write_results(found, out, named if origin is None else origin, record.source)
    return found.diagnosis if isinstance(found, Analysis) else found


def _read(paths: PathLike | Sequence[PathLike], columns: Columns | None) -> Record:
    if isinstance(paths, str | os.PathLike):
        return read_record(paths, columns)
    return join_records([read_record(path, columns) for path in paths])


def diagnose_records(
    paths: Sequence[PathLike],
    drive: DriveLike | None = None,
    curve: PathLike | None = None,
    columns: Columns | None = None,
) -> dict[str, Diagnosis]:
    """Diagnose several separate records, such as states of the same drive, and return the diagnoses by path.

    Arguments and errors are those of `diagnose_record`.
    """
    return {str(path): diagnose_record(path, drive, curve, columns=columns) for path in paths}
