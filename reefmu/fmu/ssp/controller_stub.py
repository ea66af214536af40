"""The FMU of a simple controller of the motor, to be replaced by the user's own.

It is compiled from `native/controller` and the same functions of FMI as a drive's FMU.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, replace

from reefmu.model.masses import Masses

from ..codegen.compile import Platform, compile_binaries
from ..codegen.sources import MAIN_SOURCE, function_prefix, variable_row, wrapper_files
from ..metadata import NATIVE_CAPABILITIES
from ..model.nominals import Experiment
from ..model.variables import BLOCKS, FMI2, Causality, Interface, Variable
from ..xml.archive import DESCRIPTION
from ..xml.description import ExportInfo
from ..xml.fmi2 import model_description

IDENTIFIER = "controller"
REFERENCE = 0.1
"""Start value of the reference, rad, so that the system moves as soon as it runs. Chosen by judgement."""
DAMPING_SHARE = 0.2
"""Share of the motor's speed that the controller's damping takes in one step. With the torque of the step before, 1 is
the limit of stability; the margin is chosen by judgement."""
_SHARED = ("instance.h", "variable.h")
"""The files of `native/model` that the controller uses."""


@dataclass(frozen=True)
class Gains:
    """stiffness: N.m/rad; damping: N.m.s/rad, both at the crank; limit: greatest torque of the motor, N.m."""

    stiffness: float
    damping: float
    limit: float


def choose_gains(masses: Masses, ratio: float, step: float, full_torque: float) -> Gains:
    """Gains for a critically damped motion of motor and load as one inertia J, at the crank.

    The damping follows from the communication step, s (`DAMPING_SHARE`), the stiffness from
    damping = 2 sqrt(stiffness J). limit: full_torque, N.m at the output, through the ratio.
    """
    inertia = masses.motor_inertia + masses.load_inertia / ratio**2
    damping = DAMPING_SHARE * masses.motor_inertia / step
    return Gains(damping**2 / (4 * inertia), damping, full_torque / abs(ratio))


def controller_interface(gains: Gains, ratio: float) -> Interface:
    """The variables of the controller."""
    rows: tuple[tuple[str, Causality, str, str, float, float | None, float], ...] = (
        ("crank.phi", "input", "rad", "Angle of the crank and the motor", 0.0, None, 1.0),
        ("crank.w", "input", "rad/s", "Speed of the crank and the motor", 0.0, None, 10.0),
        ("motor.tau", "output", "N.m", "Torque of the motor on the crank", 0.0, None, gains.limit),
        ("reference", "parameter", "rad", "Angle of the output that the controller shall reach", REFERENCE, None, 1.0),
        ("ratio", "parameter", "1", "Transmission ratio, crank to output, signed", ratio, None, abs(ratio)),
        ("stiffness", "parameter", "N.m/rad", "Torque per angle of the crank", gains.stiffness, 0.0, 1.0),
        ("damping", "parameter", "N.m.s/rad", "Torque per speed of the crank", gains.damping, 0.0, 1.0),
        ("limit", "parameter", "N.m", "Greatest torque of the motor", gains.limit, 0.0, 1.0),
    )
    inputs = tuple(row[0] for row in rows if row[1] == "input")
    parameters = tuple(row[0] for row in rows if row[1] == "parameter")
    variables = [
        Variable(k, name, causality, "continuous", unit, text, start, low, None, nominal)
        for k, (name, causality, unit, text, start, low, nominal) in enumerate(rows)
    ]
    return Interface(
        "controller",
        IDENTIFIER,
        tuple(
            replace(v, start=None, dependencies=inputs, initial_dependencies=inputs + parameters)
            if v.causality == "output"
            else replace(v, variability="tunable")
            if v.causality == "parameter"
            else v
            for v in variables
        ),
    )


def controller_members(
    interface: Interface, experiment: Experiment, drive: ExportInfo, platforms: Sequence[Platform]
) -> dict[str, bytes]:
    """The archive of the controller's FMU. drive: of the drive's FMU, whose author and versions it repeats."""
    sources = _sources(interface, "")
    digest = hashlib.sha256(repr((interface, experiment, drive.version)).encode())
    for name, content in sorted(sources.items()):
        digest.update(name.encode() + content)
    guid = f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"
    export = replace(
        drive,
        guid=guid,
        model_identifier=IDENTIFIER,
        description="Proportional-derivative controller of a motor with a bounded torque, a placeholder for your own. "
        "Inputs are held constant over a communication step.",
        backend="native",
        capabilities=NATIVE_CAPABILITIES,
        experiment=experiment,
        exchange=None,
        indicators=0,
        sources=(MAIN_SOURCE,),
    )
    sources = _sources(interface, guid)
    return {
        DESCRIPTION: model_description(interface, export),
        **{f"sources/{name}": content for name, content in sources.items()},
        **compile_binaries(sources, IDENTIFIER, platforms),
    }


def _sources(interface: Interface, guid: str) -> dict[str, bytes]:
    files = wrapper_files("fmi2", "controller")
    files = {name: content for name, content in files.items() if name not in ("fmi2_all.c", "fmi2_model_exchange.c")}
    shared = wrapper_files("model")
    files |= {name: shared[name] for name in _SHARED}
    files[MAIN_SOURCE] = files.pop("controller_all.c")
    files["tables.h"] = b"/* The controller has no tables. */\n"
    files["model.h"] = _header(interface, guid).encode()
    return files


def _header(interface: Interface, guid: str) -> str:
    """`model.h` of the controller: sizes and variables, and none of the contacts of a drive."""
    counts: dict[Causality, int] = {block: len(interface.block(block)) for block in BLOCKS}
    numbers = {
        "N_INPUTS": counts["input"],
        "N_OUTPUTS": counts["output"],
        "N_PARAMETERS": counts["parameter"],
        "N_STATES": 0,
        "N_VALUES": len(interface.variables),
        "N_UNKNOWNS": counts["output"],
        "N_KNOWNS": counts["input"] + counts["parameter"],
        "N_INDICATORS": 0,
        "HAS_CONTACT_FUNCTION": 1,  # without tables
        "HAS_ELEMENT": 0,
        "FIRST_REFERENCE": FMI2.first_reference,
        **dict.fromkeys(("N_INTEGERS", "N_WORK", "N_CONTACT_POINT", "N_COEFFICIENTS", "N_CONTACT"), 1),
    }
    defines = "".join(f"#define {name} {value}\n" for name, value in numbers.items())
    names = ", ".join(v.name.replace(".", "_").upper() for v in interface.variables)
    rows = "".join(variable_row(v, counts) for v in interface.variables)
    return (
        "/* controller: sizes and variables. Generated. */\n\n"
        '#ifndef MODEL_H\n#define MODEL_H\n\n#include "variable.h"\n\n'
        f'{function_prefix(IDENTIFIER, FMI2)}#define MODEL_GUID "{guid}"\n{defines}\nenum {{ {names} }};\n\n'
        f"static const Variable VARIABLES[N_VALUES] = {{\n{rows}}};\n\n#endif\n"
    )
