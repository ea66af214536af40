"""Difference between native FMU and Python model over millions of steps of a closed loop of twist.

    python tests/benchmarks/simulation/bench_drift.py [--steps 10000000] [--round 1000]

A round is a signal with reversals at five amplitudes, a crank that turns in both senses and uneven steps, which ends
where it begins. Every effect is included, so that creep relaxes, hysteresis reverses, and wear and sensor drift grow.
After every round all outputs and states of the FMU (in a C host) are compared with those of the model, which CasADi
evaluates. Printed over the rounds: the greatest difference so far, of each variable relative to its greatest value.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import zipfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

import numpy as np

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.fmu.export import export_fmu
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.validation.reference_run import Excitation, make_excitation
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.build_lookup import build_lookup
from tests.integration.fmu.replay import build_replay, repeat_model, replay


def full_model() -> DriveModel:
    """Every effect at its nominal size; wear and drift so that ten million steps end within the lookup."""
    drive = sm.load_drive("drive_1")
    model = build_model(drive, {n: {} for n in EFFECTS}, lookup=build_lookup(drive, n_drives=16))
    sizes = {
        p.name: float(np.clip(p.nominal, p.minimum, p.maximum))
        for p in model.parameters
        if p.name != "band" and p.minimum is not None and p.maximum is not None
    }
    return model.with_parameters({**sizes, "wear.rate": 1e-11, "torque_sensor_drift.rate": 1e-6})


def closed(component: Component, steps: int) -> Excitation:
    """`make_excitation` there and back again."""
    excitation = make_excitation(component)
    there = np.interp(
        np.linspace(0, 1, steps // 2 + 1), np.linspace(0, 1, len(excitation.inputs)), np.arange(len(excitation.inputs))
    )
    columns = [np.interp(there, np.arange(len(excitation.inputs)), column) for column in excitation.inputs.T]
    inputs = np.column_stack(columns)
    inputs = np.vstack([inputs, inputs[-2::-1] * [1, -1, 1, -1, 1]])
    return Excitation(excitation.names, np.resize(excitation.dt, len(inputs) - 1), inputs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=10_000_000)
    parser.add_argument("--round", type=int, default=1000)
    args = parser.parse_args()
    model = full_model()
    component = drive_component(model)
    excitation = closed(component, args.round)
    rounds = max(2, args.steps // len(excitation.dt))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = export_fmu(model, folder / "full.fmu", backend="native")
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder / "out")
        host = build_replay(folder / "host")
        start = time.perf_counter()
        native_values = replay(
            [str(host)],
            next((folder / "out").rglob("*.so")),
            read_archive(path).guid,
            component,
            excitation,
            folder,
            rounds=rounds,
        )
        native = time.perf_counter() - start
        start = time.perf_counter()
        expected = repeat_model(component, excitation, model.parameter_vector(), rounds)
        python = time.perf_counter() - start
    steps = rounds * len(excitation.dt)
    print(
        f"{rounds} rounds of {len(excitation.dt)} steps, {len(model.effects)} effects; C host {native:.1f} s "
        f"({1e6 * native / steps:.2f} us per step), model {python:.1f} s, {python / native:.0f} times as long"
    )
    names = [s.name for s in (*component.outputs, *component.states)]
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-30)
    scale[names.index("output.tau")] = scale[names.index("measured.tau")] = model.full_torque
    difference = np.maximum.accumulate(np.abs(native_values - expected) / scale, axis=0)
    for n in sorted({1, *(int(10**k) for k in range(1, 8) if 10**k < rounds), rounds}):
        worst = int(difference[n].argmax())
        print(
            f"after {n * len(excitation.dt):9d} steps: torque {difference[n, 0]:.2g} of full torque, "
            f"worst {difference[n, worst]:.2g} in {names[worst]}"
        )
    for name in ("wear.travel", "creep.twist", "hysteresis.deflection", "output.tau"):
        at = names.index(name)
        print(f"{name} at the end: native {native_values[-1, at]!r}, model {expected[-1, at]!r}")


if __name__ == "__main__":
    main()
