"""The declaration of an effect: parameters, states and equations, and the place along the drive where it acts.

Equations are written once, as CasADi expressions. The same ones serve simulation, fits, generated C and linearisation.
A state obeys dx/ds = a x + b over an independent variable s (time, or the path of an angle), where it has an elastic
range dx/ds = +-1 within it, so that it is advanced exactly over a step of any length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

Expression = Any
"""A CasADi expression. CasADi carries no types, and is imported only where a model is built."""
Values = Mapping[str, Expression]


class Place(Enum):
    """Where an effect acts, and what its contribution is added to; in the order along the drive."""

    CRANK = "torque subtracted at the crank, N.m"
    KINEMATIC = "subtracted from the twist that the two angles give, rad"
    CLEARANCE = "added to the gear clearance, m"
    MODULUS = "added to the relative error of the modulus of gear and cage, 1"
    ELEMENT = "torque of one element subtracted: the share of it, 1, and its position relative to the crank, rad"
    SERIES = "twist added under the elastic torque: a compliance, rad/(N.m), and an offset, rad"
    PARALLEL = "torque added to the elastic torque inside the drive, N.m"
    OUTPUT = "torque subtracted at the output shaft, N.m"
    SENSOR = "added to the measured torque, but not to the torque on the output, N.m"


class IndependentVariable(Enum):
    """What a state evolves along: time, or the path of an angle."""

    TIME = "time"
    TWIST = "twist"
    CRANK = "crank"
    OUTPUT = "output"


class Signals(NamedTuple):
    """What effects may read; angles rad, speeds rad/s, torque N.m, temperature degC.

    twist: after the kinematic effects; its rate and direction, and the path of states along the twist, are those of
    crank_angle/ratio - output_angle. *_direction: sign of the change, -1, 0 or 1. elastic_torque: of the contacts;
    known to effects at the crank, inside the drive and at the output, to states that evolve in time and to those that
    depend on the load, None before. ratio: of the crank's angle to the output's, signed.
    """

    crank_angle: Expression
    crank_speed: Expression
    output_angle: Expression
    output_speed: Expression
    temperature: Expression
    twist: Expression
    twist_rate: Expression
    twist_direction: Expression
    crank_direction: Expression
    output_direction: Expression
    elastic_torque: Expression
    ratio: Expression


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    neutral: the value at which the effect changes nothing, or, for a parameter that does not switch the effect off by
    itself (a length, a phase), the value to start from. nominal: a typical size.
    """

    name: str
    unit: str
    neutral: float
    minimum: float
    maximum: float
    nominal: float
    description: str


@dataclass(frozen=True)
class State:
    """One state, zero at the start unless an FMU states a start value. equation: (signals, parameters) -> (a, b) of
    dx/ds = a x + b.

    resets: whether every run of a record starts it anew; false for what accumulates over the whole record. nominal:
    (parameters, full torque in N.m) -> a typical size, to which integrators relate their error. elastic_range:
    (signals, parameters) -> (direction, end) of a state along an angle that obeys dx/ds = direction until it has
    reached `end` in that direction, and the equation beyond. depends_on_load: whether a state along an angle reads the
    elastic torque, so that it is advanced after the contacts. minimum, maximum: bounds of a start value.
    """

    name: str
    unit: str
    description: str
    independent_variable: IndependentVariable
    equation: Callable[[Signals, Values], tuple[Expression, Expression]]
    resets: bool = True
    nominal: Callable[[Mapping[str, float], float], float] = lambda parameters, full_torque: 1.0
    elastic_range: Callable[[Signals, Values], tuple[Expression, Expression]] | None = None
    depends_on_load: bool = False
    minimum: float | None = None
    maximum: float | None = None

    @property
    def is_share(self) -> bool:
        """Whether it is a share between two bounds, as that of a friction that is built up."""
        return self.minimum is not None and self.maximum is not None


class Requirement(Enum):
    """What a diagnosis needs to consider an effect; the value states what is missing otherwise."""

    TEMPERATURE = "the record has no temperature that changes"
    CRANK_ANGLE = "the record has no crank angle"
    DRAWING = "there is no drawing"


class ConfoundingGroup(Enum):
    """Groups whose members absorb each other's misfit when the true law differs from the model's."""

    FRICTION = "friction"
    COMPLIANCE = "compliance"
    CLEARANCE = "clearance"
    SENSOR = "sensor"


class ToleranceSignature(Enum):
    """What the tolerances of an individual drive's parts change in the same way as an effect."""

    CURVE = "a change of the curve of torque over twist"
    RIPPLE = "a ripple over the angle of the crank"


FORM_UNCERTAINTY = 0.005
"""Standard deviation of a parameter, over its value, due to the form of the effect's law. Chosen by judgement."""


@dataclass(frozen=True)
class Identification:
    """What a fit to a measured record needs to know of an effect besides its equations.

    requirements: columns or a drawing, without which the effect is no candidate. confounding_groups: of effects that
    absorb each other's misfit. tolerance_signature: what an individual drive's tolerances change in the same way.
    sign_pair: the effect that is the same quantity with the other sign. limit_of: the more general effect of which this
    one is a limit. separated_from: names of other effects, each with the test that tells the two apart. shown_by: the
    test that shows the effect alone, where it differs from its excitation. not_a_candidate: why no record can show the
    effect, as part of a sentence; empty for an effect that a diagnosis may name. form_uncertainty: see
    `FORM_UNCERTAINTY`.
    """

    requirements: tuple[Requirement, ...] = ()
    confounding_groups: tuple[ConfoundingGroup, ...] = ()
    tolerance_signature: ToleranceSignature | None = None
    sign_pair: str = ""
    limit_of: str = ""
    separated_from: tuple[tuple[str, str], ...] = ()
    shown_by: str = ""
    not_a_candidate: str = ""
    form_uncertainty: float = FORM_UNCERTAINTY


@dataclass(frozen=True, repr=False)
class Effect:
    """One effect that the contact model leaves out.

    title: a few words. meaning: what the effect is and its sign, in sentences. contribution: (signals, parameters,
    states) -> expression in the unit of its `Place`; a series effect returns the pair (compliance, offset), a missing
    element the pair (share, position). equation: the same as text, for reports. excitation: what a test must do to show
    it. amplitudes: names of the parameters that must all be neutral for the effect to change nothing; the first
    parameter alone where none are named. identification: what the diagnosis knows of it.

    Two effects are equal if all fields are; functions are compared by identity.
    """

    name: str
    title: str
    meaning: str
    place: Place
    parameters: tuple[Parameter, ...]
    contribution: Callable[[Signals, Values, Values], Expression]
    equation: str
    excitation: str
    source: str
    states: tuple[State, ...] = ()
    amplitudes: tuple[str, ...] = ()
    identification: Identification = Identification()

    def __post_init__(self) -> None:
        if not self.amplitudes:
            object.__setattr__(self, "amplitudes", (self.parameters[0].name,))

    def __repr__(self) -> str:
        """One line: name, place and parameters with their units."""
        parameters = ", ".join(f"{p.name} [{p.unit}]" for p in self.parameters)
        return f"Effect({self.name!r}, {self.place.name.lower()}: {parameters})"

    @property
    def experiment(self) -> str:
        """The test that shows the effect, as part of a sentence."""
        return self.identification.shown_by or self.excitation.rstrip(".").lower()

    @property
    def friction_paths(self) -> frozenset[IndependentVariable]:
        """The angles along which it builds up friction."""
        return frozenset(state.independent_variable for state in self.states if state.is_share)
