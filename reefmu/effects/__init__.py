"""What the contact model leaves out: one effect, one short file. `EFFECTS` holds them by name."""

from stiffness_model.errors import unknown_name

from .backlash import BACKLASH
from .base import Along, Effect, Parameter, Place, Signals, State
from .hysteresis import HYSTERESIS
from .kinematic_error import KINEMATIC_ERROR
from .preload import PRELOAD
from .structural_compliance import STRUCTURAL_COMPLIANCE

EFFECTS: dict[str, Effect] = {
    effect.name: effect for effect in (
        KINEMATIC_ERROR,
        BACKLASH,
        PRELOAD,
        STRUCTURAL_COMPLIANCE,
        HYSTERESIS,
    )
}


def find_effect(name: str, where: str = "") -> Effect:
    """The effect of that name, or `UnknownNameError` with the closest names."""
    if name not in EFFECTS:
        raise unknown_name("effect", name, EFFECTS, where)
    return EFFECTS[name]


__all__ = ["EFFECTS", "Along", "Effect", "Parameter", "Place", "Signals", "State", "find_effect"]
