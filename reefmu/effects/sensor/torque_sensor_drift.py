"""Torque sensor drift: the sensor's zero drifts over the whole record."""

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place, State

TORQUE_SENSOR_DRIFT = Effect(
    name="torque_sensor_drift",
    title="Drifting zero of the torque sensor",
    meaning="An error of the torque sensor that grows with time over the whole record, not with load; positive: "
    "it reads more and more. The torque on the output is not changed.",
    place=Place.SENSOR,
    parameters=(
        Parameter("rate", "N.m/s", 0.0, -100.0, 100.0, 1e-3, "Initial rate of the drift"),
        Parameter("settling", "s", 1e12, 1.0, 1e12, 1e4, "Time constant of the drift; at its maximum it is linear"),
    ),
    states=(
        State(
            "grown",
            "s",
            "Time since the record began, as long as the drift is linear",
            IndependentVariable.TIME,
            lambda signals, p: (-1 / p["settling"], 1.0),
            resets=False,
            minimum=0.0,
        ),
    ),
    contribution=lambda signals, p, x: p["rate"] * x["grown"],
    equation="measured torque = output torque + torque_sensor_drift.rate * g,  "
    "dg/dt = 1 - g / torque_sensor_drift.settling, from the beginning of the record",
    excitation="Unloaded readings, or the same loop, at the beginning and the end of a long record.",
    source="A property of the rig, not of the drive: linear, or settling as its electronics warm up; at any load.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.SENSOR,),
        shown_by="unloaded readings at the beginning and the end of a long record",
    ),
)
