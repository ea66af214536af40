"""Measured records of a printed cycloidal actuator
================================================

Diagnosis of measured records: a printed cycloidal actuator at six preloads, output locked, without a drawing.

The base curve is a power law with a dead band; one exponent is fitted to all records, because they are of one gear.
That a printed gear has friction is known beforehand and stated as a prior. The likeliest explanation of all records has
constant friction and friction that depends on the load, of two also creep, beside a repeatable remainder of 1.2 to 2.9
times the noise. Three verdicts are partly, because of that remainder; three leave open whether creep, loss that depends
on the rate, or an error of the torque sensor comes with friction.
Beside the diagnosis stands the lost motion that the small cycles show without any model: the twist between rising and
falling through zero torque. It decreases with the first two steps of preload and then remains. The fitted play, a part
of the large cycles' curve, decreases from the second step on, to two fifths; before, friction that grows with the load,
which is largest there, takes a part of it. The exponent reaches its lower bound, that of a spring; the remaining
curvature between flanks and dead band is part of the remainder.

::

    python examples/cycloidal_records.py [FOLDER] [--data DIR] [--every N]

writes cycloidal.png and a folder for each record to FOLDER (default cycloidal-records). The records (Jelmer V.,
CC BY-SA 4.0) are not part of this repository; DIR is ../shared/data/cycloidal beside it by default. Every N-th sample
is used (default 12, some 36 Hz).
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np

from reefmu.diagnosis import Diagnosis, Priors, diagnose_record
from reefmu.diagnosis.forward.base_curve import PLAY
from reefmu.diagnosis.report.text import sets_text
from reefmu.diagnosis.shared_exponent import shared_exponent
from reefmu.record import Record, read_column_map, read_record, with_output_locked
from stiffness_model.plotting.style import BLUE, GREEN, ORANGE, RED, format_axes, legend_above, new_figure
from stiffness_model.units import ARCMIN

COLUMNS = read_column_map(Path(__file__).with_name("cycloidal_columns.toml"))
LARGE_CYCLES = 100
"""Number of the first run with large cycles."""
FRICTION = Priors(odds={"hysteresis": 10.0, "load_dependent_hysteresis": 10.0})
"""A printed gear has friction, part of it in proportion to the load. The calibration takes every effect for as rare as
one in ten; these odds make both kinds of friction as likely as not."""


def thinned(record: Record, every: int) -> Record:
    """Every `every`-th sample of a record."""
    columns = ("time", "run", "crank_angle", "output_angle", "output_torque", "temperature")
    return replace(record, **{name: getattr(record, name)[::every] for name in columns})


def lost_motion(record: Record) -> float:
    """Twist, rad, between falling and rising through zero torque, mean over the small cycles except the first."""
    widths = []
    for a, b in itertools.pairwise([*record.starts.tolist(), len(record)]):
        if not 0 < record.run[a] < LARGE_CYCLES:
            continue
        twist, torque = record.twist(1.0)[a:b], record.output_torque[a:b]
        # Near zero torque the branches of the cycle lie on either side of its middle.
        near = np.abs(torque) < 0.5
        middle = (np.quantile(twist, 0.02) + np.quantile(twist, 0.98)) / 2
        widths.append(twist[near & (twist > middle)].mean() - twist[near & (twist < middle)].mean())
    return float(np.mean(widths))


def size(found: Diagnosis, name: str, parameter: str) -> tuple[float, float, float]:
    """Value and interval of one parameter; NaN where the effect is not named."""
    for effect in found.effects:
        if effect.name == name:
            value = effect.parameters[parameter]
            return value.value, value.low, value.high
    return (float("nan"),) * 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="cycloidal-records", type=Path)
    parser.add_argument("--data", default=Path(__file__).resolve().parents[2] / "shared/data/cycloidal", type=Path)
    parser.add_argument("--every", default=12, type=int)
    args = parser.parse_args()
    if not args.data.is_dir():
        print(f"This example needs measured records, which are not part of this repository: none in {args.data}.")
        return
    whole = [with_output_locked(read_record(args.data / f"preload_{k}.csv.gz", COLUMNS)) for k in range(6)]
    records = [thinned(record, args.every) for record in whole]
    exponent = shared_exponent(records)
    print(exponent)
    heads = ("preload", "verdict", "lost motion", "play", "friction", "of load", "gap", "after", "noise", "remainder")
    print("\n" + " ".join(f"{head:>11s}" for head in heads) + "  effects")
    rows = []
    for k, record in enumerate(records):
        found = diagnose_record(record, exponent=exponent, out=args.folder / f"preload_{k}", priors=FRICTION)
        loose, play = lost_motion(whole[k]) / ARCMIN, found.base[PLAY] / ARCMIN
        constant, share = size(found, "hysteresis", "torque"), size(found, "load_dependent_hysteresis", "fraction")
        gap = found.gap
        names = ", ".join(e.name for e in found.effects)
        cells = (
            f"{k}",
            found.verdict,
            f"{loose:.0f} arcmin",
            f"{2 * play:.0f} arcmin",
            f"{constant[0]:.2f} N.m",
            f"{share[0]:.2f}",
            *(f"{v:.2f} N.m" for v in (gap.before, gap.after, gap.noise, found.remainder)),
        )
        print(
            " ".join(f"{cell:>11s}" for cell in cells)
            + f"  {names}"
            + (f"; or {sets_text(found.shown_alternatives, 2)}" if found.shown_alternatives else ""),
            flush=True,
        )
        rows.append((loose, play, constant, share, found.remainder, gap.noise))
    picture(rows, args.folder / "cycloidal.png")


def picture(rows: list[tuple[float, float, tuple[float, ...], tuple[float, ...], float, float]], path: Path) -> None:
    """Draw lost motion, friction and remainder over the preload."""
    figure = new_figure(12, 4.0)
    axes = figure.subplots(1, 3)
    k = np.arange(len(rows))
    axes[0].plot(k, [r[0] for r in rows], "o-", color=BLUE, label="lost motion, small cycles, no model")
    axes[0].plot(k, [2 * r[1] for r in rows], "s--", color=ORANGE, label="play fitted, both sides")
    axes[1].plot(k, [r[2][0] for r in rows], "o-", color=BLUE, label="constant friction")
    axes[1].plot(k, [10 * r[3][0] for r in rows], "s--", color=GREEN, label="friction per load")
    axes[2].plot(k, [r[4] for r in rows], "o-", color=RED, label="repeatable remainder")
    axes[2].plot(k, [r[5] for r in rows], "s--", color=BLUE, label="noise")
    labels = ("angle [arcmin]", "friction [N.m]; per load [10 %]", "torque, rms [N.m]")
    for ax, label in zip(axes, labels, strict=True):
        legend_above(format_axes(ax, "preload step", label))
        ax.set_ylim(0)
    figure.savefig(path)


if __name__ == "__main__":
    main()
