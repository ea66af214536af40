"""What the contact model leaves out: one effect, one short file. `EFFECTS` holds them by name.

* `base`: the declaration of an effect; `effect_facts`: what follows from the declarations; `effects_page`: its page.
* `twist`, `contact`, `friction`, `sensor`: the effects by what they act on, in the order along the drive.
"""

from collections.abc import Mapping
from types import MappingProxyType

from stiffness_model.errors import unknown_name

from .base import (
    FORM_UNCERTAINTY,
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
from .contact.backlash import BACKLASH
from .contact.missing_ball import MISSING_BALL
from .contact.modulus_error import MODULUS_ERROR
from .contact.preload import PRELOAD
from .contact.thermal_clearance import THERMAL_CLEARANCE
from .contact.wear import WEAR
from .friction.coulomb_friction import COULOMB_FRICTION
from .friction.crank_friction import CRANK_FRICTION
from .friction.damping import DAMPING
from .friction.elastoplastic_friction import ELASTOPLASTIC_FRICTION
from .friction.hysteresis import HYSTERESIS
from .friction.load_dependent_hysteresis import LOAD_DEPENDENT_HYSTERESIS
from .friction.stribeck_friction import STRIBECK_FRICTION
from .friction.viscous_friction import VISCOUS_FRICTION
from .sensor.torque_sensor_drift import TORQUE_SENSOR_DRIFT
from .sensor.torque_sensor_offset import TORQUE_SENSOR_OFFSET
from .twist.creep import CREEP
from .twist.kinematic_error import KINEMATIC_ERROR
from .twist.structural_compliance import STRUCTURAL_COMPLIANCE

_DECLARED: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        CRANK_FRICTION,
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
        ELASTOPLASTIC_FRICTION,
        TORQUE_SENSOR_OFFSET,
        TORQUE_SENSOR_DRIFT,
    )
}
EFFECTS: Mapping[str, Effect] = MappingProxyType(_DECLARED)
"""The effects by name, in the order in which they are listed."""


def find_effect(name: str, where: str = "") -> Effect:
    """The effect of that name. Raises `UnknownNameError` with the closest names."""
    if name not in EFFECTS:
        raise unknown_name("effect", name, EFFECTS, where)
    return EFFECTS[name]


def declared_test(first: str, second: str) -> str:
    """The declared test that tells two effects apart, as part of a sentence; empty without one.

    >>> declared_test("wear", "thermal_clearance")
    'the same loops cold, warm and cold again'
    """
    for one, other in ((first, second), (second, first)):
        for name, test in find_effect(one).identification.separated_from:
            if name == other:
                return test
    return ""


def separating_test(first: str, second: str) -> str:
    """The test that tells two effects apart, as part of a sentence; without a declared one, the tests of both.

    >>> separating_test("damping", "viscous_friction")
    'rotate at constant twist, and loop with the crank locked'
    """
    return declared_test(first, second) or f"{find_effect(first).experiment}; and {find_effect(second).experiment}"


__all__ = [
    "EFFECTS",
    "FORM_UNCERTAINTY",
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
    "declared_test",
    "find_effect",
    "separating_test",
]
