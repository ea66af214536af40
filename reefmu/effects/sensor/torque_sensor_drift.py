"""Torque sensor drift: the sensor's zero moves with time over the whole record."""

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place, State

TORQUE_SENSOR_DRIFT = Effect(
    name="torque_sensor_drift",
    title="Moving zero of the torque sensor",
    place=Place.SENSOR,
    parameters=(
        Parameter("rate", "N.m/s", 0.0, -100.0, 100.0, 1e-3, "Change of the reading without torque, at first"),
        Parameter("settling", "s", 1e12, 1.0, 1e12, 1e4, "Time to 63 % of where it settles; the greatest: never"),
    ),
    states=(
        State(
            "grown",
            "s",
            "Time since the record began, while nothing settles",
            IndependentVariable.TIME,
            lambda signals, p: (-1 / p["settling"], 1.0),
            resets=False,
        ),
    ),
    contribution=lambda signals, p, x: p["rate"] * x["grown"],
    equation="measured torque = output torque + torque_sensor_drift.rate * g,  "
    "dg/dt = 1 - g / torque_sensor_drift.settling, from the record's begin",
    excitation="Unloaded readings, or the same loop, at the beginning and the end of a long record.",
    source="What the rig does, not the drive: linear in time, or settling as a case that warms up; whatever the load.",
    identification=Identification(
        confounding_group=ConfoundingGroup.SENSOR,
        shown_by="unloaded readings at the beginning and the end of a long record",
    ),
)
