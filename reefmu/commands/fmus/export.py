"""`reefmu export`: a drawing or a model becomes an FMU, or a plugin of a robot simulator."""

from __future__ import annotations

import argparse
import zipfile
from collections.abc import Sequence
from pathlib import Path

from reefmu.fmu.codegen.compile import select_platforms
from reefmu.fmu.export import NO_COMPILER, default_backend, export_fmu
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.presets import loaded_start
from reefmu.fmu.python_backend.real_time import real_time_note
from reefmu.fmu.ssp.export_ssp import export_ssp
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import TYPICAL_MASSES, Masses, expect_step
from reefmu.model.model_file import is_model_file, load_model
from stiffness_model.errors import InputError, expect
from stiffness_model.lookup.build_lookup import N_DRIVES, describe
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.units import ARCMIN

from ..terminal.drawing_input import drawing_with_fields
from ..terminal.notes import show_notes
from ..terminal.worker_processes import pool_with_progress
from .coupling_step import step_notes
from .effect_values import effect_values

STEP = 1e-3
"""s: communication step of an FMU that warnings are about, where none is given; chosen by judgement."""


def run(args: argparse.Namespace) -> int:
    """Write the FMU and print what it contains."""
    if args.to == "mujoco":
        from .simulator_plugin import export_plugin

        return export_plugin(args, lambda: _model(args))
    args.step = STEP if args.step is None else args.step
    target = Path(args.output)
    suffix = ".ssp" if args.ssp else ".fmu"
    expect(target.suffix == suffix, f"a file name that ends in {suffix}", str(target), "--output")
    expect(target.parent.is_dir(), "an existing folder for the FMU", str(target.parent), "--output")
    expect_step(args.step, "--step")
    platform, fmi = args.platform or "host", f"{args.fmi}.0"
    backend = args.backend or default_backend(platform, fmi)
    native = backend == "native"
    expect(native or args.platform is None, "--platform without --backend python", args.platform, "--platform")
    expect(native or args.fmi == "2", "--fmi 3 without --backend python", f"--backend {backend}", "--fmi")
    expect(not args.ssp or args.fmi == "2", "--ssp without --fmi 3, which SSP 1.0 does not know", "--fmi 3", "--ssp")
    expect(not args.ssp or args.load is None, "--ssp without --load, for its sets start unloaded", args.load, "--load")
    if args.platform not in (None, "none"):
        select_platforms(args.platform)  # an unknown name is refused before the lookup is solved
    masses = _masses(args)
    model, notes = _model(args)
    joint = args.kind == "joint"
    inside = masses if joint else None
    step = None
    if args.ssp:
        step = export_ssp(model, target, backend=backend, platform=platform, masses=inside)
    else:
        export_fmu(model, target, backend=backend, platform=platform, masses=inside, fmi=fmi, load=args.load)
    if masses is not None and not joint:
        notes += step_notes(drive_component(model), masses, args.step)
    if not native:
        component = joint_component(model, masses) if joint and masses is not None else drive_component(model)
        notes += ([] if args.backend else [NO_COMPILER]) + real_time_note(component, args.step)
    if (
        joint
        and isinstance(model.lookup, CurveLookup)
        and (inertia := model.lookup.drawing.get("drive", {}).get("inertia"))
    ):
        notes.append(f"motor.inertia does not include the inertia at the input that the data sheet states, {inertia}")
    show_notes(notes)
    print(
        f"{model.name}: "
        + (
            f"lookup over {describe(model.lookup)}"
            if model.lookup.has_contacts
            else f"curve over twist +-{model.lookup.twist.stop / ARCMIN:.3g} arcmin"
        )
    )
    if model.lacks:
        print(model.lacks)
    if model.individual is not None:
        print("one virtual drive with its own balls, bores and lobes; the lookup limits its range of twists")
    if args.load is not None:
        component = drive_component(model) if inside is None else joint_component(model, inside)
        print(_start_text(component, args.load))
    inside = ", ".join(effect.name for effect in model.effects) or "none"
    print(f"effects inside: {inside}")
    if step is not None:
        print(f"written to {target}: {_system_text(target, args.kind, step)}")
        return 0
    fmi_types = "co-simulation and model exchange" if native else "co-simulation"
    binaries = [name.split("/")[1] for name in read_archive(target).members if name.startswith("binaries/")]
    needs = (
        f"for {', '.join(sorted(binaries)) or 'no platform, sources alone'}"
        if native
        else "its host needs Python with reefmu, and one in C libpython"
    )
    print(
        f"written to {target}: FMI {args.fmi}.0 {fmi_types}, kind {args.kind}, "
        f"{target.stat().st_size / 1024:.0f} kB; {needs}"
    )
    return 0


def _start_text(component: Component, load: float) -> str:
    """The start values of the parameter set loaded.ssv."""
    units = {p.name: p.unit for p in component.parameters} | {s.name: s.unit for s in component.inputs}
    values = ", ".join(f"{name} = {value:.6g} {units[name]}" for name, value in loaded_start(component, load).items())
    return f"starts under {load:g} N.m on the output with loaded.ssv: {values}"


def _system_text(path: Path, kind: str, step: float) -> str:
    """What an SSP contains, and the communication step that suits it."""
    with zipfile.ZipFile(path) as archive:
        sets = [name.removeprefix("resources/")[:-4] for name in archive.namelist() if name.endswith(".ssv")]
    inside = "the joint connected with a controller of its motor" if kind == "joint" else "the drive"
    return (
        f"SSP 1.0, {inside}, {path.stat().st_size / 1024:.0f} kB; communication step {step:g} s; "
        f"parameter sets {', '.join(sets)}"
    )


def _masses(args: argparse.Namespace) -> Masses | None:
    """Motor and load, of a joint or around a drive; None for a drive whose masses the call does not state."""
    given = {
        name: getattr(args, name)
        for name in ("motor_inertia", "load_inertia", "motor_damping", "load_damping")
        if getattr(args, name) is not None
    }
    if args.kind == "drive" and not given:
        return None
    return Masses(
        **{"motor_inertia": TYPICAL_MASSES.motor_inertia, "load_inertia": TYPICAL_MASSES.load_inertia, **given}
    )


def _ratio_of_curve(fields: Sequence[tuple[str, str]]) -> float | None:
    """The ratio that `--set ratio=...` gives a model file of a curve, the only field that it may lack."""
    others = [f"{name}={value}" for name, value in fields if name != "ratio"]
    expect(
        not others, "no --set beside a model file, which contains its drawing, but ratio of a [curve]", others, "--set"
    )
    if not fields:
        return None
    text = fields[-1][1]
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--set ratio: expected a number, crank to output with its sign, got {text!r}") from None


def _model(args: argparse.Namespace) -> tuple[DriveModel, list[str]]:
    """The model of a drawing with the effects of `--effect`, or that of a model.toml, and notes on it."""
    with pool_with_progress("solving the lookup") as executor:
        if is_model_file(args.source):
            expect(
                not args.effect, "no --effect beside a model file, which states its effects", args.effect, "--effect"
            )
            expect(
                args.individual is None,
                "no --individual beside a model file, which states its own",
                args.individual,
                "--individual",
            )
            return load_model(args.source, executor=executor, ratio=_ratio_of_curve(args.fields)), []
        effects = effect_values(args.effect)
        drive, notes = drawing_with_fields(args.source, args.fields)
        return build_model(
            drive,
            effects,
            n_drives=args.drives or N_DRIVES,
            seed=args.seed,
            executor=executor,
            individual=args.individual,
        ), notes
