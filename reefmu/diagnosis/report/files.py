"""The files of a diagnosis: diagnosis.json, report.html and model.toml, all of them or none."""

from __future__ import annotations

import os

from stiffness_model.io.atomic_files import staged_folder

from ...model.model_file import save_model
from ..analysis import Analysis
from ..schema import Diagnosis
from .corrected_model import corrected_model
from .html.origin import Origin


def write_results(
    found: Analysis | Diagnosis, out: str | os.PathLike[str], origin: Origin | None = None, record: str = ""
) -> None:
    """Write diagnosis.json, report.html and model.toml into the folder `out`, which is created if necessary.

    model.toml is the base curve with the missing effects; a record that allows no diagnosis has none. origin: of the
    report, for its heading; record: path of the record where `found` does not hold it. Raises `InputError` if the
    folder cannot be written.
    """
    # Drawing the page loads matplotlib.
    from .html.page import report_html

    diagnosis = found.diagnosis if isinstance(found, Analysis) else found
    with staged_folder(out) as stage:
        (stage / "diagnosis.json").write_text(diagnosis.to_json(), encoding="utf-8")
        (stage / "report.html").write_text(report_html(found, origin, record), encoding="utf-8")
        if isinstance(found, Analysis):
            save_model(corrected_model(found.evidence.problem, found.conclusion.chosen), stage / "model.toml")
