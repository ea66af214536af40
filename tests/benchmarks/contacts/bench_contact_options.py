"""Computing time of the contact options, as multiples of that of the plain model in the same run.

    python tests/benchmarks/contacts/bench_contact_options.py [--drive drive_1] [--drives 160] [--twists 31]

Times of `solve` alone on the same contacts, and of a whole `simulate`, alternating so that other work on the machine
affects both alike; the median of the ratios. The goal for the crank bearings is at most 5.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable

import numpy as np

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium.closed_form import solve

CASES: dict[str, dict[str, str]] = {
    "crank bearing 250 N/um": {"bearing_stiffness": "250 N/um"},
    "crank bearing 50 N/um": {"bearing_stiffness": "50 N/um"},
    "housing": {"housing_stiffness": "100 N.m/arcmin"},
    "bearing and housing": {"bearing_stiffness": "250 N/um", "housing_stiffness": "100 N.m/arcmin"},
    "ring and cage wall": {"ring_stiffness": "500 N/um", "cage_wall_stiffness": "100 N/um"},
    "conforming bores": {"cage_contact": "lamina"},
    "exact gear": {"gear_contact": "exact"},
    "inertia": {"inertia": "on", "crank_speed": "3000 rpm"},
}
SLOW = ("exact gear", "inertia", "conforming bores")


def blocks(drive: sm.Drive, n_drives: int) -> list[Contacts]:
    """Contacts of the usable elements, one entry per block."""
    drawn = [sampling.draw(drive, block, count, 0) for block, count in sampling.blocks(n_drives)]
    return [usable_elements(drive, d).contacts for d in drawn]


def seconds(call: Callable[[], object]) -> float:
    """Wall time of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def measure(name: str, fields: dict[str, str], n_drives: int, n_twists: int, repeats: int = 5) -> tuple[float, float]:
    """Ratios of `solve` and of `simulate` to the plain model's."""
    plain, other = sm.load_drive(name), sm.load_drive(name, **fields)
    twist = np.linspace(0, plain.max_twist, n_twists)
    pair = blocks(plain, n_drives), blocks(other, n_drives)

    def both(run: Callable[[sm.Drive, list[Contacts]], object]) -> float:
        run(other, pair[1])
        ratios = [seconds(lambda: run(other, pair[1])) / seconds(lambda: run(plain, pair[0])) for _ in range(repeats)]
        return float(np.median(ratios))

    return (
        both(lambda drive, parts: [solve(part, twist * drive.ratio) for part in parts]),
        both(lambda drive, _: sm.simulate(drive, twist, n_drives)),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--drive", default="drive_1")
    parser.add_argument("--drives", type=int, default=160)
    parser.add_argument("--twists", type=int, default=31)
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{args.drive}, {args.drives} drives, {args.twists} twists; multiples of the plain model's time")
    print(f"{'':26}{'solve':>8}{'simulate':>10}")
    for case, fields in CASES.items():
        few = 16 if case in SLOW else args.drives
        ratios = measure(args.drive, fields, few, args.twists, 1 if case in SLOW else 5)
        print(f"{case:26}{ratios[0]:8.1f}{ratios[1]:10.1f}")


if __name__ == "__main__":
    main()
