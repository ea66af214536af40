"""Computing time and memory of Newton's method for balls larger than their bores, over the number of twists.

    python tests/benchmarks/contacts/bench_newton.py [--drive drive_1] [--drives 16] [--twists 200 1000 5000]

Time of `simulate` with all balls larger than their bores as a multiple of the same with balls that fit, alternating in
one run, for the linear gear and for the exact profile (with a twentieth of the twists); and the peak of the memory that
Python allocates beside the results, from `tracemalloc` in a separate run. It must not grow with the twists.
"""

from __future__ import annotations

import argparse
import time
import tracemalloc
import warnings

import numpy as np

import stiffness_model as sm

TIGHT, FREE = "-20 um", "60 um"


def seconds(drive: sm.Drive, twist: np.ndarray, n_drives: int) -> float:
    """Processor time of one `simulate`."""
    start = time.process_time()
    sm.simulate(drive, twist, n_drives)
    return time.process_time() - start


def ratio(name: str, n_drives: int, n_twists: int, gear: str = "linear", repeats: int = 3) -> float:
    """Median ratio of the times with all balls larger than their bores and with balls that fit."""
    tight, free = (sm.load_drive(name, cage_offset=offset, gear_contact=gear) for offset in (TIGHT, FREE))
    twist = np.linspace(0, tight.max_twist, n_twists)
    return float(np.median([seconds(tight, twist, n_drives) / seconds(free, twist, n_drives) for _ in range(repeats)]))


def peak(drive: sm.Drive, n_drives: int, n_twists: int) -> float:
    """Peak of the allocated memory beside the results, bytes."""
    twist = np.linspace(0, drive.max_twist, n_twists)
    sm.simulate(drive, twist[:2], 1)  # tables of Hertz's theory, built once
    tracemalloc.start()
    try:
        population = sm.simulate(drive, twist, n_drives)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    return most - sum(
        values.nbytes
        for values in (population.torque, population.crank_torque, population.contact_force, population.load_share)
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drive", default="drive_1")
    parser.add_argument("--drives", type=int, default=16)
    parser.add_argument("--twists", type=int, nargs="+", default=[200, 1000, 5000])
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{args.drive}, {args.drives} drives, balls larger than bores; multiples of the time with balls that fit")
    print(f"{'twists':>8}{'linear':>9}{'exact':>9}{'peak [MB]':>11}")
    tight = sm.load_drive(args.drive, cage_offset=TIGHT)
    for n in args.twists:
        few = max(2, n // 20)
        print(
            f"{n:8}{ratio(args.drive, args.drives, n):9.1f}{ratio(args.drive, args.drives, few, 'exact'):9.1f}"
            f"{1e-6 * peak(tight, args.drives, n):11.0f}"
        )


if __name__ == "__main__":
    main()
