"""Wear: the gear clearance grows in proportion to the path of the crank."""

import math

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place, Requirement, State

WEAR = Effect(
    name="wear",
    title="Gear clearance that grows with use",
    meaning="The gear clearance grows in proportion to the crank's travel in either direction; positive: more "
    "clearance.",
    place=Place.CLEARANCE,
    parameters=(Parameter("rate", "m/rad", 0.0, 0.0, 1e-4, 1e-8, "Gear clearance gained per radian of crank travel"),),
    states=(
        State(
            "travel",
            "rad",
            "Path of the crank since the record began, in both directions",
            IndependentVariable.CRANK,
            lambda signals, p: (0.0, 1.0),
            resets=False,
            nominal=lambda p, full_torque: math.tau,  # one turn
            minimum=0.0,
        ),
    ),
    contribution=lambda signals, p, x: p["rate"] * x["travel"],
    equation="clearance = drawn + wear.rate * travel,  d travel = |d crank angle|",
    excitation="The same loops through zero torque before and after many turns, in one record.",
    source="Archard, Contact and Rubbing of Flat Surfaces (1953): depth in proportion to the sliding distance.",
    identification=Identification(
        requirements=(Requirement.CRANK_ANGLE,), confounding_groups=(ConfoundingGroup.CLEARANCE,)
    ),
)
