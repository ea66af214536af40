"""Computing time of a drive in MuJoCo, per step, beside the same joint with a linear spring of MuJoCo's own.

    python -m tests.benchmarks.simulation.bench_mujoco [--rounds 30] [--joints 1]

The steps are run inside MuJoCo (`mj_step` with a count), so that Python takes no part. Rounds are short and alternate;
the best counts, because other work on the machine only adds.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.robots import add_drive, export_mujoco
from stiffness_model.lookup.build_lookup import build_lookup

STEPS = 2000
LINK = '<body pos=".3 0 0"><joint name="j{k}" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 .3 0 0"/>'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=30)
    parser.add_argument("--joints", type=int, default=1)
    args = parser.parse_args()
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)
    drive = sm.load_drive("drive_1")
    lookup = build_lookup(drive, n_drives=16)
    models = {
        "drive": build_model(drive, lookup=lookup),
        "drive with hysteresis": build_model(drive, {"hysteresis": {"torque": 4.0}}, lookup=lookup),
        "drive with all effects": nominal(build_model(drive, {e: {} for e in EFFECTS}, lookup=lookup)),
        "individual drive": build_model(drive, lookup=lookup, individual=1),
        "catalogue gear": build_model("CHA-40A-50"),
    }
    with tempfile.TemporaryDirectory() as name:
        works = {"linear spring": spring(args.joints), "rigid gear": rigid(args.joints)}
        for label, model in models.items():
            folder = export_mujoco(model, Path(name) / label.replace(" ", "_"))
            works[label] = with_drive(args.joints, folder)
        best = dict.fromkeys(works, float("inf"))
        for _ in range(args.rounds):
            for label, work in works.items():
                best[label] = min(best[label], work())
    print(f"{args.joints} joints, MuJoCo {mujoco.__version__}")
    for label, seconds in best.items():
        print(
            f"{label:25} {1e6 * seconds:8.2f} us a step {seconds / best['linear spring']:8.2f} times the linear spring"
        )


def nominal(model: DriveModel) -> DriveModel:
    """All effects at the size that their declaration calls typical."""
    return model.with_parameters({p.name: p.nominal for p in model.parameters if p.tunable and p.name != "band"})


def arm(joints: int) -> Any:
    """A chain of links without contacts."""
    text = "".join(LINK.format(k=k) for k in range(joints)) + "</body>" * joints
    flags = '<option timestep="0.002"><flag contact="disable"/></option>'
    return mujoco.MjSpec.from_string(f"<mujoco>{flags}<worldbody>{text}</worldbody></mujoco>")


def spring(joints: int) -> Callable[[], float]:
    """Between motor and link of every joint, a second joint with MuJoCo's own stiffness."""
    spec = arm(joints)
    for k in range(joints):
        motor = spec.joint(f"j{k}")
        motor.armature = 0.1
        twist = motor.parent.add_joint(name=f"j{k}_twist", type=motor.type, axis=motor.axis, armature=0.6)
        twist.stiffness = [1e5, 0, 0]
    return stepping(spec)


def rigid(joints: int) -> Callable[[], float]:
    """No twist."""
    spec = arm(joints)
    for k in range(joints):
        spec.joint(f"j{k}").armature = 0.1
    return stepping(spec)


def with_drive(joints: int, folder: Path) -> Callable[[], float]:
    """The drive in every joint, without its sensor."""
    spec = arm(joints)
    for k in range(joints):
        add_drive(spec, f"j{k}", folder, motor_inertia=1e-4)
        spec.delete(spec.sensor(f"j{k}_drive"))
    return stepping(spec)


def stepping(spec: Any) -> Callable[[], float]:
    """Seconds per step of one round, always from the same start."""
    model = spec.compile()
    data = mujoco.MjData(model)

    def work() -> float:
        mujoco.mj_resetData(model, data)
        start = time.perf_counter()
        mujoco.mj_step(model, data, STEPS)
        return (time.perf_counter() - start) / STEPS

    return work


if __name__ == "__main__":
    main()
