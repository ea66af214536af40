"""`reefmu export --to mujoco`: a drawing or a model as a plugin of the robot simulator MuJoCo."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from reefmu.fmu.codegen.compile import has_compiler
from reefmu.fmu.model.joint_equations import maximum_stiffness
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import TYPICAL_MASSES, Masses
from reefmu.robots.mujoco_library import find_mujoco
from reefmu.robots.plugin_export import JOINT_MODEL, TIME_STEP, export_mujoco, plugin_name
from reefmu.robots.twist_inertia import largest_time_step
from stiffness_model.errors import expect, install_command

from ..terminal.notes import show_notes

_OF_FMUS = {"ssp": False, "kind": "drive", "backend": None, "platform": None, "fmi": "2", "load": None}
"""Options of FMUs, with the value they have where they are not given."""


def export_plugin(args: argparse.Namespace, build: Callable[[], tuple[DriveModel, list[str]]]) -> int:
    """Write the folder of the plugin and print what it contains. build: the model of the call, and notes on it."""
    target, step = Path(args.output), args.step or TIME_STEP
    for name, default in _OF_FMUS.items():
        given = getattr(args, name)
        value = "it" if given is True else given
        expect(given == default, f"--to mujoco without --{name}, which is for FMUs", value, f"--{name}")
    expect(target.suffix != ".fmu", "a folder for the plugin", str(target), "--output")
    masses = Masses(
        TYPICAL_MASSES.motor_inertia if args.motor_inertia is None else args.motor_inertia,
        TYPICAL_MASSES.load_inertia if args.load_inertia is None else args.load_inertia,
        args.motor_damping or 0.0,
    )
    # Refused before the lookup is solved.
    plugin_name(target)
    installed = find_mujoco()
    expect(has_compiler(), f"a C compiler ({install_command('native')} brings one)", "none", "--to mujoco")
    expect(
        not args.load_damping,
        "no damping of the load, for --effect viscous_friction.coefficient=... damps the output",
        args.load_damping,
        "--load-damping",
    )
    model, notes = build()
    export_mujoco(model, target, masses=masses, step=step)
    show_notes(notes)
    stiffness = maximum_stiffness(model)
    inertia = masses.reduced_inertia(model.parameters[0].value)
    print(f"{model.name}: plugin {plugin_name(target)} for MuJoCo {installed.version}, on this kind of machine")
    print(f"effects inside: {', '.join(effect.name for effect in model.effects) or 'none'}")
    print(
        f"at the time step of {step:g} s {target / JOINT_MODEL} is stable for any robot; without its added inertia the "
        f"largest stable step would be {largest_time_step(stiffness, inertia):.2g} s with these inertias"
    )
    print(f"written to {target}")
    return 0
