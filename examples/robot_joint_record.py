"""A measured record of a robot arm's joint
========================================

Diagnosis of a measured record: joint 3 of a six-axis arm with strain wave gears, encoders at motor and link.

The record (A. Lucious, 2024, BSD 3-Clause) is published on GitHub in allwinlucious/MasterThesis, file
utils/ML1/validate.csv, and is not part of this repository. The arm swings its third joint once through five radians, so
that gravity loads it in both directions. The map below is all that the file needs; the encoders count 2^24 to a turn,
the ratio follows from both, and the torque, whose unit the file does not state, is taken as that of the motor's current
in N.m at the joint.

::

    python examples/robot_joint_record.py [FOLDER] [--data FILE.csv]

prints what was understood and found, and writes diagnosis.json, report.html, model.toml and swing.png to FOLDER
(default robot-joint). Without the file it ends in one sentence.

The verdict is unknown: a curve over the twist leaves 19.6 N.m, ten times the noise, and no effect with a name explains
it. One swing in one direction shows neither the friction nor what an encoder deviates by in a turn of the joint, over
which gravity varies as well. The swing back, and the same swing with another load, would.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.hypotheses import hypothesis_text, likeliest, probability_text
from reefmu.diagnosis.preprocessing.audit import ratio_from_angles
from reefmu.record import Record, read_record
from stiffness_model.plotting.style import BLUE, ORANGE, format_axes, new_figure
from stiffness_model.units import ARCMIN

COLUMNS = {
    "Timestamp": "time [s]",
    "encoder_motorinc_3": "crank_angle [rev/16777216]",
    "encoder_loadinc_3": "output_angle [rev/16777216]",
    "joint_torque_current_3": "referred_motor_torque [N.m]",
}


def picture(record: Record, ratio: float) -> Figure:
    """Twist and torque over the angle of the joint."""
    figure = new_figure(9.6, 4.0)
    left, right = figure.subplots(1, 2)
    twist, angle = record.twist(ratio), record.output_angle - record.output_angle.mean()
    left.plot(angle, (twist - twist.mean()) / ARCMIN, lw=0.8, color=BLUE)
    right.plot(angle, record.output_torque, lw=0.8, color=ORANGE)
    format_axes(left, "angle of the joint [rad]", "twist [arcmin]")
    format_axes(right, "angle of the joint [rad]", "motor's torque at the joint [N.m]")
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="robot-joint", type=Path)
    parser.add_argument("--data", default=Path("validate.csv"), type=Path)
    args = parser.parse_args()
    if not args.data.is_file():
        print(
            "This example needs measured records, which are not part of this repository: --data states the path of "
            f"utils/ML1/validate.csv of allwinlucious/MasterThesis on GitHub; none in {args.data}."
        )
        return
    record = read_record(args.data, COLUMNS)
    ratio = ratio_from_angles(record)
    assert ratio is not None  # both shafts turn
    print(record)
    print(f"ratio {ratio:g}; twist over {np.ptp(record.twist(ratio)) / ARCMIN:.3g} arcmin")
    found = diagnose_record(record, out=args.folder)
    print(found.sentence)
    for hypothesis in likeliest(found.hypotheses):
        print(f"{probability_text(hypothesis.probability):>6}  {hypothesis_text(hypothesis)}")
    print(f"gap {found.gap.before:.3g} N.m, noise {found.gap.noise:.3g} N.m")
    for step in found.next_experiment:
        print(f"next: {step}")
    picture(record, ratio).savefig(args.folder / "swing.png", dpi=120)


if __name__ == "__main__":
    main()
