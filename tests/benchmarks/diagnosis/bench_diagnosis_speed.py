"""Time of a diagnosis, of its predictor for sets of effects, of thinning, and of a plan; ratios to plain evaluations in
this run.

Run as `python tests/benchmarks/diagnosis/bench_diagnosis_speed.py` with one thread of BLAS (OMP_NUM_THREADS=1);
`--records 3 27` gives the lengths in multiples of 4240 samples. The plain predictor is made anew for every call, so
that nothing is reused, and evaluates all samples. `--catalogue 14` times the full protocols of a catalogue of the
second generator in two processes instead.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from reefmu.commands.terminal.worker_processes import process_pool
from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.estimation.problem import search_blocks
from reefmu.diagnosis.forward.base_curve import BaseCurve, drawing_base
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.preprocessing.thinning import thin_trace
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.effects import EFFECTS
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.planning import Rig, make_plan
from reefmu.record import Record
from reefmu.simulate import simulate_record
from stiffness_model import DoesNotFitWarning
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig
from tests.benchmarks.probabilities.observed_records import second_record

SETS: tuple[tuple[str, ...], ...] = (
    (),
    ("hysteresis",),
    ("kinematic_error",),
    ("structural_compliance",),
    ("creep",),
    ("creep", "structural_compliance", "hysteresis"),
    ("missing_ball", "thermal_clearance"),
)
PLANNED = ("hysteresis", "creep", "backlash")
ENCODER_NOISE = 2e-6
"""rad, standard deviation of the output angle's noise."""


def noisy_record(oversampling: int, individual: int | None = None) -> Record:
    """A record with hysteresis, noise of the torque (0.6 N.m, correlated) and of the output's encoder; of the mean
    drive, or of the individual of a seed."""
    record = rig.protocol(oversampling=oversampling)
    effects = {"hysteresis": {"torque": 2.5, "presliding": 1e-4}}
    model = build_model(rig.drive(), effects, lookup=cached_lookup(rig.drive()), individual=individual)
    torque = simulate_record(model, record)["measured.tau"] + rig.noise_of(len(record), 0.6, 0.5, 0)
    noise = ENCODER_NOISE * np.random.default_rng(1).standard_normal(len(record))
    return replace(record, output_torque=torque, output_angle=record.output_angle + noise)


def fit_path(base: BaseCurve, names: tuple[str, ...]) -> list[Array]:
    """Parameters that a fit of these effects might pass through: five steps, each a third of the one before. The first
    are the zero of the twist, rad, the delay of the torque, s, and those of the base curve."""
    nominal = np.array([1e-6, 1e-4, *base.shape.start, *(p.nominal for n in names for p in EFFECTS[n].parameters)])
    return [nominal * (1 + 0.2 / 3**k) for k in range(5)]


def seconds(call: Callable[[Array], object], points: list[Array]) -> float:
    """Least time of three for one call at each of the points, divided by their number."""
    times: list[float] = []
    for _ in range(3):
        started = time.perf_counter()
        for point in points:
            call(point)
        times.append((time.perf_counter() - started) / len(points))
    return min(times)


def compare_predictors(record: Record) -> None:
    """Print the time of the plain predictor, and the factors that are saved by reuse and by thinning."""
    trace = make_trace(record, rig.drive().ratio)
    blocks = search_blocks(trace)
    thinned = thin_trace(trace, blocks)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    print(f"{len(trace)} samples, {len(blocks.count)} blocks, {len(thinned[0])} samples of the thinned trace")
    for names in SETS:
        points = fit_path(base, names)
        plain = seconds(lambda p, names=names: Predictor(trace, base, names, blocks)(p), points)
        reused = seconds(Predictor(trace, base, names, blocks), points)
        ranked = seconds(Predictor(thinned[0], base, names, thinned[1]), points)
        print(
            f"  {'+'.join(names) or 'base curve':45s} plain {1e3 * plain:7.2f} ms"
            f"   reuse {plain / reused:4.1f} times   with thinning {plain / ranked:5.1f} times faster"
        )


def time_diagnosis(what: str, record: Record) -> None:
    """Print the time of a diagnosis in one process, and its verdict."""
    started = time.perf_counter(), time.process_time()
    found = diagnose_record(record, drive=rig.drive())
    wall, cpu = time.perf_counter() - started[0], time.process_time() - started[1]
    names = "+".join(effect.name for effect in found.effects)
    print(f"  diagnosis, {what}: {wall:.1f} s, {cpu:.1f} s of processor time ({found.verdict} {names})")


def time_catalogue(seed: int, count: int) -> None:
    """Print the median and the longest time of the full protocols among the first records of a catalogue of the second
    generator, in two processes with their tables cached."""
    times: list[float] = []
    with process_pool(2) as pool:
        for number in range(count):
            record, drive, truth = second_record(number, seed)
            if truth["protocol"] != "full":
                continue
            cached_lookup(drive)
            started = time.perf_counter()
            found = diagnose_record(record, drive=drive, executor=pool)
            times.append(time.perf_counter() - started)
            print(f"  {seed}/{number}: {times[-1]:.1f} s ({found.verdict})", flush=True)
    print(f"{len(times)} records: median {np.median(times):.1f} s, longest {max(times):.1f} s")


def main() -> None:
    """Compare the predictors and time a whole diagnosis for every length of record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=int, nargs="+", default=[3, 27])
    parser.add_argument("--catalogue", type=int, help="seed: time diagnoses in two processes instead")
    parser.add_argument("--count", type=int, default=40, help="records of the catalogue")
    options = parser.parse_args()
    warnings.simplefilter("ignore", DoesNotFitWarning)
    if options.catalogue is not None:
        time_catalogue(options.catalogue, options.count)
        return
    for oversampling in options.records:
        record = noisy_record(oversampling)
        compare_predictors(record)
        time_diagnosis("mean drive", record)
        time_diagnosis("individual", noisy_record(oversampling, individual=7))
    started = time.process_time()
    plan = make_plan(rig.drive(), Rig(), PLANNED)
    cpu = time.process_time() - started
    print(f"plan for {len(PLANNED)} effects: {cpu:.1f} s of processor time (protocol of {plan.seconds:.0f} s)")


if __name__ == "__main__":
    main()
