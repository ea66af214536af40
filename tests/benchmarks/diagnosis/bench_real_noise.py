"""Diagnosis of simulated records with measured noise, taken from torque ramps of a real rig.

    python tests/benchmarks/diagnosis/bench_real_noise.py [--sigmas 3,8] [--effects hysteresis,...] [--workers 2]

The noise is taken from the records of ../shared/data/cycloidal: the torque without its trend (steps of a motor that
sticks, ripple, the sensor), and the difference of two repeated cycles over sqrt(2). Sections of it, scaled to NOISE of
full torque, are added to records of tests/validation/blind. Prints a row for each case and the rates; sizes are the rms
of the effect's contribution over that of the noise.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import tempfile
import warnings
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from reefmu.diagnosis import diagnose_record
from reefmu.record import read_record
from stiffness_model import DoesNotFitWarning
from stiffness_model.numerics.arrays import Array
from tests.validation.blind.records import Case, make
from tests.validation.blind.scoring import judge, wilson
from tests.validation.blind.sensors import Sensors

DATA = Path(__file__).resolve().parents[4] / "shared/data/cycloidal"
COLUMNS = {"TIME": "time [s]", "POSITION": "twist [rev]", "TORQUE": "output_torque [N.m]", "test_nr": "run"}
NOISE = 0.004
"""Rms over full torque; in the measured records it is 0.006."""
SLOW = 201
"""Samples, half a second, of the filter that gives the trend; chosen by judgement."""
EFFECTS = (
    "",
    "",
    "hysteresis",
    "load_dependent_hysteresis",
    "backlash",
    "coulomb_friction",
    "viscous_friction",
    "creep",
    "kinematic_error",
    "torque_sensor_drift",
)
"""Hidden one at a time; an empty name is a clean drive."""


def real_noise(record: int) -> Array:
    """Noise of one record, N.m: residuals of all runs about their trend, and differences of repeated cycles, joined."""
    read = read_record(DATA / f"preload_{record}.csv.gz", COLUMNS)
    sections, cycles = [], []
    for a, b in itertools.pairwise([*read.starts.tolist(), len(read)]):
        torque = read.output_torque[a:b]
        slow = savgol_filter(torque, SLOW, 2)
        sections.append((torque - slow)[SLOW:-SLOW])
        if read.run[a] > 100:
            # The commanded ramp is the same in every cycle: compare at the same share of its duration.
            cycles.append(np.interp(np.linspace(0, 1, 6000), np.linspace(0, 1, b - a), torque))
    difference = (cycles[0] - cycles[1]) / np.sqrt(2)
    sections.append((difference - savgol_filter(difference, SLOW, 2))[SLOW:-SLOW])
    return np.concatenate(sections)


def score_case(number: int, effect: str, sigmas: float) -> dict[str, object]:
    """Diagnose one case; its verdict and whether the name is right."""
    warnings.simplefilter("ignore", DoesNotFitWarning)
    effects = ((effect, sigmas),) if effect else ()
    case = Case(9000 + number, "single" if effect else "none", effects, sensors=Sensors(NOISE, 0.0, of_angle=0.0))
    made = make(case)
    rng = np.random.default_rng(np.random.SeedSequence([number]))
    noise = real_noise(int(rng.integers(6)))
    n = len(made.motion.torque)
    at = int(rng.integers(len(noise)))
    noise_added = np.resize(np.roll(noise, at), n)
    noise_added = noise_added * NOISE * made.truth.full_torque / np.sqrt(np.mean(noise_added**2))
    table = {**made.table, "output_torque [N.m]": made.motion.torque + noise_added}
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = replace(made, table=table).write(Path(folder))
        found = diagnose_record(record, drive=drawing)
    outcome = judge(made.truth, found.to_dict(), found.seconds)
    one = float(noise_added[1:] @ noise_added[:-1] / (noise_added @ noise_added))
    return {
        "effect": effect or "none",
        "sigmas": sigmas if effect else 0.0,
        "verdict": found.verdict,
        "names": " + ".join(e.name for e in found.effects),
        "within": outcome.within,
        "right": outcome.exact if effect else found.verdict == "none",
        "autocorrelation": one,
        "gap": f"{found.gap.before:.2f} -> {found.gap.after:.2f}, noise {found.gap.noise:.2f}",
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sigmas", default="3,8")
    parser.add_argument("--effects", default=",".join(EFFECTS))
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args(arguments)
    if not DATA.is_dir():
        parser.error(f"no records in {DATA}")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    cases = [(effect, float(s)) for s in args.sigmas.split(",") for effect in args.effects.split(",")]
    rows = []
    with ProcessPoolExecutor(args.workers) as pool:
        for row in pool.map(score_case, range(len(cases)), *zip(*cases, strict=True)):
            rows.append(row)
            print(
                f"{row['effect']:26s} {row['sigmas']:4.1f} sigma  {'ok' if row['right'] else '  '}  "
                f"{row['verdict']:12s} {row['names']:45s} gap {row['gap']}, lag one {row['autocorrelation']:.2f}",
                flush=True,
            )
    for title, some in (
        ("right name", [r for r in rows if r["effect"] != "none"]),
        ("clean called none", [r for r in rows if r["effect"] == "none"]),
    ):
        hits = sum(bool(r["right"]) for r in some)
        low, high = wilson(hits, len(some))
        print(f"{title}: {hits}/{len(some)}, 95 % bounds {100 * low:.0f} .. {100 * high:.0f} %")


if __name__ == "__main__":
    main()
