"""Computing time of a model's functions, of python-control's systems and of a diagnosis.

    python tests/benchmarks/simulation/bench_control.py [--rounds 30]

Ratios are to a bare evaluation of the contact table's two splines in the same run. Rounds are short and alternate; the
best counts, in processor time, because other work on the machine only adds.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np

import stiffness_model as sm
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from reefmu.effects import EFFECTS
from reefmu.joint import JointModel, Masses, joint_system
from reefmu.model.buffered import Buffered
from reefmu.model.contacts.tables import spline_function
from reefmu.model.drive_model import build_model
from reefmu.simulate import inputs_at_twist, simulate_signal
from stiffness_model.lookup.build_lookup import build_lookup
from tests import diagnosis_rig as rig

SAMPLES = 10_000
Work = Callable[[], object]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=30)
    args = parser.parse_args()
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)
    drive = sm.load_drive("drive_1")
    lookup = build_lookup(drive, n_drives=16)
    axes, point = (lookup.twist, lookup.clearance), np.array([1e-3, 0.0])
    values, slopes = (Buffered(spline_function("spline", axes, lookup.coefficients, slope=s)) for s in (False, True))
    works: dict[str, tuple[Work, int]] = {"bare splines": (lambda: (values(point), slopes(point)), 300)}
    for name, effects in (("plain", ()), ("all effects", EFFECTS)):
        works |= of_model(
            name, JointModel(build_model(drive, {e: {} for e in effects}, lookup=lookup), Masses(1e-3, 2.0))
        )
    best = dict.fromkeys(works, np.inf)
    for _ in range(args.rounds):
        for name, (work, times) in works.items():
            best[name] = min(best[name], timed(work, times))
    bare = best["bare splines"]
    for name, seconds in best.items():
        print(f"{name:45} {1e6 * seconds:10.2f} us {seconds / bare:10.1f} times")
    record = rig.measured({"hysteresis": {"torque": 4.0}, "backlash": {"clearance": 3e-6}}, seed=5)
    seconds = min(timed(lambda: analyse(record, BaseCurveSource(rig.drive())), 1) for _ in range(2))
    print(
        f"a diagnosis of {len(record)} samples: {seconds:.2f} s of processor time, "
        f"{seconds / (len(record) * bare):.0f} bare evaluations per sample"
    )


def of_model(name: str, joint: JointModel) -> dict[str, tuple[Work, int]]:
    """Calls of one model by name, and their number in a round."""
    model, system = joint.drive, joint_system(joint)
    x, u = joint.equilibrium(-50.0)
    p, inputs = model.parameter_vector(), np.array([0.0, 1.0, -1e-3, 0.0, 20.0])
    states, fast = np.zeros(len(model.states)), Buffered(model.output)
    clock = 1e-3 * np.arange(SAMPLES)
    signal = inputs_at_twist(1e-3 * np.sin(clock), model, 100 * clock)
    return {
        f"{name}: output, ordinary call": (lambda: model.output(states, inputs, p), 100),
        f"{name}: output, buffered": (lambda: fast(states, inputs, p), 300),
        f"{name}: python-control, right-hand side": (lambda: system.dynamics(0.0, x, u), 100),
        f"{name}: the same within a simulation": (lambda: system._rhs(0.0, x, u), 300),
        f"{name}: simulate {SAMPLES} samples": (lambda: simulate_signal(model, clock, signal), 1),
    }


def timed(work: Work, times: int) -> float:
    """Processor time per call, s."""
    start = time.process_time()
    for _ in range(times):
        work()
    return (time.process_time() - start) / times


if __name__ == "__main__":
    main()
