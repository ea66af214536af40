"""Torque sensor offset: what the sensor reads without torque."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

TORQUE_SENSOR_OFFSET = Effect(
    name="torque_sensor_offset",
    title="Zero error of the torque sensor",
    place=Place.SENSOR,
    parameters=(Parameter("torque", "N.m", 0.0, -1e4, 1e4, 1.0, "Reading without torque"),),
    contribution=lambda signals, p, x: p["torque"],
    equation="measured torque = output torque + torque_sensor_offset.torque",
    excitation="A reading of the unloaded drive; turned round, an offset keeps its sign.",
    source="What the rig does, not the drive: the zero signal of a torque transducer.",
    identification=Identification(
        confounding_group=ConfoundingGroup.SENSOR,
        tolerance_signature=ToleranceSignature.CURVE,
        shown_by="a reading of the unloaded drive, turned round as well",
        separated_from=(("torque_sensor_drift", "an unloaded reading at the beginning and the end"),),
    ),
)
