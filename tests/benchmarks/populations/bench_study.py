"""The paper's study: time and memory on one core, time over drives and twists, start of the command line.

Run as `python tests/benchmarks/populations/bench_study.py`. Goals: study under 5 s and 1 GiB, linear time,
`reefmu --help` under 0.2 s, `reefmu curve drive_1` under 3 s.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable

import numpy as np

import stiffness_model as sm

DRIVES, TWISTS = 1000, 61
# In a process of its own, so that the peak is that of the study; ru_maxrss is in kB on Linux, in bytes on macOS.
STUDY = f"""
import resource, sys, time, warnings
import numpy as np
warnings.simplefilter("ignore")
import stiffness_model as sm
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start, cpu = time.perf_counter(), time.process_time()
populations = []
for name in ("drive_1", "drive_2", "drive_3"):
    drive = sm.load_drive(name)
    populations.append(sm.simulate(drive, np.linspace(0, drive.max_twist, {TWISTS}), {DRIVES}))
    populations[-1].curve()
wall, cpu = time.perf_counter() - start, time.process_time() - cpu
unit = 1 if sys.platform == "darwin" else 1024
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(wall, cpu, unit * peak / 2**20, unit * before / 2**20)
"""


def best(work: Callable[[], object], runs: int = 3) -> float:
    """Shortest wall time of several runs, s."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def study() -> None:
    """Print time and memory of the three variants with all results."""
    runs = [
        [
            float(word)
            for word in subprocess.run(
                [sys.executable, "-c", STUDY], capture_output=True, text=True, check=True
            ).stdout.split()
        ]
        for _ in range(3)
    ]
    wall, cpu, peak, before = min(runs)
    solved = 3 * DRIVES * 87 * TWISTS
    print(f"study: 3 variants x {DRIVES} drives x 87 elements x {TWISTS} twists, one core")
    print(f"  wall time            {wall:8.2f} s     (limit 5 s)")
    print(f"  processor time       {cpu:8.2f} s")
    print(
        f"  per element, twist   {1e6 * wall / solved:8.3f} us    (half of the elements are outside the usable profile)"
    )
    print(f"  peak memory          {peak:8.0f} MiB   (limit 1024 MiB; {before:.0f} MiB of it imports)\n")


def linearity() -> None:
    """Print the time per drive and per twist; equal values mean linear time."""
    drive = sm.load_drive("drive_1")
    sm.simulate(drive, [0.001], 16)  # tables of Hertz's theory, built once
    print("time over the number of drives, 31 twists     time over the number of twists, 500 drives")
    print("  drives     time     per drive                 twists     time     per twist")
    for drives, twists in zip((125, 250, 500, 1000, 2000), (8, 16, 31, 61, 122), strict=True):
        sweep, row = np.linspace(0, drive.max_twist, 31), np.linspace(0, drive.max_twist, twists)
        over_drives = best(lambda n=drives, t=sweep: sm.simulate(drive, t, n))
        over_twists = best(lambda t=row: sm.simulate(drive, t, 500))
        print(
            f"  {drives:6d} {over_drives:8.3f} s {1e3 * over_drives / drives:8.3f} ms               "
            f"{twists:6d} {over_twists:8.3f} s {1e3 * over_twists / twists:8.3f} ms"
        )
    print()


def command_line() -> None:
    """Print wall times of commands in processes of their own."""
    print("command line, shortest and longest of several runs")
    for args, limit, runs in ((["--help"], 0.2, 7), (["curve", "drive_1"], 3.0, 3), (["compare", "drive_1"], None, 3)):
        times = []
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(runs):
                start = time.perf_counter()
                subprocess.run([sys.executable, "-m", "reefmu", *args], cwd=folder, capture_output=True, check=True)
                times.append(time.perf_counter() - start)
        goal = f"(limit {limit} s)" if limit else ""
        print(f"  reefmu {' '.join(args):20s} {min(times):6.3f} ... {max(times):6.3f} s  {goal}")


def main() -> None:
    """Print all tables."""
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)
    study()
    linearity()
    command_line()


if __name__ == "__main__":
    main()
