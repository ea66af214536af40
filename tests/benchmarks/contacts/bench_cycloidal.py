"""Time of the equilibrium of cycloidal discs per contact and twist, relative to that of an REE element in the same run.

    python tests/benchmarks/contacts/bench_cycloidal.py [--drives 64] [--twists 61] [--rounds 7]

A contact is a pin or an output roller; an element is a ball of drive_1 with the plain contact model (closed form).
Rounds alternate between both, and the medians are compared, so that other work of the machine counts for both.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import stiffness_model as sm
from stiffness_model.cycloidal.cycloidal_population import simulate_cycloidal
from stiffness_model.units import ARCMIN
from tests.cycloidal_drives import TOLERANCES, cycloidal

CASES: dict[str, tuple[dict[str, float], dict[str, str]]] = {
    "bearing": ({"bearing_stiffness": 2e7}, {"bearing_stiffness": "250 N/um"}),
    "rigid bearing": ({}, {}),
    "bearing with clearance": (
        {"bearing_stiffness": 2e7, "bearing_clearance": 20e-6},
        {"bearing_stiffness": "250 N/um"},
    ),
    "springs behind contacts": (
        {"bearing_stiffness": 2e7, "ring_stiffness": 4e7, "roller_stiffness": 5e6},
        {"ring_stiffness": "250 N/um", "cage_wall_stiffness": "100 N/um"},
    ),
    "housing": ({"bearing_stiffness": 2e7, "housing_stiffness": 5e3}, {"housing_stiffness": "100 N.m/arcmin"}),
}
"""Fields of the cycloidal drawing beside geometry, clearances and tolerances; fields of an REE drive with the like."""


@dataclass(frozen=True)
class Cost:
    """Median times, ns, at one twist.

    element: of the plain REE drive; like: of an REE drive with the like bodies; contact: of the cycloidal drive.
    """

    element: float
    like: float
    contact: float

    @property
    def ratio(self) -> float:
        """Contact over plain element."""
        return self.contact / self.element


def measure(case: tuple[dict[str, float], dict[str, str]], drives: int, twists: int, rounds: int) -> Cost:
    """Alternating rounds of all three."""
    fields, like = case
    gear = cycloidal(profile_clearance=50e-6, hole_clearance=50e-6, **TOLERANCES, **fields)
    plain, other = sm.load_drive("drive_1"), sm.load_drive("drive_1", **like)
    twist, turned = np.linspace(0, 8, twists) * ARCMIN, np.linspace(0, 20e-3, twists)
    contacts = gear.discs * (gear.pins + gear.output_rollers)
    times = [
        (
            _duration(lambda: sm.simulate(plain, twist, drives)) / plain.elements,
            _duration(lambda: sm.simulate(other, twist, drives)) / other.elements,
            _duration(lambda: simulate_cycloidal(gear, turned, drives)) / contacts,
        )
        for _ in range(rounds + 1)
    ]
    # The first round also loads modules.
    return Cost(*(1e9 * float(v) / (drives * twists) for v in np.median(times[1:], axis=0)))


def _duration(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=64)
    parser.add_argument("--twists", type=int, default=61)
    parser.add_argument("--rounds", type=int, default=7)
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{'':26s} plain element  element with the like  contact  contact/plain  contact/like")
    for name, case in CASES.items():
        cost = measure(case, args.drives, args.twists, args.rounds)
        print(
            f"{name:26s} {cost.element:10.0f} ns {cost.like:19.0f} ns {cost.contact:5.0f} ns {cost.ratio:14.1f} "
            f"{cost.contact / cost.like:13.1f}"
        )


if __name__ == "__main__":
    main()
