"""The virtual drives that a call asks for."""

from __future__ import annotations

import argparse

import numpy as np

from reefmu.progress import CountingExecutor
from stiffness_model.errors import expect
from stiffness_model.kinds import AnyDrive
from stiffness_model.montecarlo.population import Population, simulate
from stiffness_model.units import format_quantity

TWISTS = 61
"""Twists from zero to the drawing's max_twist; chosen by judgement."""


def run_population(drive: AnyDrive, args: argparse.Namespace) -> Population:
    """The virtual drives that `--drives` and `--seed` ask for, over the drawing's range of twists.

    Raises `InputError` if they carry no torque, because the range of twists lies within the backlash.
    """
    twist = np.linspace(0.0, drive.max_twist, TWISTS)
    executor = CountingExecutor(f"simulating {args.drives} virtual drives")
    population = simulate(drive, twist, args.drives, args.seed, executor=executor)
    expect(
        bool((population.torque > 0).any()),
        "a max_twist at which the drive carries torque",
        f"{format_quantity(drive.max_twist, 'angle')}, all of it play",
        drive.name,
    )
    return population
