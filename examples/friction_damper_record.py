"""A measured record of a rotary friction damper
=============================================

Diagnosis of a measured record: a rotary friction damper with backlash, driven by a sinusoidal displacement.

The records (D. Coble, P. Huggins, L. Cao, J. Ricles and A. Downey, 2022, CC BY-SA 4.0) are published on GitHub in
ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash, folder data/dataset-1/characterization datasets, and are not part
of this repository. A file is JSON with the columns time (s), displacement (in), friction force (kip) and three more.
Displacement and force act on a lever whose length scales twist and torque and changes no conclusion; 0.1 m is assumed.

::

    python examples/friction_damper_record.py [FOLDER] [--data FILE.json] [--every N]

prints what was understood and found, and writes diagnosis.json, report.html, model.toml and loop.png to FOLDER (default
friction-damper). Without the file it ends in one sentence. Every N-th sample is used (default 7, some 146 Hz).

The file 0.5Hz70lbtension.json (18 s, nine cycles) is ambiguous: friction of 1122 N.m (1078 to 1166) on this lever,
which one driven shaft cannot place inside the drive or at its output. The exponent of the power law ends at its lower
bound: beside so much friction the record hardly determines an elastic torque.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.report.text import bound_text
from reefmu.record import Record, make_record
from stiffness_model.units import quantity_text

INCH, KIP = 0.0254, 4448.2216
"""m and N."""
LEVER = 0.1
"""m, assumed."""


def read_damper(path: Path, every: int) -> Record:
    """The record of one file, on the assumed lever."""
    rows = np.array(json.loads(path.read_text("utf-8"))["data"])[::every]
    twist = rows[:, 1] * INCH / LEVER
    columns = {"time": rows[:, 0], "twist": twist - twist.mean(), "output_torque": rows[:, 2] * KIP * LEVER}
    return make_record(columns, path.name)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="friction-damper", type=Path)
    parser.add_argument("--data", default=Path("0.5Hz70lbtension.json"), type=Path)
    parser.add_argument("--every", default=7, type=int)
    args = parser.parse_args()
    if not args.data.is_file():
        print(
            "This example needs measured records, which are not part of this repository: --data states the path of a "
            f"file of ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash on GitHub; none in {args.data}."
        )
        return
    record = read_damper(args.data, args.every)
    twist, torque = record.twist(None), record.output_torque
    print(record)
    print(f"twist {twist.min():.3g} ... {twist.max():.3g} rad, torque {torque.min():.4g} ... {torque.max():.4g} N.m")
    found = diagnose_record(record, out=args.folder)
    print(found.sentence)
    for effect in found.effects:
        for name, value in effect.parameters.items():
            sizes = [quantity_text(v, value.unit) for v in (value.value, value.low, value.high)]
            print(f"{effect.name}.{name}: {sizes[0]} (95 %: {sizes[1]} to {sizes[2]})")
    for at_bound in found.at_bounds:
        print(bound_text(at_bound))
    for step in found.next_experiment:
        print(f"next: {step}")
    record.plot().get_figure(root=True).savefig(args.folder / "loop.png", dpi=120)


if __name__ == "__main__":
    main()
