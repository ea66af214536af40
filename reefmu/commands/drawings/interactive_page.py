"""The page on which a drive runs, for `reefmu curve --interactive`."""

from __future__ import annotations

from pathlib import Path

from reefmu.fmu.codegen.sources import make_sources
from reefmu.fmu.documentation.drive_page import drive_page
from reefmu.fmu.documentation.web_assembly import compile_module
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.model.drive_model import build_model
from stiffness_model.errors import install_command
from stiffness_model.kinds import AnyDrive

from ..terminal.worker_processes import pool_with_progress

PAGE = "interactive.html"
EFFECTS = (
    "backlash",
    "structural_compliance",
    "creep",
    "hysteresis",
    "load_dependent_hysteresis",
    "damping",
    "coulomb_friction",
)
"""Effects that the page offers, neutral at first: those that show themselves in a loop with a locked crank. Chosen by
judgement."""
_DESCRIPTION = (
    "The drive as its drawing states it. The effects below are those that a real drive may add. They are zero at "
    "first: set hysteresis.torque, and run two loops."
)


def write_page(drive: AnyDrive, individual: int | None, folder: Path) -> list[str]:
    """Write `PAGE` into `folder`; return notes on it. individual: seed of one virtual drive, None for the mean."""
    with pool_with_progress("solving the lookup") as executor:
        effects: dict[str, dict[str, float]] = {name: {} for name in EFFECTS}
        model = build_model(drive, effects, executor=executor, individual=individual)
    component = drive_component(model, start=False)
    interface = declare_with_derivatives(component)
    module = compile_module(make_sources(component, interface, "", "web"))
    (folder / PAGE).write_text(drive_page(component, interface, _DESCRIPTION, module), "utf-8")
    return (
        []
        if module is not None
        else [f"{PAGE} does not run the drive, because ziglang is not installed: {install_command('native')}"]
    )
