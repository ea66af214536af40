"""Tests of an FMU that run it: against the Python model, and against itself after reset, restore and refusal."""

from __future__ import annotations

import logging
import math
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

from ..importer.instance import FmuDrive
from ..related_files import FOLDER, REFERENCES, STIMULI, read_references
from ..related_files import TOLERANCE as REFERENCE_TOLERANCE
from ..xml.archive import FmuFile, read_members
from .check_report import CheckResult
from .derivatives import TOLERANCE as DERIVATIVE_TOLERANCE
from .derivatives import derivative_error
from .reference_run import LOADED_ROWS, Excitation, continue_fmu, make_excitation, run_fmu, run_model

if TYPE_CHECKING:
    from ..model.component import Component

TOLERANCE = 1e-9
"""Greatest deviation from the Python model, relative to full torque (other outputs: to their greatest value). Native
FMUs agree to 1e-12 in the tests; the margin for other compilers is chosen by judgement."""


def check_runs(path: Path, component: Component) -> Iterator[CheckResult]:
    """All tests of co-simulation that `check_fmu` lists, with two instances of the FMU."""
    names = tuple(signal.name for signal in component.outputs)
    values = component.parameter_vector()
    excitation, other = make_excitation(component), make_excitation(component, scale=0.7)
    reference = run_model(component, excitation, values)
    half = len(excitation.dt) // 2
    with FmuDrive(path, name="first") as first, FmuDrive(path, name="second") as second:
        whole_run = run_fmu(first, excitation, names)
        yield _compared("agreement", whole_run, reference, component, names)

        first.reset()
        first_half = run_fmu(first, excitation.part(0, half), names)
        saved = first.save()
        second_half = continue_fmu(first, excitation.part(half, None), names)
        yield _identical("reset", np.vstack([first_half, second_half]), whole_run)

        first.restore(saved)
        second.initialize(other.at(0))
        second.restore(saved)
        restored = [continue_fmu(drive, excitation.part(half, None), names) for drive in (first, second)]
        yield _identical("restore", np.vstack(restored), np.vstack([whole_run[half + 1 :]] * 2))

        yield check_discard(first, excitation, names, whole_run)

        second.reset()
        other_run = run_fmu(second, other, names)
        first.reset()
        second.reset()
        alternating = _run_alternately(first, second, excitation, other, names)
        yield _identical("independence", np.hstack(alternating), np.hstack([whole_run, other_run]))

        changed = _changed_parameters(component)
        first.reset(changed)
        values = np.array([changed.get(p.name, v) for p, v in zip(component.parameters, values, strict=True)])
        reference = run_model(component, excitation, values)
        yield _compared("parameters", run_fmu(first, excitation, names), reference, component, names)


def check_references(file: FmuFile) -> CheckResult:
    """The FMU over the stimuli that it contains, against the results that it contains, as another host replays them."""
    names = [f"{FOLDER}/{name}" for name in (STIMULI, REFERENCES)]
    try:
        references = read_references(*read_members(file, names).values())
    except ValueError as error:
        raise InputError(f"{file.path}: expected reference results in {FOLDER}, got {error}") from None
    rows: list[dict[str, float]] = []
    with FmuDrive(file.path) as drive:
        stimuli = [dict(zip(references.inputs, row, strict=True)) for row in references.stimuli.tolist()]
        rows.append(drive.initialize(stimuli[0]))
        for inputs, dt in zip(stimuli, np.diff(references.time).tolist(), strict=False):
            rows.append(drive.step(dt, inputs))
    came = np.array([[row[name] for name in references.outputs] for row in rows])
    greatest = np.abs(references.results).max(axis=0)
    deviation = np.abs(came - references.results).max(axis=0) / np.where(greatest > 0, greatest, 1.0)
    worst = int(np.argmax(np.where(np.isnan(deviation), np.inf, deviation)))
    value = float(deviation[worst])
    return CheckResult(
        "replay", value <= REFERENCE_TOLERANCE, value, REFERENCE_TOLERANCE, f"worst in {references.outputs[worst]}"
    )


def check_derivatives(path: Path, component: Component) -> CheckResult:
    """Directional derivatives of the FMU against differences of the model: see `derivatives`."""
    with FmuDrive(path) as drive:
        error, where = derivative_error(drive, component, make_excitation(component), LOADED_ROWS)
    return CheckResult("derivatives", error <= DERIVATIVE_TOLERANCE, error, DERIVATIVE_TOLERANCE, f"worst in {where}")


def check_discard(drive: FmuDrive, excitation: Excitation, names: tuple[str, ...], whole_run: Array) -> CheckResult:
    """A step with NaN among the inputs must be discarded and must not change the run after it.

    whole_run: outputs `names` over `excitation` without such a step, shape (n + 1, n_outputs).
    """
    drive.reset()
    half = len(excitation.dt) // 2
    rows = [run_fmu(drive, excitation.part(0, half), names)]
    discarded = False
    with _logging_disabled():
        try:
            drive.step(1e-3, {excitation.names[0]: math.nan})
        except InputError as error:
            discarded = "(discard)" in str(error)
    if discarded:
        rows.append(continue_fmu(drive, excitation.part(half, None), names))
        return _identical("refusal", np.vstack(rows), whole_run)
    return CheckResult("refusal", False, math.nan, 0, f"{excitation.names[0]} = NaN was not answered with fmi2Discard")


def _run_alternately(
    first: FmuDrive, second: FmuDrive, excitation: Excitation, other: Excitation, names: tuple[str, ...]
) -> tuple[Array, Array]:
    """Outputs of two instances, each over its own excitation, that step alternately; each (n + 1, n_outputs)."""
    rows: tuple[list[list[float]], list[list[float]]] = ([], [])
    for row in range(len(excitation.dt) + 1):
        for drive, signal, own_rows in ((first, excitation, rows[0]), (second, other, rows[1])):
            inputs = signal.at(row)
            outputs = drive.initialize(inputs) if row == 0 else drive.step(float(signal.dt[row - 1]), inputs)
            own_rows.append([outputs[name] for name in names])
    return np.array(rows[0]), np.array(rows[1])


def _changed_parameters(component: Component) -> dict[str, float]:
    """Every tunable parameter changed by a tenth of its value (of its nominal, if it is zero) within its bounds."""
    changed = {}
    for parameter in component.parameters:
        if parameter.tunable:
            low = -math.inf if parameter.minimum is None else parameter.minimum
            high = math.inf if parameter.maximum is None else parameter.maximum
            shift = 0.1 * (abs(parameter.value) or min(parameter.nominal, 1.0))
            shift = shift if parameter.value + shift <= high else -shift
            changed[parameter.name] = float(np.clip(parameter.value + shift, low, high))
    return changed


def _compared(name: str, outputs: Array, expected: Array, component: Component, names: tuple[str, ...]) -> CheckResult:
    """Outputs of the FMU against those of the model, each (n + 1, n_outputs), to `TOLERANCE`."""
    greatest = np.abs(expected).max(axis=0)
    scale = np.where(greatest > 0, greatest, 1.0)
    scale[names.index("output.tau")] = component.full_torque
    deviation = np.abs(outputs - expected).max(axis=0) / scale
    worst = int(np.argmax(np.where(np.isnan(deviation), np.inf, deviation)))
    value, torque = float(deviation[worst]), float(deviation[names.index("output.tau")])
    detail = f"output.tau {torque:.3g} of {component.full_torque:.4g} N.m, {len(outputs) - 1} steps"
    return CheckResult(name, value <= TOLERANCE, value, TOLERANCE, f"worst in {names[worst]}; {detail}")


def _identical(name: str, outputs: Array, expected: Array) -> CheckResult:
    """Two runs of the FMU, which must not differ at all."""
    value = float(np.abs(outputs - expected).max())
    return CheckResult(name, value == 0, value, 0.0)


@contextmanager
def _logging_disabled() -> Generator[None]:
    """Without the FMU's message about the NaN that the check passes on purpose."""
    logger = logging.getLogger("reefmu.fmu")
    disabled, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = disabled
