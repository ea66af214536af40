"""Effects and their values on the command line: NAME, or NAME.PARAMETER=VALUE with its unit."""

from __future__ import annotations

from collections.abc import Iterable

from reefmu.effects import find_effect
from reefmu.model.model_file import parse_parameter
from stiffness_model.errors import expect, unknown_name


def effect_values(words: Iterable[str], where: str = "--effect") -> dict[str, dict[str, float]]:
    """Parameter values by effect and parameter name, SI, from the words of repeated options.

    A name alone puts a neutral effect inside. Raises `UnknownNameError` or `InputError` for what is no effect, no
    parameter of it, no value in the parameter's unit, or a value given twice.

    >>> effect_values(["hysteresis.torque=2 N.m", "creep"])
    {'hysteresis': {'torque': 2.0}, 'creep': {}}
    """
    values: dict[str, dict[str, float]] = {}
    for word in words:
        left, equals, text = (part.strip() for part in word.partition("="))
        name, dot, parameter = left.partition(".")
        effect = find_effect(name, where)
        own = values.setdefault(effect.name, {})
        if not dot and not equals:
            continue
        known = {p.name: p for p in effect.parameters}
        example = f"{name}.{effect.parameters[0].name}='{effect.parameters[0].nominal:g} {effect.parameters[0].unit}'"
        expect(bool(dot and equals and text), f"NAME or NAME.PARAMETER=VALUE, such as {example}", word, where)
        if parameter not in known:
            raise unknown_name("parameter", parameter, known, f"{where} {name}")
        expect(parameter not in own, f"{left} once", "it twice", where)
        own[parameter] = parse_parameter(_bare(text, known[parameter].unit), known[parameter], f"{where} {left}")
    return values


def _bare(text: str, unit: str) -> str | float:
    """A dimensionless value as a number; a text that is none is left for the reader to refuse."""
    try:
        return float(text) if unit == "1" else text
    except ValueError:
        return text
