"""The C sources of a MuJoCo plugin: those of a native FMU of kind `drive`, with MuJoCo's callbacks around them.

`plugin.h` is generated: the name, the configuration attributes (temperature and the model's tunable parameters), the
greatest stiffness, and for every state the path that it follows.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from reefmu.fmu.codegen.sources import MAIN_SOURCE, make_sources, wrapper_files
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.fmu.model.joint_equations import maximum_stiffness

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel

PLUGIN_MAIN = "mujoco_all.c"
TEMPERATURE = "temperature"
"""The attribute that holds the drive's temperature, degC, which is constant over a simulation."""
_PATHS = ("none", "twist", "crank", "output")
"""What states may evolve along; "none" is time."""
_FMI_TYPES = "fmi2_api.h"
"""The one header of the FMI layer that the model's own code includes, for its types."""


def make_plugin_sources(model: DriveModel, plugin: str) -> dict[str, bytes]:
    """The C files of the plugin, by name; `MAIN_SOURCE` is the one to compile. plugin: the name to register."""
    component = drive_component(model, start=False)
    files = make_sources(component, declare_with_derivatives(component), "", "reefmu")
    dropped = set(wrapper_files("fmi2")) - {_FMI_TYPES}
    files = {name: content for name, content in files.items() if name not in dropped} | wrapper_files("mujoco")
    files[MAIN_SOURCE] = files.pop(PLUGIN_MAIN)
    files["plugin.h"] = _plugin_header(component, plugin).encode()
    return files


def attribute_names(model: DriveModel) -> tuple[str, ...]:
    """The configuration attributes of a plugin instance; their values are numbers in SI units and degC."""
    return (TEMPERATURE, *(p.name for p in model.parameters if p.tunable))


def _plugin_header(component: Component, plugin: str) -> str:
    model = component.model
    paths, follows = _state_paths(model)
    outputs = [signal.name for signal in component.outputs]
    attributes = ", ".join(json.dumps(name) for name in attribute_names(model))
    numbers = {
        "PLUGIN_NAME": json.dumps(plugin),
        "MAX_STIFFNESS": maximum_stiffness(model),
        "FULL_TWIST": float(model.lookup.twist.stop),
        "RATIO_PARAMETER": [p.name for p in component.parameters].index("ratio"),
        "CRANK_OUTPUT": outputs.index("crank.tau"),
    }
    return (
        "/* The MuJoCo plugin of this drive: its name, attributes and stiffness. Generated. */\n\n"
        "#ifndef PLUGIN_H\n#define PLUGIN_H\n\n"
        + "".join(f"#define {name} {value}\n" for name, value in numbers.items())
        + f"\nenum {{ {', '.join(f'PATH_{name.upper()}' for name in _PATHS)}, N_PATHS }};\n"
        "/* The path along which a state evolves; whether its rate depends on its own value, as that of friction. */\n"
        f"static const int STATE_PATHS[N_STATES + 1] = {{{', '.join(map(str, (*paths, 0)))}}};\n"
        f"static const int STATE_FOLLOWS[N_STATES + 1] = {{{', '.join(map(str, (*follows, 0)))}}};\n"
        f"static const char *const ATTRIBUTES[] = {{{attributes}}};\n\n#endif\n"
    )


def _state_paths(model: DriveModel) -> tuple[list[int], list[int]]:
    """For every state the index of its path in `_PATHS`, and whether its rate depends on its own value."""
    import casadi as ca

    from reefmu.model.stages.expressions import DriveExpressions
    from reefmu.model.stages.order import stored_angles

    drive = DriveExpressions(model.lookup, model.effects, individual=model.individual is not None)
    signals = drive.signals._replace(elastic_torque=drive.c[0])
    stored = stored_angles(model.effects)
    states = [state for effect in model.effects for state in effect.states]
    rates = [
        state.equation(signals, drive.values[effect.name])[0] for effect in model.effects for state in effect.states
    ]
    kinds = [angle.value for angle in stored] + [state.independent_variable.value for state in states]
    paths = [_PATHS.index(kind) if kind in _PATHS else 0 for kind in kinds]
    return paths, [0] * len(stored) + [int(not ca.MX(rate).is_zero()) for rate in rates]
