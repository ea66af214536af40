"""The files of a diagnosis: diagnosis.json, report.html, model.toml and next_protocol.csv, all of them or none."""

from __future__ import annotations

import os
from pathlib import Path

from stiffness_model.io.atomic_files import staged_folder

from ...model.drive_model import DriveModel
from ...model.model_file import save_model
from ..analysis import Analysis
from ..schema import Diagnosis
from .corrected_model import corrected_model
from .html.next_commands import MODEL
from .html.origin import Origin

PROTOCOL = "next_protocol.csv"
"""File of the set points of the next experiment."""


def write_results(
    found: Analysis | Diagnosis, out: str | os.PathLike[str], origin: Origin | None = None, record: str = ""
) -> None:
    """Write diagnosis.json, report.html, model.toml and next_protocol.csv into the folder `out`, which is created if
    necessary.

    model.toml is the base curve with the missing effects and the losses that the record shows, where there is a
    corrected model (`Diagnosis.has_model`). next_protocol.csv is the protocol of the experiment that was proposed, and
    is not written where there is none. origin: of the report, for its heading; record: path of the record where `found`
    does not hold it.
    Raises `InputError` if the folder cannot be written.
    """
    # Drawing the page loads matplotlib.
    from .html.page import report_html

    diagnosis = found.diagnosis if isinstance(found, Analysis) else found
    model: DriveModel | None = None
    if isinstance(found, Analysis) and diagnosis.has_model:
        problem, written = found.evidence.problem, found.written.corrected
        model = corrected_model(problem, written, diagnosis.losses, keeps_stated=found.keeps_stated)
    files = {"diagnosis.json": diagnosis.to_json(), "report.html": report_html(found, origin, record)}
    if isinstance(found, Analysis) and found.proposed is not None and found.proposed.protocol:
        files[PROTOCOL] = found.proposed.protocol
    with staged_folder(out) as stage:
        for name, text in files.items():
            (stage / name).write_text(text, encoding="utf-8")
        if model is not None:
            save_model(model, stage / MODEL)
    # Results of an earlier diagnosis in this folder that this one does not have would be taken for its own.
    for name in {MODEL, PROTOCOL} - {*files, *([] if model is None else [MODEL])}:
        (Path(out) / name).unlink(missing_ok=True)
