"""`reefmu export`: a drawing or a model becomes an FMU."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from reefmu.curve_table import curve_of
from reefmu.fmu.archive import read_archive
from reefmu.fmu.build import export_fmu
from reefmu.fmu.component import drive_component
from reefmu.fmu.platforms import chosen_platforms
from reefmu.fmu.trial import full_twist
from reefmu.joint.step import step_warning
from reefmu.masses import Masses
from reefmu.model import DriveModel, build_model
from reefmu.model_file import is_model_file, load_model
from stiffness_model.errors import expect
from stiffness_model.lookup import N_DRIVES, describe
from stiffness_model.units import ARCMIN

from . import study

MOTOR_INERTIA, LOAD_INERTIA = 1e-4, 1.0
"""kg.m2: what a joint's parameters start from unless told; the host may set others."""


def run(args: argparse.Namespace) -> int:
    """Write the FMU and print what it holds."""
    target = Path(args.output)
    expect(target.suffix == ".fmu", "a file name that ends in .fmu", str(target), "--output")
    expect(target.parent.is_dir(), "an existing folder for the FMU", str(target.parent), "--output")
    native = args.backend == "native"
    expect(native or args.platform is None, "--platform with --backend native only", args.platform, "--platform")
    if args.platform not in (None, "none"):
        chosen_platforms(args.platform)  # an unknown name is refused before the lookup is solved
    masses = masses_of(args)
    model, notes = load(args)
    joint = args.kind == "joint"
    export_fmu(model, target, backend=args.backend, platform=args.platform or "host", masses=masses if joint else None)
    if masses is not None and not joint:
        notes += step_notes(model, masses, args.step)
    study.show_notes(notes)
    print(f"{model.name}: " + (f"lookup over {describe(model.lookup)}" if curve_of(model.lookup) is None else
                               f"curve over twist +-{model.lookup.twist.stop / ARCMIN:.3g} arcmin, no drawing"))
    inside = ", ".join(effect.name for effect in model.effects) or "none"
    print(f"effects inside: {inside}")
    way = "co-simulation and model exchange" if native else "co-simulation"
    binaries = [name.split("/")[1] for name in read_archive(target).members if name.startswith("binaries/")]
    needs = f"for {', '.join(sorted(binaries)) or 'no platform, sources alone'}" if native else \
        "its host needs Python with reefmu"
    print(f"written to {target}: FMI 2.0 {way}, kind {args.kind}, {target.stat().st_size / 1024:.0f} kB; {needs}")
    return 0


def masses_of(args: argparse.Namespace) -> Masses | None:
    """Motor and load, of a joint or around a drive; None for a drive about whose surroundings nothing is said."""
    given = {name: getattr(args, name) for name in ("motor_inertia", "load_inertia", "motor_damping", "load_damping")
             if getattr(args, name) is not None}
    if args.kind == "drive" and not given:
        return None
    return Masses(**{"motor_inertia": MOTOR_INERTIA, "load_inertia": LOAD_INERTIA, **given})


def step_notes(model: DriveModel, masses: Masses, step: float) -> list[str]:
    """What to say of a communication step, s, between the drive and these masses: one line, or none if it will do.

    With the stiffness at full torque, where the joint oscillates fastest.
    """
    component = drive_component(model)
    twist = full_twist(component)
    inputs, p = [0.0, 0.0, -twist, 0.0, 20.0], model.parameter_vector()
    outputs = np.asarray(model.output(model.initial(inputs, p), inputs, p)).ravel()
    stiffness = float(outputs[[signal.name for signal in component.outputs].index("stiffness")])
    warning = step_warning(step, stiffness, masses.reduced_inertia(p[0]))
    return [warning] if warning else []


def load(args: argparse.Namespace) -> tuple[DriveModel, list[str]]:
    """The model that a drawing or a model.toml asks for, with the effects of `--effect`, and notes on it."""
    with study.all_cores("solving the lookup") as executor:
        if is_model_file(args.source):
            expect(not args.effect, "no --effect beside a model file, which names its own", args.effect, "--effect")
            return load_model(args.source, executor=executor), []
        drive, notes = study.read_drawing(args.source)
        return build_model(drive, {name: {} for name in args.effect}, n_drives=args.drives or N_DRIVES,
                           seed=args.seed, executor=executor), notes
