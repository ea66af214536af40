"""What follows from the declarations of the effects: candidates of a record, confusions, an example, a plain table."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from stiffness_model.units import MICROMETRE

from . import EFFECTS, ConfoundingGroup, Effect, Parameter, Requirement, declared_test, find_effect


class Confusion(NamedTuple):
    """Another effect that leaves a similar trace in a record, and why.

    test: the one that tells the two apart; empty where it takes those that show either effect.
    """

    name: str
    reason: str
    test: str


def confusions(effect: Effect) -> list[Confusion]:
    """The effects that one effect may be confused with, in the order along the drive.

    >>> [found.name for found in confusions(EFFECTS["kinematic_error"])]
    ['missing_ball']
    """
    return [
        Confusion(other.name, reason, declared_test(effect.name, other.name))
        for other in EFFECTS.values()
        if other is not effect and (reason := _reason(effect, other))
    ]


def select_candidates(missing: Sequence[str], base_kind: str) -> tuple[tuple[str, ...], dict[str, str]]:
    """Effects that a record without the columns `missing` can show beside a base curve of this kind, and the excluded
    ones with the reason."""
    lacks = {
        Requirement.TEMPERATURE: "temperature" in missing,
        Requirement.CRANK_ANGLE: "crank_angle" in missing,
        Requirement.DRAWING: base_kind != "drawing",
    }
    excluded = {
        name: requirement.value
        for requirement in Requirement
        if lacks[requirement]
        for name, effect in EFFECTS.items()
        if requirement in effect.identification.requirements
    }
    excluded |= {
        name: effect.identification.not_a_candidate
        for name, effect in EFFECTS.items()
        if effect.identification.not_a_candidate
    }
    return tuple(name for name in EFFECTS if name not in excluded), excluded


def _reason(effect: Effect, other: Effect) -> str:
    """Why two effects may be confused, as the rest of a sentence; empty if they are told apart by any record."""
    one, two = effect.identification, other.identification
    if other.name == one.sign_pair:
        return "the same quantity with the other sign"
    if other.name == one.limit_of:
        return f"{effect.name} is a limit of it"
    if two.limit_of == effect.name:
        return f"a limit of {effect.name}"
    if shared := [group for group in one.confounding_groups if group in two.confounding_groups]:
        return f"also {_GROUPS[shared[0]]}"
    return "a similar trace" if declared_test(effect.name, other.name) else ""


_GROUPS = {
    ConfoundingGroup.FRICTION: "a loss that opens a loop",
    ConfoundingGroup.COMPLIANCE: "a change of the slope",
    ConfoundingGroup.CLEARANCE: "a change of the clearance",
    ConfoundingGroup.SENSOR: "an error of the sensor",
}
"""What the members of a confounding group have in common."""


def confusion_lines(effect: Effect) -> list[str]:
    """What the effect may be confused with, in sentences that begin with a name: effects, then tolerances.

    >>> confusion_lines(EFFECTS["torque_sensor_drift"])
    ['torque_sensor_offset (also an error of the sensor); test: an unloaded reading at the beginning and the end']
    """
    found = confusions(effect)
    lines = [f"{other.name} ({other.reason}); test: {other.test}" for other in found if other.test]
    others = [other for other in found if not other.test]
    for reason in dict.fromkeys(other.reason for other in others):
        names = ", ".join(other.name for other in others if other.reason == reason)
        lines.append(f"{names} ({reason}); test: those that show either")
    if trace := tolerance_trace(effect):
        lines.append(f"the tolerances of an individual drive, which also make {trace}")
    return lines


def tolerance_trace(effect: Effect) -> str:
    """What the tolerances of an individual drive change in the same way as the effect; empty if nothing."""
    signature = effect.identification.tolerance_signature
    return "" if signature is None else signature.value


def example_value(parameter: Parameter) -> str:
    """The typical value of a parameter with its unit, as `--effect` takes it.

    >>> example_value(EFFECTS["backlash"].parameters[0]), example_value(EFFECTS["missing_ball"].parameters[0])
    ('5 um', '1')
    """
    if parameter.unit == "m":
        return f"{parameter.nominal / MICROMETRE:g} um"
    return f"{parameter.nominal:g} {parameter.unit}".removesuffix(" 1")


def example_call(effect: Effect) -> str:
    """A call of the program that exports an FMU with the effect at a typical size.

    >>> example_call(EFFECTS["backlash"])
    "reefmu export drive_1 -o drive_1.fmu --effect 'backlash.clearance=5 um'"
    """
    first = effect.parameters[0]
    value = f"{effect.name}.{first.name}={example_value(first)}"
    return shlex.join(["reefmu", "export", "drive_1", "-o", "drive_1.fmu", "--effect", value])


def may_be_named(names: Iterable[str]) -> list[str]:
    """The effects among these that a diagnosis may name from some record, each once: those for which tests are planned.

    >>> may_be_named(["hysteresis", "crank_friction", "hysteresis"])
    ['hysteresis']
    """
    return [name for name in dict.fromkeys(names) if not find_effect(name).identification.not_a_candidate]


def plan_call(drive: str, names: Iterable[str]) -> str:
    """A call of the program that plans the test which separates effects, without those that no record shows; empty
    where none is left. drive: as typed in a shell.

    >>> plan_call("drive_1", ["hysteresis", "crank_friction", "damping"])
    'reefmu plan drive_1 --effects hysteresis,damping --out plan'
    """
    shown = may_be_named(names)
    return f"reefmu plan {drive} --effects {','.join(shown)} --out plan" if shown else ""


def effect_to_dict(effect: Effect) -> dict[str, Any]:
    """All that is declared of an effect and follows from it, as plain tables for JSON. SI."""
    return {
        "name": effect.name,
        "title": effect.title,
        "meaning": effect.meaning,
        "place": effect.place.name.lower(),
        "acts": effect.place.value,
        "equation": effect.equation,
        "parameters": [dict(_parameter(effect, parameter)) for parameter in effect.parameters],
        "states": [
            {
                "name": f"{effect.name}.{state.name}",
                "unit": state.unit,
                "meaning": state.description,
                "evolves_along": state.independent_variable.value,
                "resets_with_every_run": state.resets,
            }
            for state in effect.states
        ],
        "shown_by": effect.excitation,
        "not_diagnosed_if": [requirement.value for requirement in effect.identification.requirements],
        "not_diagnosed_because": effect.identification.not_a_candidate,
        "confused_with": [found._asdict() for found in confusions(effect)],
        "like_tolerances": tolerance_trace(effect),
        "source": effect.source,
        "example": example_call(effect),
    }


def _parameter(effect: Effect, parameter: Parameter) -> Iterator[tuple[str, Any]]:
    yield "name", f"{effect.name}.{parameter.name}"
    yield "unit", parameter.unit
    yield "default", parameter.neutral
    yield "neutral_at_default", parameter.name in effect.amplitudes
    yield "minimum", parameter.minimum
    yield "maximum", parameter.maximum
    yield "typical", parameter.nominal
    yield "meaning", parameter.description
