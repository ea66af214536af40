"""Export of a drive, or of a joint connected with a controller, as an SSP file with sets of parameters."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from reefmu.source_date import source_date
from stiffness_model.errors import expect, install_command
from stiffness_model.io.atomic_files import scratch_folder

from ..codegen.compile import select_platforms
from ..export import fmu_content
from ..metadata import RELEASE_DATE
from ..model.nominals import Experiment, eigenfrequency, rounded_down
from ..model.presets import presets
from ..model.variables import Interface, Variable
from ..xml.archive import write_archive
from ..xml.parameter_values import parameter_set
from .controller_stub import IDENTIFIER, choose_gains, controller_interface, controller_members
from .system_structure import (
    RESOURCES,
    STRUCTURE,
    Connection,
    FmuComponent,
    connect_outside,
    system_structure,
)

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses

STEP_PHASE = 0.5
"""Phase, rad, of the joint's oscillation in one communication step. The controller's torque comes up to two steps late;
at a quarter of a turn it would excite the oscillation instead of damping it. Chosen by judgement."""
DURATION = 1.0
"""Stop time of a system's experiment, s. Chosen by judgement: a typical move of a robot joint."""


def export_ssp(
    model: DriveModel,
    path: str | os.PathLike[str],
    *,
    backend: str | None = None,
    platform: str = "host",
    masses: Masses | None = None,
) -> float:
    """Write `model` as a system to `path`, and return the communication step, s, to run the system with.

    masses: None for the drive alone, with its inputs and outputs as connectors of the system; inertias and dampings for
    a joint that is connected with a controller of its motor. The inputs `load.tau` and, where no effect reads it,
    `temperature` have no connectors and keep their start values. The folder `resources` has one SSV file for each of
    `presets`; the system is bound to `mean.ssv`. backend, platform: as of `export_fmu`. The FMUs are for FMI 2.0,
    because SSP 1.0 knows no later version.
    Errors: as `export_fmu`; `InputError` for a joint without a compiler, because the controller is compiled.
    """
    content = fmu_content(model, backend=backend, platform=platform, masses=masses)
    expect(
        masses is None or content.export.backend == "native",
        f"a C compiler for the controller of a joint ({install_command('native')} brings one), or --kind drive",
        f"back end {content.export.backend}",
        "--ssp",
    )
    kind, date = content.interface.kind, source_date(RELEASE_DATE)
    connectors = (*(v for v in content.interface.block("input") if _is_connected(v, content.interface)),)
    connectors += content.interface.block("output")
    drive = FmuComponent(kind, f"{content.export.model_identifier}.fmu", content.export.description, connectors)
    experiment = content.export.experiment
    files = {drive.file: content.members}
    components, connections = [drive], connect_outside(drive)
    if masses is not None:
        ratio = content.interface["ratio"].start or 1.0
        step = rounded_down(STEP_PHASE / eigenfrequency(content.component, masses))
        experiment = Experiment(DURATION, step, experiment.tolerance)
        controller = controller_interface(choose_gains(masses, ratio, step, model.full_torque), ratio)
        platforms = () if platform == "none" else select_platforms(platform)
        files[f"{IDENTIFIER}.fmu"] = controller_members(controller, experiment, content.export, platforms)
        stub = FmuComponent(
            IDENTIFIER,
            f"{IDENTIFIER}.fmu",
            "Controller of the motor, a placeholder",
            (*controller.block("input"), *controller.block("output")),
        )
        components = [drive, stub]
        connections = [
            Connection(kind, "crank.phi", IDENTIFIER, "crank.phi"),
            Connection(kind, "crank.w", IDENTIFIER, "crank.w"),
            Connection(IDENTIFIER, "motor.tau", kind, "motor.tau"),
        ]
    units = {v.name: v.unit for v in content.interface.variables}
    sets = presets(content.component)
    members = {
        STRUCTURE: system_structure(
            model.name, components, connections, experiment, content.export, f"{sets[0].name}.ssv"
        ),
        **{f"{RESOURCES}/{p.name}.ssv": parameter_set(p, units, content.export, f"{kind}.") for p in sets},
    }
    with scratch_folder() as folder:
        for name, archive in files.items():
            members[f"{RESOURCES}/{name}"] = write_archive(folder / name, archive, date).read_bytes()
    write_archive(path, members, date)
    return experiment.step_size


def _is_connected(variable: Variable, interface: Interface) -> bool:
    """Whether an input becomes a connector.

    One that nothing is connected with must not: FMPy 0.3 sets it to the value of another connector.
    """
    if variable.name == "temperature":
        return any(variable.name in (*v.dependencies, *v.initial_dependencies) for v in interface.variables)
    return variable.name != "load.tau"
