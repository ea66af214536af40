"""What a diagnosis leaves on disk: diagnosis.json, report.html and the corrected model, all of them or none."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from stiffness_model.files import staged_folder

from ..model import DriveModel, build_model
from ..model_file import save_model
from ..record import Record
from .fit import Fit
from .kernels import kernel
from .result import Diagnosis
from .study import Study
from .workflow import Examined


def write_results(found: Examined | Diagnosis, out: str | os.PathLike[str]) -> None:
    """Write into the folder `out`, which is made if need be.

    diagnosis.json and report.html; model.toml where a drawing lies under the model and something was found or
    nothing is missing. Raises `InputError` if the folder cannot be written.
    """
    from .report import report_html

    diagnosis = found.diagnosis if isinstance(found, Examined) else found
    with staged_folder(out) as stage:
        (stage / "diagnosis.json").write_text(diagnosis.to_json(), encoding="utf-8")
        (stage / "report.html").write_text(report_html(found), encoding="utf-8")
        if isinstance(found, Examined) and (model := corrected_model(found.study, found.finding.chosen)) is not None:
            save_model(model, stage / "model.toml")


def corrected_model(study: Study, chosen: Fit) -> DriveModel | None:
    """The drive model with the effects found inside; None without a drawing."""
    if study.base.drive is None:
        return None
    effects: dict[str, dict[str, float]] = {}
    at = 1 + study.base.n_shape
    for name in chosen.names:
        parameters = kernel(name).effect.parameters
        effects[name] = {p.name: float(chosen.parameters[at + k]) for k, p in enumerate(parameters)}
        at += len(parameters)
    return build_model(study.base.drive, effects, lookup=study.base.lookup)


def conditioned(record: Record, study: Study, chosen: Fit) -> Record:
    """The record as the fit saw it: paths smoothed, and the twist's arbitrary zero taken out at the output."""
    trace = study.trace
    return replace(record, crank_angle=trace.crank, output_angle=trace.output + float(chosen.parameters[0]))


def simulated_gap(study: Study, record: Record, chosen: Fit) -> float:
    """Rms, N.m, between the record and the corrected model run by `reefmu.simulate`.

    The jitter of the measured twist about the smooth one counts through the stiffness, as in the fit.
    """
    from ..simulate import simulate_record

    model = corrected_model(study, chosen)
    assert model is not None
    response = simulate_record(model, conditioned(record, study, chosen))
    jitter = study.trace.twist - study.trace.smooth_twist
    torque = response["measured.tau"] + response["stiffness"] * jitter
    return float(np.sqrt(np.mean((record.output_torque - torque) ** 2)))
