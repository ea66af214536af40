"""The folder `documentation` of an FMU, and its icon."""

from __future__ import annotations

import importlib.metadata
import importlib.resources
from html import escape
from pathlib import Path

from ..metadata import package_version
from ..model.component import Component, drive_component
from ..model.start.start_parameters import PREFIX, START_TORQUE, START_TWIST
from ..model.variables import Interface
from ..python_backend.dependencies import external_dependencies
from ..xml.description import ExportInfo
from .drive_page import drive_page

ICON = "model.png"
"""The icon of FMI 2.0 (FMI 2.0.4, section 2.3); FMI 3.0 has another place for it."""


def documentation(
    component: Component, interface: Interface, export: ExportInfo, module: bytes | None
) -> dict[str, bytes]:
    """The members of the archive by name.

    module: of `compile_module` for the drive without its start (`drive_component`), which the page runs; None for a
    page that does not run the drive.
    """
    drive = drive_component(component.model, start=False)
    page = drive_page(
        drive,
        interface,
        export.description,
        module,
        [_start(interface), _advice(interface, export), _related_files(), _licence(export)],
    )
    members = {
        "documentation/index.html": page.encode(),
        ICON: (importlib.resources.files("reefmu.fmu.documentation") / "icon.png").read_bytes(),
    }
    if export.capabilities["needsExecutionTool"]:
        members |= external_dependencies(export.version, package_version("casadi"), package_version("pythonfmu"))
    # "license" is the name that the standard gives to the licence of the whole FMU (FMI 2.0.4, section 2.3; FMI 3.0.2,
    # section 2.5.1).
    names = {"reefmu": "license", "pythonfmu": "pythonfmu"}
    for package in names if export.backend == "python" else ("reefmu",):
        try:
            files = importlib.metadata.files(package) or []
        except importlib.metadata.PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE") and ".dist-info" in str(file):
                members[f"documentation/licenses/{names[package]}.txt"] = Path(str(file.locate())).read_bytes()
    return members


def _advice(interface: Interface, export: ExportInfo) -> str:
    step = f"{export.experiment.step_size:g}"
    text = (
        "The joint divides a communication step into as many substeps as its oscillation needs, so that a step may "
        f"have any length. Its proposed step, {step} s, is short enough for an integrator with a fixed step in model "
        "exchange."
        if interface.kind == "joint"
        else "Inputs are held over a step, and the outputs after it belong to the inputs before it: a master that "
        "steps masses and drive in parallel feeds energy into their oscillation, which grows at the rate "
        f"3/4 omega^2 h. With the proposed step h = {step} s and typical masses it grows by less than a factor of e in "
        "a second. "
        "A master that steps the masses first, one that uses <code>stiffness</code> or directional derivatives, and "
        "kind <code>joint</code> allow longer steps; <code>reefmu check FILE.fmu --inertia J --step H</code> says "
        "whether one is short enough."
    )
    return f"<h2>Communication step</h2>\n<p>{text}</p>\n"


def _start(interface: Interface) -> str:
    states = {f"{PREFIX}{v.name}" for v in interface.block("local")}
    effects = [v.name for v in interface.block("parameter") if v.name in states]
    torque = (
        "<code>output.phi</code> follows from <code>start.crank.phi</code>; <code>motor.tau</code> = "
        "-<code>crank.tau</code> of the start and <code>load.tau</code> = -<code>start.torque</code> hold the joint"
        if interface.kind == "joint"
        else f"the twist is counted from the angles at the start, by the constant state <code>{START_TWIST}</code>"
    )
    own = f"<p>States of effects start at {', '.join(f'<code>{escape(name)}</code>' for name in effects)}.</p>\n"
    return (
        f"<h2>Start</h2>\n<p>With <code>{START_TORQUE}</code> the drive starts in equilibrium under this torque on the "
        f"output, and stays at rest while it is held: {torque}. At 0 the angles give the torque. A torque that the "
        f"drive does not reach is refused at initialisation.</p>\n{own if effects else ''}"
    )


def _related_files() -> str:
    return (
        "<h2>Parameter sets and reference results</h2>\n<p>The folder <code>extra/org.fmi-standard.fmi-ls-ref</code> "
        "of the FMU holds sets of parameters (SSV): the mean and the percentiles of the population, each effect small "
        "and large, and a start in equilibrium under half the full torque. <code>loops.exp</code> describes an "
        "experiment with stimuli and results to compare with; <code>reefmu check</code> replays it.</p>\n"
    )


def _licence(export: ExportInfo) -> str:
    return (
        f"<h2>Origin and licence</h2>\n<p>Written by {escape(export.generation_tool)}. The code is "
        f"{escape(export.copyright)}, licence {escape(export.licence)} (<code>licenses/license.txt</code>); the model "
        "belongs to the owner of the drawing.</p>\n"
    )
