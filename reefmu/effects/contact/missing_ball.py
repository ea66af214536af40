"""Missing ball: one element carries nothing; the dip in the torque moves with the cage past the crank."""

from ..base import Effect, Identification, Parameter, Place, Requirement, ToleranceSignature

MISSING_BALL = Effect(
    name="missing_ball",
    title="One element that carries nothing",
    meaning="One element carries nothing. The dip in the torque turns with the cage past the crank, and the "
    "torque is smaller in magnitude while that element would carry.",
    place=Place.ELEMENT,
    parameters=(
        Parameter("size", "1", 0.0, 0.0, 1.0, 1.0, "Share of the element's torque that is missing; 1: no ball"),
        Parameter("phase", "rad", 0.0, -7.0, 7.0, 1.0, "Angle of its eccentric past the element at output angle 0"),
        Parameter("windup", "1", 0.0, 0.0, 1.0, 1.0, "Share of the twist that arises between cage and output shaft"),
    ),
    # The cage lags behind the output shaft by this share of the twist: at 1 its angle is the crank's over the ratio.
    contribution=lambda signals, p, x: (
        p["size"],
        p["phase"]
        + (signals.ratio - 1)
        * (signals.output_angle + p["windup"] * (signals.crank_angle / signals.ratio - signals.output_angle)),
    ),
    equation="torque -= size * torque of the element at beta,  beta = phase + (ratio - 1) * cage angle,  "
    "cage angle = output angle + windup * twist",
    excitation="Slow turns of the crank at constant twist; a locked crank at four or more angles.",
    source="Between rigid gear and cage the elements are independent (paper, section III): the solver's torque "
    "of one element over twist, clearance and position.",
    identification=Identification(
        requirements=(Requirement.CRANK_ANGLE, Requirement.DRAWING),
        tolerance_signature=ToleranceSignature.RIPPLE,
        shown_by="slow turns of the crank at constant twist",
        separated_from=(("kinematic_error", "turn the crank slowly at two constant twists"),),
    ),
)
