"""Time of a diagnosis of a record of 36 000 samples, by stages: torque ramps of a rig that drives the torque.

    python -m tests.benchmarks.diagnosis.bench_long_record [--profile]

Run with one thread of BLAS (OMP_NUM_THREADS=1). The record has eight cycles of a gear with play and friction whose
motor sticks; the base curve is a power law. `--profile` also prints the functions that take most of the time.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from dataclasses import dataclass, field

from reefmu.diagnosis import Diagnosis, diagnose_record
from reefmu.record import with_output_locked
from tests.torque_ramps import Gear, measured

SAMPLES, CYCLES = 36_000, (5, 3)
"""Of the record; small and large cycles."""
SHOWN = 18
"""Functions that the profile shows."""


@dataclass
class Stages:
    """Processor time, s, that was used before each stage began."""

    times: dict[str, float] = field(default_factory=dict)

    def __call__(self, stage: str, share: float) -> None:
        self.times.setdefault(stage.split(":")[0].split(",")[0], time.process_time())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    small, large = CYCLES
    gear = Gear(play=0.02, friction=2.0, loss=0.15, noise=0.25, stick=4e-4)
    record = with_output_locked(measured(gear, small=small, large=large, n=SAMPLES // (small + large)))
    stages, profile = Stages(), cProfile.Profile()
    started = time.perf_counter(), time.process_time()
    if options.profile:
        profile.enable()
    found: Diagnosis = diagnose_record(record, progress=stages)
    profile.disable()
    wall, processor = time.perf_counter() - started[0], time.process_time() - started[1]
    ends = [*list(stages.times.values())[1:], time.process_time()]
    for (stage, begun), end in zip(stages.times.items(), ends, strict=True):
        print(f"  {stage:40s} {end - begun:6.2f} s")
    print(f"{len(record)} samples: {processor:.1f} s of processor time, {wall:.1f} s in all; {found!r}")
    if options.profile:
        pstats.Stats(profile).sort_stats("tottime").print_stats(SHOWN)


if __name__ == "__main__":
    main()
