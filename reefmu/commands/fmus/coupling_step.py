"""Whether a communication step is short enough for a drive's FMU and the masses around it."""

from __future__ import annotations

import math
from pathlib import Path

from reefmu.fmu.model.component import Component
from reefmu.fmu.model.nominals import MAX_GROWTH_RATE, stiffness_at_full_torque
from reefmu.fmu.validation.check_report import CheckResult
from reefmu.fmu.validation.fmu_check import embedded_component
from reefmu.fmu.xml.archive import FmuFile, read_archive
from reefmu.joint.step import growth_rate, largest_step, step_warning
from reefmu.model.masses import Masses, expect_inertia, expect_step
from stiffness_model.errors import expect
from stiffness_model.units import quantity_text


def step_notes(component: Component, masses: Masses, step: float) -> list[str]:
    """A warning if the communication step, s, is too long for the drive between these masses; else an empty list."""
    ratio = next(p.value for p in component.parameters if p.name == "ratio")
    warning = step_warning(
        step, stiffness_at_full_torque(component), masses.reduced_inertia(ratio), growth=MAX_GROWTH_RATE
    )
    return [warning] if warning else []


def proposed_step(file: FmuFile) -> float:
    """Step of the DefaultExperiment, s; NaN where there is none."""
    from fmpy import read_model_description

    experiment = read_model_description(str(file.path), validate=False).defaultExperiment
    return float((experiment and experiment.stepSize) or math.nan)


def check_coupling(path: Path, step: float | None, inertia: float) -> CheckResult:
    """Whether the joint's oscillation stays bounded under a master that holds the drive's torque over a step.

    path: of an FMU of kind `drive`. step: s; None for the one that the FMU proposes. inertia: reduced inertia of motor
    and load, kg.m2 at the output (`Masses.reduced_inertia`). The result's limit is the longest step that is allowed.
    Raises `InputError` for kind `joint`, which contains its masses, and for a step or an inertia that is not positive.
    """
    expect_inertia(inertia, "--inertia")
    file = read_archive(path)
    if step is None:
        step = proposed_step(file)
    expect_step(step, "--step")
    expect(file.kind == "drive", "--step and --inertia with an FMU of kind drive", f"kind {file.kind}", str(path))
    spring = stiffness_at_full_torque(embedded_component(file))
    limit = largest_step(spring, inertia, growth=MAX_GROWTH_RATE)
    rate = growth_rate(step, spring, inertia)
    in_turn = largest_step(spring, inertia, scheme="sequential")
    detail = (
        f"s; {quantity_text(spring, 'N.m/rad', 3)} and {inertia:.3g} kg.m2 oscillate at "
        f"{math.sqrt(spring / inertia) / (2 * math.pi):.3g} Hz, which a master that holds the torque over a step "
        f"lets grow by exp({rate:.3g} t/s). Stepping the masses first allows {in_turn:.2g} s, one that uses "
        "`stiffness` or directional derivatives stays stable at any step, kind joint stays right"
    )
    return CheckResult("coupling", step <= limit, step, limit, detail)
