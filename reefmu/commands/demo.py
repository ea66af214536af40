"""`reefmu demo`: all steps for one drive, from its drawing to a joint under control."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from reefmu.fmu.export import NO_COMPILER, default_backend, export_fmu
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.joint import JointModel, Masses, cosimulate, largest_step, simulate_joint
from reefmu.joint.controller import Design, design_lqr, feedback
from reefmu.joint.plots import STEPS, picture_designs, picture_responses
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.catalog.gears import catalog
from stiffness_model.drawing.drive import Drive
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.lookup.build_lookup import describe
from stiffness_model.montecarlo.population import simulate
from stiffness_model.montecarlo.twist_torque_curve import TwistTorqueCurve
from stiffness_model.plotting import curves as plots
from stiffness_model.units import ARCMIN, quantity_text

from .drawings.population_run import TWISTS
from .terminal.drawing_input import read_drawing
from .terminal.notes import show_notes
from .terminal.worker_processes import pool_with_progress

DRIVE = "workshop"
DRIVES = 1000
MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
SAMPLE = 5e-4
"""s, the controller's sample time; chosen by judgement."""
STIFF_POINT = 100.0
"""N.m on the output, at which the stiffness of one of the two controllers is taken; chosen by judgement."""


def run(args: argparse.Namespace) -> int:
    """Take all steps, print their results, and write pictures, curve.csv and the FMU."""
    start = time.perf_counter()
    folder = Path("reefmu-demo" if args.out is None else args.out)
    with staged_folder(folder) as stage:
        drive = _drawing(stage, args.format)
        curve = _curve(drive, stage, args.format)
        model = _model(drive, curve)
        passed = _fmu(model, stage)
        _joint(model, stage, args.format)
    print(
        f"\nDone in {time.perf_counter() - start:.0f} s. In {folder}: "
        + ", ".join(sorted(path.name for path in folder.iterdir() if not path.name.startswith(".")))
    )
    return 0 if passed else 1


def _print_heading(title: str) -> None:
    print(f"\n{title}\n{'-' * len(title)}")


def _drawing(stage: Path, suffix: str) -> Drive:
    _print_heading("1  The drawing")
    drive, notes = read_drawing(DRIVE)
    print(
        f"{drive.name}: {drive.description}\n"
        f"{drive.elements} {drive.element}s of {2e3 * drive.element_radius:g} mm on {drive.eccentrics} eccentrics, "
        f"{drive.lobes} lobes, ratio {drive.ratio:g}; the profile exists for |beta| up to "
        f"{np.degrees(drive.usable_limit):.1f} deg"
    )
    show_notes(notes)
    plots.save(plots.gear_profile(drive), stage / f"1-gear.{suffix}")
    return drive


def _curve(drive: Drive, stage: Path, suffix: str) -> TwistTorqueCurve:
    _print_heading(f"2  {DRIVES} virtual drives")
    start = time.perf_counter()
    population = simulate(drive, np.linspace(0, drive.max_twist, TWISTS), DRIVES)
    seconds = time.perf_counter() - start
    curve = population.curve()
    print(
        f"{DRIVES * drive.elements} elements at {TWISTS} twists in {seconds:.2f} s\n"
        f"mean torque at {drive.max_twist / ARCMIN:g} arcmin {curve.full_torque:.0f} N.m, "
        f"lost motion {curve.lost_motion() / ARCMIN:.2f} arcmin"
    )
    curve.write_csv(stage / "curve.csv")
    plots.save(plots.twist_over_torque(curve), stage / f"2-curve.{suffix}")
    plots.save(plots.contact_forces(population), stage / f"2-forces.{suffix}")
    plots.save(plots.against_catalog(curve, catalog()), stage / f"2-compare.{suffix}")
    return curve


def _model(drive: Drive, curve: TwistTorqueCurve) -> DriveModel:
    _print_heading("3  The lookup")
    with pool_with_progress("solving the lookup (once: it is cached)") as executor:
        model = build_model(drive, {"hysteresis": {}}, executor=executor)
    twist = 0.75 * drive.max_twist
    print(
        f"{describe(model.lookup)}\n"
        f"stiffness {quantity_text(float(model.lookup.stiffness(0.0)), 'N.m/rad', 3)} at rest, "
        f"{quantity_text(float(model.lookup.stiffness(drive.max_twist)), 'N.m/rad', 3)} at full torque; "
        f"torque at {twist / ARCMIN:g} arcmin {model.lookup.torque(twist):.1f} N.m "
        f"(curve: {curve.torque_at(twist):.1f})"
    )
    return model


def _fmu(model: DriveModel, stage: Path) -> bool:
    _print_heading("4  The FMU")
    backend = default_backend()
    path = export_fmu(model, stage / f"{model.name}.fmu", backend=backend)
    show_notes([NO_COMPILER] if backend == "python" else [])
    report = check_fmu(path)
    fmi_types = "co-simulation and model exchange, compiled" if backend == "native" else "co-simulation, run by Python"
    print(f"{path.name}: {path.stat().st_size / 1024:.0f} kB, FMI 2.0 {fmi_types}, effect inside: hysteresis (neutral)")
    for result in report.results:
        print(f"  {result}")
    return report.passed


def _joint(model: DriveModel, stage: Path, suffix: str) -> None:
    _print_heading("5  A robot joint under control")
    plain = build_model(model.drive, lookup=model.lookup)
    joint = JointModel(plain, MASSES)
    designs = [
        design_lqr(joint, STIFF_POINT, SAMPLE, f"at {STIFF_POINT:g} N.m"),
        design_lqr(joint, 0.0, SAMPLE, "at rest"),
    ]
    picture_designs(joint, designs).savefig(stage / f"5-design.{suffix}")
    figure, oscillation = picture_responses(joint, designs)
    figure.savefig(stage / f"5-joint.{suffix}")
    small = next(iter(oscillation.values()))
    print(
        f"an LQR designed on {quantity_text(designs[0].stiffness, 'N.m/rad', 3)} ({designs[0].name}) leaves an "
        f"oscillation of {small[designs[0].name]:.2g} N.m in the drive after a small step;\n"
        f"designed on {quantity_text(designs[1].stiffness, 'N.m/rad', 3)} ({designs[1].name}) it settles: "
        f"{small[designs[1].name]:.1g} N.m"
    )
    _against_fmu(joint, designs[1], stage / f"{model.name}.fmu")


def _against_fmu(joint: JointModel, design: Design, path: Path) -> None:
    """Compare the loop with one around the FMU, and print the longest step of a parallel co-simulation master."""
    in_python = simulate_joint(joint, feedback(design, joint.ratio, STEPS[-1]), step=SAMPLE, duration=0.2)
    with_fmu = cosimulate(path, MASSES, feedback(design, joint.ratio, STEPS[-1]), step=SAMPLE, duration=0.2)
    difference = np.abs(in_python["output.phi"] - with_fmu["output.phi"]).max()
    stiffness = float(joint.drive.lookup.stiffness(joint.drive.drive.max_twist))
    longest = largest_step(stiffness, MASSES.reduced_inertia(joint.ratio))
    print(
        f"the same loop around the FMU, masses and FMU in turn every {1e3 * SAMPLE:g} ms: within "
        f"{1e6 * difference:.2g} urad\n"
        f"a master that only holds the FMU's torque over a step lets the joint's oscillation grow; for less than "
        f"a factor e per second its steps must stay below {1e6 * longest:.2g} us"
    )
