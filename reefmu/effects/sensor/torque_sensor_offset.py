"""Torque sensor offset: the sensor's reading without torque."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

TORQUE_SENSOR_OFFSET = Effect(
    name="torque_sensor_offset",
    title="Zero error of the torque sensor",
    meaning="A constant added to the torque that the rig's sensor shows; positive: it reads too much. The torque "
    "on the output is not changed.",
    place=Place.SENSOR,
    parameters=(Parameter("torque", "N.m", 0.0, -1e4, 1e4, 1.0, "Reading without torque"),),
    contribution=lambda signals, p, x: p["torque"],
    equation="measured torque = output torque + torque_sensor_offset.torque",
    excitation="A reading of the unloaded drive; with the drive reversed, an offset keeps its sign.",
    source="A property of the rig, not of the drive: the zero signal of a torque transducer.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.SENSOR,),
        tolerance_signature=ToleranceSignature.CURVE,
        shown_by="a reading of the unloaded drive, also with the drive reversed",
        separated_from=(("torque_sensor_drift", "an unloaded reading at the beginning and the end"),),
    ),
)
