"""Effects and their values on the command line: NAME, or NAME.PARAMETER=VALUE with its unit."""

from __future__ import annotations

from collections.abc import Iterable

from reefmu.effects import find_effect
from reefmu.effects.effect_facts import example_value
from reefmu.model.model_file import parse_parameter
from stiffness_model.errors import expect, unknown_name


def effect_values(words: Iterable[str], where: str = "--effect") -> dict[str, dict[str, float]]:
    """Parameter values by effect and parameter name, SI, from the words of repeated options.

    words: each "NAME", for a neutral effect, or "NAME.PARAMETER=VALUE". where: the option's name, for messages. Raises
    `UnknownNameError` for an unknown effect or parameter, `InputError` for a value that is not of the parameter's unit
    or is given twice.

    >>> effect_values(["hysteresis.torque=2 N.m", "creep"])
    {'hysteresis': {'torque': 2.0}, 'creep': {}}
    """
    values: dict[str, dict[str, float]] = {}
    for word in words:
        left, equals, text = (part.strip() for part in word.partition("="))
        name, dot, parameter = left.partition(".")
        effect = find_effect(name, where)
        of_effect = values.setdefault(effect.name, {})
        if not dot and not equals:
            continue
        known = {p.name: p for p in effect.parameters}
        example = f"{name}.{effect.parameters[0].name}='{example_value(effect.parameters[0])}'"
        expect(bool(dot and equals and text), f"NAME or NAME.PARAMETER=VALUE, such as {example}", word, where)
        if parameter not in known:
            raise unknown_name("parameter", parameter, known, f"{where} {name}")
        expect(parameter not in of_effect, f"{left} once", "it twice", where)
        of_effect[parameter] = parse_parameter(
            _plain_number(text, known[parameter].unit), known[parameter], f"{where} {left}"
        )
    return values


def _plain_number(text: str, unit: str) -> str | float:
    """The number of a parameter without a unit; any other text as it is, for `parse_parameter` to read or refuse."""
    try:
        return float(text) if unit == "1" else text
    except ValueError:
        return text
