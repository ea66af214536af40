"""The order of the effects along the drive, declared once.

The drive is a chain of stages around the table of its contacts. Each stage is one function, and this module states what
it reads, what it writes, which effects act in it and in which order the stages run. Three programs follow it:
`composition` chains the stages' CasADi expressions into the model's functions, `reefmu.diagnosis.forward.predictor`
evaluates them over a whole record with sensitivities, and `reefmu.fmu.codegen.stage_order` writes the calls in C.

    x   states: the last values of the angles that states evolve along, then the effects' own
    u   inputs; p: parameters; dt: length of a step, s
    k   kinematics: twist of the contacts and all compliances, rad, and its derivative by the crank's angle
    r   coefficients: `coefficient_names`
    q   contact point: `contact_point_names`
    c   contact outputs: `CONTACT_OUTPUTS`
    dx  rates of the states; y: outputs
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...effects import Effect, IndependentVariable, Place


class Stage(NamedTuple):
    """One function of the chain. reads, writes: variables of the module; places: where effects act in it."""

    name: str
    reads: tuple[str, ...]
    writes: str
    places: tuple[Place, ...] = ()


KINEMATICS = Stage("kinematics", ("u", "p"), "k", (Place.KINEMATIC,))
ADVANCE_ANGLES = Stage("advance_angles", ("x", "u", "k", "p"), "x")
"""States that evolve along an angle, after the angles have moved to those of the inputs; the contacts may depend on
them."""
COEFFICIENTS = Stage("coefficients", ("x", "u", "k", "p"), "r", (Place.SERIES, Place.ELEMENT, Place.MODULUS))
"""In C these depend on the parameters alone, and are kept until one of them changes."""
CONTACT_POINT = Stage("contact_point", ("x", "u", "k", "p"), "q", (Place.CLEARANCE, Place.SERIES, Place.ELEMENT))
CONTACTS = Stage("contacts", ("q", "r"), "c")
"""The table, or an individual's own contacts, in series with the compliance."""
ADVANCE_TIME = Stage("advance_time", ("x", "u", "k", "dt", "p", "c"), "x")
"""States that evolve in time, after a step with the angles held."""
ADVANCE_LOADED = Stage("advance_loaded", ("x", "u", "k", "p", "c"), "x")
"""States that evolve along an angle and depend on the load, likewise; the contacts do not depend on them."""
SETTLE = Stage("settle", ("x", "u", "k", "p", "c"), "x")
"""States that evolve in time, moved by what the torque adds to them once it has been held for long: a start in
equilibrium."""
RATE = Stage("rate", ("x", "u", "k", "p", "c"), "dx")
OUTPUT = Stage("output", ("x", "u", "k", "p", "c"), "y", (Place.CRANK, Place.PARALLEL, Place.OUTPUT, Place.SENSOR))

STAGES = (
    KINEMATICS,
    ADVANCE_ANGLES,
    COEFFICIENTS,
    CONTACT_POINT,
    CONTACTS,
    ADVANCE_LOADED,
    ADVANCE_TIME,
    SETTLE,
    RATE,
    OUTPUT,
)
CONTACT_EQUILIBRIUM = (COEFFICIENTS, CONTACT_POINT, CONTACTS)
"""The stages that lead to the contact outputs at given states and inputs."""
TORQUE_CHAIN = ((Place.PARALLEL, 1), (Place.OUTPUT, -1), (Place.SENSOR, 1))
"""Torques that are added to the elastic torque, in this order and with these signs: after the first it is the torque
inside the drive, after the second that on the output, after the third what the sensor reads. What acts at the crank is
subtracted there from the torque inside the drive, over the ratio."""
CONTACT_OUTPUTS = ("torque", "stiffness", "max_contact_force", "load_share", "in_range")
"""Elastic torque, N.m; its derivative by the target, N.m/rad; the table's further quantities."""

_ANGLES = (IndependentVariable.TWIST, IndependentVariable.CRANK, IndependentVariable.OUTPUT)


def advance_order(*, angles: bool, time: bool, torque: bool, loaded: bool = False) -> tuple[Stage, ...]:
    """The stages that bring the states from one sample to the next, the kinematics being known.

    angles, time: whether states evolve along angles, and in time; torque: whether the latter depend on the contacts;
    loaded: whether states along angles do.

    >>> [stage.name for stage in advance_order(angles=True, time=True, torque=True)]
    ['advance_angles', 'coefficients', 'contact_point', 'contacts', 'advance_time']
    """
    return (
        *((ADVANCE_ANGLES,) if angles else ()),
        *(CONTACT_EQUILIBRIUM if (time and torque) or loaded else ()),
        *((ADVANCE_LOADED,) if loaded else ()),
        *((ADVANCE_TIME,) if time else ()),
    )


def stored_angles(effects: Sequence[Effect]) -> tuple[IndependentVariable, ...]:
    """The angles whose last value is a state of the model, because another state evolves along them."""
    used = {state.independent_variable for effect in effects for state in effect.states}
    return tuple(angle for angle in _ANGLES if angle in used)


def angles_under_load(effects: Sequence[Effect]) -> tuple[IndependentVariable, ...]:
    """The angles along which states that depend on the load evolve."""
    used = {state.independent_variable for effect in effects for state in effect.states if state.depends_on_load}
    return tuple(angle for angle in _ANGLES if angle in used)


def has_time_states(effects: Sequence[Effect]) -> bool:
    """Whether a state evolves in time."""
    return any(s.independent_variable is IndependentVariable.TIME for e in effects for s in e.states)


def coefficient_names(elements: int = 1) -> tuple[str, ...]:
    """Entries of r: compliance in series with the contacts, rad/(N.m); missing share of each of `elements` elements;
    factor of the torque for another modulus; position in the population, -1 to 1."""
    return ("compliance", *_numbered("missing", elements), "scale", "band")


def contact_point_names(elements: int = 1, *, individual: bool = False) -> tuple[str, ...]:
    """Entries of q: twist of contacts and compliance together, rad; gear clearance, m; position of each missing
    element, rad; for an individual, whose contacts change as it turns, also the output's angle, rad."""
    return ("target", "clearance", *_numbered("position", elements), *(("angle",) if individual else ()))


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return (name, *(f"{name}_{k}" for k in range(2, count + 1)))
