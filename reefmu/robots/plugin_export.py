"""Export of a drive as a MuJoCo plugin: a folder with the library, the model of one joint, a description, the sources.

The folder's name is the plugin's: exported to `shoulder`, a drive is "reefmu.shoulder" in MJCF.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reefmu.fmu.codegen.compile import compile_for_host
from reefmu.fmu.metadata import LICENCE, package_version
from reefmu.fmu.model.joint_equations import maximum_stiffness
from reefmu.model.masses import TYPICAL_MASSES, Masses, expect_step
from stiffness_model.errors import expect
from stiffness_model.io.atomic_files import replaced_folder

from .mjcf import joint_model
from .mujoco_library import MujocoLibrary, find_mujoco
from .plugin_sources import TEMPERATURE, make_plugin_sources
from .twist_inertia import twist_armature

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel

MANIFEST, JOINT_MODEL, SOURCES, MODEL = "drive.json", "joint.xml", "sources", "model.toml"
"""The names of an export's files and folder, beside the library."""
TIME_STEP = 2e-3
"""s: MuJoCo's default time step, for which the joint of an export is stable if no other is given."""


def plugin_name(folder: Path) -> str:
    """The name under which the drive of this folder is registered. Raises `InputError` for a folder without letters."""
    word = re.sub(r"[^A-Za-z0-9_]+", "_", folder.resolve().name).strip("_")
    expect(
        bool(word), "a folder whose name has letters or digits, after which the plugin is named", str(folder), "plugin"
    )
    return f"reefmu.{word}"


def export_mujoco(
    model: DriveModel,
    folder: str | os.PathLike[str],
    *,
    masses: Masses = TYPICAL_MASSES,
    step: float = TIME_STEP,
) -> Path:
    """Write `model` as a MuJoCo plugin for this machine into `folder`, and return the folder.

    masses, step: inertias, motor damping and time step, s, of the joint in the file `JOINT_MODEL`; the library works
    with any. A folder of an earlier export is replaced as a whole. Raises `InputError` without MuJoCo or a C compiler,
    for a folder with other files, and for a damping of the load, which is an effect of the drive here.
    """
    target, installed = Path(folder), find_mujoco()
    expect_step(step, "step")
    expect(
        masses.load_damping == 0,
        "no damping of the load, for the effect viscous_friction damps the output",
        masses.load_damping,
        "load_damping",
    )
    plugin = plugin_name(target)
    with replaced_folder(target, MANIFEST) as stage:
        sources = make_plugin_sources(model, plugin)
        library = compile_for_host(sources, plugin, installed.include, installed.library)
        described = _describe(model, plugin, installed)
        (stage / described["library"]).write_bytes(library)
        (stage / MANIFEST).write_text(json.dumps(described, indent=1) + "\n", "utf-8")
        attributes = {name: (a["value"], a["unit"]) for name, a in described["attributes"].items()}
        armature = twist_armature(described["max_stiffness"], step)
        text = joint_model(plugin, described["ratio"], masses, step, armature, attributes)
        (stage / JOINT_MODEL).write_text(text, "utf-8")
        from reefmu.model.model_file import save_model

        save_model(model, stage / MODEL)
        (stage / SOURCES).mkdir()
        for name, content in sources.items():
            (stage / SOURCES / name).write_bytes(content)
    return target


def _describe(model: DriveModel, plugin: str, installed: MujocoLibrary) -> dict[str, Any]:
    """The content of `MANIFEST`, in SI units."""
    values = {p.name: p for p in model.parameters}
    suffix = ".dylib" if installed.library.suffix == ".dylib" else ".so"
    temperature = {"value": 20.0, "unit": "degC", "minimum": -273.15, "maximum": 1000.0}
    return {
        "plugin": plugin,
        "library": f"{plugin.removeprefix('reefmu.')}{suffix}",
        "drive": model.name,
        "mujoco": installed.version,
        "reefmu": package_version("reefmu"),
        "licence": LICENCE,
        "ratio": values["ratio"].value,
        "max_stiffness": maximum_stiffness(model),
        "full_torque": model.full_torque,
        "attributes": {
            TEMPERATURE: temperature | {"description": "Temperature of the drive"},
            **{
                p.name: {
                    "value": p.value,
                    "unit": p.unit,
                    "minimum": p.minimum,
                    "maximum": p.maximum,
                    "description": p.description,
                }
                for p in model.parameters
                if p.tunable
            },
        },
        "outputs": {signal.name: {"unit": signal.unit, "description": signal.description} for signal in model.outputs},
    }
