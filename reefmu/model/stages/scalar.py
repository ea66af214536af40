"""The stages as functions in scalars, for programs that read the tables by code of their own: the native FMU.

They are made of the same expressions as the model's functions, without tables. An individual and a curve have no
table; their contacts are a function too, which is not in scalars:

    contact_function(q) -> c         q: twist of the contacts alone, clearance, output angle (0 for a curve)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.rotation import Individual

from ...effects import Effect, Place
from .composition import Composition, stage_function
from .order import COEFFICIENTS, CONTACTS, STAGES, Stage, has_time_states

SCALAR_STAGES = tuple(
    stage._replace(reads=("p",)) if stage is COEFFICIENTS else stage for stage in STAGES if stage is not CONTACTS
)
"""The stages that become functions in scalars, with what they may read there: coefficients are
recomputed when a parameter changes, and no more often."""


@dataclass(frozen=True)
class ScalarStages:
    """The stages of one model.

    functions: of `SCALAR_STAGES`, by name. advance_order: the stages that advance the states. has_angle_states,
    has_time_states: whether states evolve along angles, and in time. has_series_compliance: whether a compliance may
    act in series with the contacts. point_names, coefficient_names: entries of q and r. contact_function: None for a
    model with tables.
    """

    functions: Mapping[str, ca.Function]
    advance_order: tuple[Stage, ...]
    has_angle_states: bool
    has_time_states: bool
    has_series_compliance: bool
    point_names: tuple[str, ...]
    coefficient_names: tuple[str, ...]
    contact_function: ca.Function | None


def make_scalar_stages(lookup: Lookup, effects: Sequence[Effect], individual: Individual | None = None) -> ScalarStages:
    """The stages of the model of this lookup and these effects, or of an individual.

    Raises `NotImplementedError` for effects that read what the stage of their place does not, and for more than one
    effect that takes an element away.
    """
    if sum(effect.place is Place.ELEMENT for effect in effects) > 1:
        raise NotImplementedError("expected one effect that takes an element away, got several")
    whole = Composition(lookup, tuple(effects), individual)
    contacts = None
    if individual is not None or isinstance(lookup, CurveLookup):
        q = ca.MX.sym("q", 3)
        contacts = ca.Function("contact_function", [q], [ca.vertcat(*whole.table(q[0], q[1], q[2]))])
    symbols = whole.drive.symbols
    functions = {
        stage.name: scalar_function(stage.name, [symbols[n] for n in stage.reads], whole.expressions[stage.name])
        for stage in SCALAR_STAGES
    }
    return ScalarStages(
        MappingProxyType(functions),
        whole.advance_order,
        bool(whole.drive.angles),
        has_time_states(effects),
        whole.has_series_compliance,
        whole.drive.point_names,
        whole.drive.coefficient_names,
        contacts,
    )


def scalar_function(name: str, arguments: list[ca.MX], result: ca.MX) -> ca.Function:
    """`stage_function` in scalars, which computes equal expressions once, such as the torques of outputs and rates."""
    return stage_function(name, arguments, result).expand(name, {"cse": True})
