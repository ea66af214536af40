"""protocol.csv: the set points of a protocol over time, one row for each sample that is to be recorded."""

from __future__ import annotations

import io

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ..protocols.schedule import Schedule, motion_record, run_numbers

COLUMNS = (
    "time [s]",
    "run",
    "crank_angle [rad]",
    "twist [arcmin]",
    "torque_set_point [N.m]",
    "temperature [degC]",
)
"""Columns of protocol.csv. The torque is that of the mean drive at the twist: a rig that controls the torque takes it
instead of the twist."""


def protocol_csv(schedule: Schedule, drive: Drive, torque: Array) -> str:
    """The text of protocol.csv.

    torque: (n,) N.m, of the mean drive at the samples of the schedule. `reefmu.record.read_record` reads the text as a
    record of the mean drive with the map {"time [s]": "time [s]", "run": "run", "twist [arcmin]": "twist [arcmin]",
    "torque_set_point [N.m]": "output_torque [N.m]"}.
    """
    record = motion_record(schedule, drive.ratio)
    values = [
        record.time,
        run_numbers(schedule),
        record.crank_angle,
        record.twist(drive.ratio) / ARCMIN,
        torque,
        record.temperature,
    ]
    text = io.StringIO()
    formats = ["%.10g", "%d", "%.10g", "%.7g", "%.6g", "%.4g"]
    np.savetxt(text, np.stack(values, axis=1), formats, ",", header=",".join(COLUMNS), comments="", encoding="utf-8")
    return text.getvalue()
