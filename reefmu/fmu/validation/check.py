"""Hold an exported FMU against the standard and against the Python model it was made from."""

from __future__ import annotations

import logging
import math
import os
import re
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import InputError, expect
from stiffness_model.io.atomic_files import scratch_folder

from ..importer.instance import FmuDrive
from ..model.component import KINDS, component_files, load_component
from ..model.declaration import declare, declare_with_derivatives
from ..model.variables import FMI_VERSIONS, INDICATOR_PREFIX, Variable
from ..xml.archive import SCRIPT_NAME, FmuFile, read_archive, read_members
from .derivatives import TOLERANCE as DERIVATIVE_TOLERANCE
from .derivatives import derivative_error
from .fmi3_rules import rule_violations
from .reference_run import LOADED_ROWS, Excitation, continue_fmu, make_excitation, run_fmu, run_model

if TYPE_CHECKING:
    from ..model.component import Component

TOLERANCE = 1e-9
"""Greatest deviation from the Python model, as a part of full torque (other outputs: of their greatest)."""


@dataclass(frozen=True)
class CheckResult:
    """One thing that was looked at. value: what was measured, to be at most `limit`."""

    name: str
    passed: bool
    value: float
    limit: float
    detail: str = ""

    def __str__(self) -> str:
        status = "ok  " if self.passed else "FAIL"
        text = f"{status} {self.name}: {self.value:.3g} (at most {self.limit:.3g})"
        return f"{text}; {self.detail}" if self.detail else text


@dataclass(frozen=True)
class CheckReport:
    """What `check_fmu` found, in the order of looking."""

    path: Path
    findings: tuple[CheckResult, ...]

    @property
    def passed(self) -> bool:
        return all(finding.passed for finding in self.findings)

    def __getitem__(self, name: str) -> CheckResult:
        return next(finding for finding in self.findings if finding.name == name)

    def __str__(self) -> str:
        bad = sum(not finding.passed for finding in self.findings)
        end = "all passed" if not bad else f"{bad} of {len(self.findings)} failed"
        return "\n".join([f"{self.path}: {end}", *(f"  {finding}" for finding in self.findings)])


def check_fmu(path: str | os.PathLike[str]) -> CheckReport:
    """Validate an FMU of this package and run it against the model in its resources.

    Findings: `standard` (problems fmpy's validation names), in FMI 3.0 `references` and `unknowns` (see `rules`),
    `declaration` (variables and a GUID that differ from those of the model inside), `agreement` (a run with
    reversals at several amplitudes, a turning crank and uneven steps, against the Python model), `parameters` (the
    same with every tunable parameter moved), `reset` and `restore` (a rerun after fmi2Reset, and from a state that
    was saved in mid-run, serialised and read back, here and in a second instance; no difference allowed),
    `independence` (two instances in turn against each alone), `refusal` (an input that is not a number gives
    fmi2Discard and leaves no trace); with the native back end `derivatives` (directional derivatives of outputs and
    rates against differences of the model).

    Errors: `InputError` for what is no FMU of this package, is damaged, or cannot run on this machine.
    """
    file = read_archive(path)
    origin = f"kind {file.kind}" if file.kind else f"one by {file.generation_tool or 'an unnamed tool'}"
    expect(file.kind in KINDS, f"an FMU of kind {' or '.join(KINDS)} that reefmu exported", origin, str(path))
    component = embedded_component(file)
    findings = [
        _standard(file),
        *_fmi3_rules(file),
        _declaration(file, declared_variables(file, component)),
        *_behaviour(file.path, component),
    ]
    if file.backend == "native":
        findings.append(_derivatives(file.path, component))
    return CheckReport(file.path, tuple(findings))


def embedded_component(file: FmuFile) -> Component:
    """What the resources of an FMU of this package hold. Errors: `InputError` if they are missing or damaged."""
    names = component_files(file.kind, file.members)
    content = read_members(file, names.values())
    with scratch_folder() as folder:
        for name, member in names.items():
            (folder / name).write_bytes(content[member])
        try:
            return load_component(folder)
        except InputError as error:
            # The folder is gone by the time the message is read; the member's name is what helps.
            raise InputError(f"{file.path}: {str(error).replace(str(folder), 'resources')}") from None


def _standard(file: FmuFile) -> CheckResult:
    from fmpy.validation import validate_fmu

    try:
        problems = validate_fmu(str(file.path))
    except Exception as error:  # fmpy and the parser behind it raise many kinds for what they refuse
        problems = [str(error)]
    return CheckResult("standard", not problems, len(problems), 0, " ".join(" ".join(problems[:3]).split()))


def _fmi3_rules(file: FmuFile) -> list[CheckResult]:
    return [
        CheckResult(name, not problems, len(problems), 0, "; ".join(problems[:3]))
        for name, problems in rule_violations(file).items()
    ]


def declared_variables(file: FmuFile, component: Component) -> tuple[Variable, ...]:
    """The variables that the back end of the file has for this component."""
    return (declare_with_derivatives(component) if file.backend == "native" else declare(component)).variables


def _declaration(file: FmuFile, variables: tuple[Variable, ...]) -> CheckResult:
    """A model exchanged by hand, or another version's, would no longer be what the description says."""
    from fmpy import read_model_description

    first = FMI_VERSIONS[file.fmi_version].first_reference
    try:
        description = read_model_description(str(file.path), validate=False)
    except Exception as error:  # as above
        raise InputError(
            f"{file.path}: expected a description that fmpy reads, got {' '.join(str(error).split())}"
        ) from None
    beside = {v.name for v in description.modelVariables if v.name.startswith(INDICATOR_PREFIX)}
    declared = {
        v.name: (v.valueReference - first, v.causality, v.variability, v.unit, _number(v.start))
        for v in description.modelVariables
        if v.causality != "independent" and v.name not in beside
    }
    expected = {
        v.name: (v.reference, v.causality, v.variability, v.unit, math.nan if v.start is None else v.start)
        for v in variables
    }
    differing = sorted(
        name for name in declared.keys() | expected.keys() if repr(declared.get(name)) != repr(expected.get(name))
    )  # NaN equals NaN here
    if _script_guid(file) != file.guid:
        differing.insert(0, "guid")
    return CheckResult("declaration", not differing, len(differing), 0, ", ".join(differing[:5]))


def _number(text: str | None) -> float | str:
    """A start value; a text that is no number stands for itself and differs from every number."""
    try:
        return float(text or "nan")
    except ValueError:
        return f"{text!r}"


def _script_guid(file: FmuFile) -> str:
    """The GUID that the script of a Python FMU carries; of others that of the file, for C compares them itself."""
    if SCRIPT_NAME not in file.members:
        return file.guid
    script = f"resources/{read_members(file, [SCRIPT_NAME])[SCRIPT_NAME].decode('utf-8', 'replace')}.py"
    expect(script in file.members, f"the script {script}, which {SCRIPT_NAME} names", "none", str(file.path))
    found = re.search(rb'^ *fmu_guid = "(.*)"$', read_members(file, [script])[script], re.MULTILINE)
    return "" if found is None else found[1].decode("utf-8", "replace")


def _behaviour(path: Path, component: Component) -> Iterator[CheckResult]:
    names = tuple(signal.name for signal in component.outputs)
    values = component.parameter_vector()
    excitation, other = make_excitation(component), make_excitation(component, scale=0.7)
    reference = run_model(component, excitation, values)
    half = len(excitation.dt) // 2
    with FmuDrive(path, name="first") as first, FmuDrive(path, name="second") as second:
        alone = run_fmu(first, excitation, names)
        yield _compared("agreement", alone, reference, component, names)

        first.reset()
        again = run_fmu(first, excitation.part(0, half), names)
        saved = first.save()
        rest = continue_fmu(first, excitation.part(half, None), names)
        yield _identical("reset", np.vstack([again, rest]), alone)

        first.restore(saved)
        second.initialize(other.at(0))
        second.restore(saved)
        restored = [continue_fmu(drive, excitation.part(half, None), names) for drive in (first, second)]
        yield _identical("restore", np.vstack(restored), np.vstack([alone[half + 1 :]] * 2))

        yield _check_refusal(first, excitation, names, alone)

        second.reset()
        other_alone = run_fmu(second, other, names)
        first.reset()
        second.reset()
        yield _identical(
            "independence",
            np.hstack(_run_alternately(first, second, excitation, other, names)),
            np.hstack([alone, other_alone]),
        )

        moved = _shifted_parameters(component)
        first.reset(moved)
        values = np.array([moved.get(p.name, v) for p, v in zip(component.parameters, values, strict=True)])
        reference = run_model(component, excitation, values)
        yield _compared("parameters", run_fmu(first, excitation, names), reference, component, names)


def _derivatives(path: Path, component: Component) -> CheckResult:
    with FmuDrive(path) as drive:
        value, where = derivative_error(drive, component, make_excitation(component), LOADED_ROWS)
    return CheckResult("derivatives", value <= DERIVATIVE_TOLERANCE, value, DERIVATIVE_TOLERANCE, f"worst in {where}")


def _run_alternately(
    first: FmuDrive, second: FmuDrive, excitation: Excitation, other: Excitation, names: tuple[str, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Both instances over their own signal, one step each in turn."""
    rows: tuple[list[list[float]], list[list[float]]] = ([], [])
    for row in range(len(excitation.dt) + 1):
        for drive, signal, kept in ((first, excitation, rows[0]), (second, other, rows[1])):
            inputs = signal.at(row)
            outputs = drive.initialize(inputs) if row == 0 else drive.step(float(signal.dt[row - 1]), inputs)
            kept.append([outputs[name] for name in names])
    return np.array(rows[0]), np.array(rows[1])


def _check_refusal(
    drive: FmuDrive, excitation: Excitation, names: tuple[str, ...], alone: NDArray[np.float64]
) -> CheckResult:
    """A step with NaN among the inputs must be discarded, and the run must go on as if nothing had been."""
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
        return _identical("refusal", np.vstack(rows), alone)
    return CheckResult("refusal", False, math.nan, 0, f"{excitation.names[0]} = NaN was not answered with fmi2Discard")


def _shifted_parameters(component: Component) -> dict[str, float]:
    """Every tunable parameter moved by a tenth of its size or nominal value, towards the wider side."""
    moved = {}
    for parameter in component.parameters:
        if parameter.tunable:
            low = -math.inf if parameter.minimum is None else parameter.minimum
            high = math.inf if parameter.maximum is None else parameter.maximum
            shift = 0.1 * (abs(parameter.value) or min(parameter.nominal, 1.0))
            shift = shift if parameter.value + shift <= high else -shift
            moved[parameter.name] = float(np.clip(parameter.value + shift, low, high))
    return moved


def _compared(
    name: str, came: NDArray[np.float64], expected: NDArray[np.float64], component: Component, names: tuple[str, ...]
) -> CheckResult:
    greatest = np.abs(expected).max(axis=0)
    scale = np.where(greatest > 0, greatest, 1.0)
    scale[names.index("output.tau")] = component.full_torque
    deviation = np.abs(came - expected).max(axis=0) / scale
    worst = int(np.argmax(np.where(np.isnan(deviation), np.inf, deviation)))
    value = float(deviation[worst])
    torque = float(deviation[names.index("output.tau")])
    return CheckResult(
        name,
        value <= TOLERANCE,
        value,
        TOLERANCE,
        f"worst in {names[worst]}; output.tau {torque:.3g} of {component.full_torque:.4g} N.m, {len(came) - 1} steps",
    )


def _identical(name: str, came: NDArray[np.float64], expected: NDArray[np.float64]) -> CheckResult:
    value = float(np.abs(came - expected).max())
    return CheckResult(name, value == 0, value, 0.0)


@contextmanager
def _logging_disabled() -> Generator[None]:
    """The FMU's complaint about the NaN we send it on purpose is no news for the user."""
    logger = logging.getLogger("reefmu.fmu")
    disabled, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = disabled
