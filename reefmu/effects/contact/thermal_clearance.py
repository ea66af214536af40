"""Thermal clearance: the gear clearance changes in proportion to the temperature above 20 degC."""

from stiffness_model.units import REFERENCE_TEMPERATURE

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, Requirement

THERMAL_CLEARANCE = Effect(
    name="thermal_clearance",
    title="Gear clearance that follows the temperature",
    meaning="The gear clearance changes in proportion to the temperature less 20 degC; positive: it grows as the "
    "drive warms up.",
    place=Place.CLEARANCE,
    parameters=(Parameter("rate", "m/K", 0.0, -1e-4, 1e-4, 3e-7, "Gear clearance gained per kelvin above 20 degC"),),
    contribution=lambda signals, p, x: p["rate"] * (signals.temperature - REFERENCE_TEMPERATURE),
    equation="clearance = drawn + thermal_clearance.rate * (temperature - 20 degC)",
    excitation="The same loops through zero torque, cold and warm, with the temperature in the record.",
    source="Linear expansion: a steel radius of 48 mm grows by 0.55 um/K, a PLA gear around steel parts by some "
    "3 um/K more than they do. Negative where the inner parts warm up first.",
    identification=Identification(
        requirements=(Requirement.TEMPERATURE,),
        confounding_groups=(ConfoundingGroup.CLEARANCE,),
        separated_from=(("wear", "the same loops cold, warm and cold again"),),
    ),
)
