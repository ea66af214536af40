"""What the contact model leaves out: one effect, one short file. `EFFECTS` holds them by name."""

from stiffness_model.errors import unknown_name

from .backlash import BACKLASH
from .base import (
    ConfoundingGroup,
    Effect,
    Identification,
    IndependentVariable,
    Parameter,
    Place,
    Requirement,
    Signals,
    State,
    ToleranceSignature,
)
from .coulomb_friction import COULOMB_FRICTION
from .creep import CREEP
from .damping import DAMPING
from .hysteresis import HYSTERESIS
from .kinematic_error import KINEMATIC_ERROR
from .load_dependent_hysteresis import LOAD_DEPENDENT_HYSTERESIS
from .missing_ball import MISSING_BALL
from .modulus_error import MODULUS_ERROR
from .preload import PRELOAD
from .stribeck_friction import STRIBECK_FRICTION
from .structural_compliance import STRUCTURAL_COMPLIANCE
from .thermal_clearance import THERMAL_CLEARANCE
from .torque_sensor_drift import TORQUE_SENSOR_DRIFT
from .torque_sensor_offset import TORQUE_SENSOR_OFFSET
from .viscous_friction import VISCOUS_FRICTION
from .wear import WEAR

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        KINEMATIC_ERROR,
        BACKLASH,
        PRELOAD,
        THERMAL_CLEARANCE,
        WEAR,
        MODULUS_ERROR,
        MISSING_BALL,
        STRUCTURAL_COMPLIANCE,
        CREEP,
        HYSTERESIS,
        LOAD_DEPENDENT_HYSTERESIS,
        DAMPING,
        COULOMB_FRICTION,
        VISCOUS_FRICTION,
        STRIBECK_FRICTION,
        TORQUE_SENSOR_OFFSET,
        TORQUE_SENSOR_DRIFT,
    )
}


def find_effect(name: str, where: str = "") -> Effect:
    """The effect of that name, or `UnknownNameError` with the closest names."""
    if name not in EFFECTS:
        raise unknown_name("effect", name, EFFECTS, where)
    return EFFECTS[name]


def separating_test(first: str, second: str) -> str:
    """The test that tells two effects apart, as part of a sentence.

    Declared with one of the two; where neither does, the tests that show each of them.

    >>> separating_test("wear", "thermal_clearance")
    'the same loops cold, warm and cold again'
    """
    for one, other in ((first, second), (second, first)):
        for name, test in find_effect(one).identification.separated_from:
            if name == other:
                return test
    return f"{find_effect(first).experiment}; and {find_effect(second).experiment}"


__all__ = [
    "EFFECTS",
    "IndependentVariable",
    "Effect",
    "ConfoundingGroup",
    "Identification",
    "ToleranceSignature",
    "Requirement",
    "Parameter",
    "Place",
    "Signals",
    "State",
    "find_effect",
    "separating_test",
]
