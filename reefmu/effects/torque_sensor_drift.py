"""Torque sensor drift: the sensor's zero moves with time over the whole record."""

from .base import Along, Effect, Parameter, Place, State

TORQUE_SENSOR_DRIFT = Effect(
    name="torque_sensor_drift",
    title="Moving zero of the torque sensor",
    place=Place.SENSOR,
    parameters=(
        Parameter("rate", "N.m/s", 0.0, -100.0, 100.0, 1e-3, "Change of the reading without torque"),
    ),
    states=(
        State("elapsed", "s", "Time since the record began", Along.TIME, lambda signals, p: (0.0, 1.0), resets=False),
    ),
    contribution=lambda signals, p, x: p["rate"] * x["elapsed"],
    equation="measured torque = output torque + torque_sensor_drift.rate * time since the record began",
    excitation="Unloaded readings, or the same loop, at the beginning and the end of a long record.",
    source="What the rig does, not the drive: linear in time, whatever the load.",
)
