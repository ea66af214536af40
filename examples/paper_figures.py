"""Figures 7 to 10 of the paper
============================

Figures 7 to 10 of the paper, for the presets (30 lobes) or for the other reading of ``|i| = 29`` (28 lobes).

::

    python examples/paper_figures.py [FOLDER] [--drives N] [--lobes 28]

writes figure_7.png ... figure_10.png to FOLDER (default paper-figures) and prints the numbers of the text.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from stiffness_model.catalog.gears import catalog
from stiffness_model.plotting import curves as plots

NAMES = ("drive_1", "drive_2", "drive_3")


def simulated(lobes: int, n_drives: int) -> list[sm.Population]:
    """The three drives over their twists, as in section IV."""
    drives = [sm.load_drive(name, lobes=lobes) for name in NAMES]
    return [sm.simulate(drive, np.linspace(0, drive.max_twist, 61), n_drives) for drive in drives]


def main() -> None:
    """Simulate, draw and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", default="paper-figures", type=Path)
    parser.add_argument("--drives", type=int, default=1000, help="virtual drives per variant (default 1000)")
    parser.add_argument("--lobes", type=int, default=30, choices=(28, 30), help="reading of the ratio 29 (default 30)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    populations = simulated(args.lobes, args.drives)
    curves = [population.curve() for population in populations]

    figure = Figure(figsize=(11, 4.4), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2)
    plots.twist_over_torque(curves, ax=left)
    plots.twist_over_torque(curves[:2], ax=right)
    figure.savefig(args.folder / "figure_7.png")

    plots.save(plots.against_catalog(curves[0], catalog()), args.folder / "figure_8.png")

    figure = Figure(figsize=(14, 4.4), dpi=150, layout="constrained")
    for population, ax in zip(populations, figure.subplots(1, 3), strict=True):
        plots.contact_forces(population, ax=ax)
    figure.savefig(args.folder / "figure_9.png")

    plots.save(plots.load_share(populations), args.folder / "figure_10.png")

    for population, curve in zip(populations, curves, strict=True):
        at_rest, full = curve.contact_force[0, 0], curve.contact_force[-1, 0]
        print(
            f"{curve.name}, {args.lobes} lobes: {curve.full_torque:.0f} N.m at "
            f"{curve.twist[-1] / sm.ARCMIN:g} arcmin, load share there {100 * curve.load_share[-1]:.1f} %, "
            f"greatest gear force {full:.0f} N, {at_rest:.0f} N at rest, {population.capped_count} capped contacts"
        )
    print(f"pictures in {args.folder}")


if __name__ == "__main__":
    main()
