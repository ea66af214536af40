"""What a user knows of a drive before its record is seen: odds of effects, and their typical sizes."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stiffness_model.errors import expect, expect_number, refuse_unknown
from stiffness_model.io.toml_files import parse_toml, read_text

from ...effects import EFFECTS, Parameter, find_effect
from ...effects.effect_facts import example_value
from ...model.model_file import parse_parameter
from ..estimation.score_test import amplitudes

UNNAMED = "unnamed"
"""Key of the odds of something that no effect describes."""
LARGEST_ODDS = 1e6
"""Odds in a file lie between the inverse of this and this; chosen by judgement, against slips of the keyboard."""


@dataclass(frozen=True)
class Priors:
    """What a user knows of a drive before its record is seen.

    odds: by effect, and for `UNNAMED`, over those of the drives on which the probabilities are calibrated; sizes:
    typical ones by `effect.parameter`, SI, in place of `typical_sizes`.
    """

    odds: Mapping[str, float] = field(default_factory=dict[str, float])
    sizes: Mapping[str, float] = field(default_factory=dict[str, float])

    def log_odds(self, effects: Collection[str], unnamed: bool) -> float:
        """Logarithm of the odds of a hypothesis over those without these priors.

        >>> round(math.exp(Priors({"wear": 5.0, UNNAMED: 0.1}).log_odds(["wear", "creep"], True)), 9)
        0.5
        """
        names = [*effects, *([UNNAMED] if unnamed else [])]
        return sum(math.log(self.odds.get(name, 1.0)) for name in names)

    def __str__(self) -> str:
        """The priors in words; empty without any.

        >>> print(Priors({"wear": 5.0}, {"backlash.clearance": 4e-6}))
        odds of wear 5; typical backlash.clearance 4e-06 (SI)
        """
        odds = [f"odds of {name} {value:g}" for name, value in self.odds.items()]
        return "; ".join([*odds, *(f"typical {name} {value:g} (SI)" for name, value in self.sizes.items())])


NO_PRIORS = Priors()
"""Nothing is known of the drive but what the calibration assumes."""


def load_priors(path: str | os.PathLike[str]) -> Priors:
    """The priors in a TOML file. Raises `InputError` with the file, the key, what was expected and what was given."""
    return priors_from_dict(parse_toml(read_text(Path(path), "TOML priors"), str(path), "TOML priors"), str(path))


def priors_from_dict(table: Mapping[str, Any], where: str = "priors") -> Priors:
    """The priors in nested tables, as TOML gives them. Raises `InputError`.

    >>> priors_from_dict({"odds": {"wear": 5}, "sizes": {"backlash": {"clearance": "4 um"}}})
    Priors(odds={'wear': 5.0}, sizes={'backlash.clearance': 4e-06})
    >>> priors_from_dict({"odds": {"waer": 5}})
    Traceback (most recent call last):
    ...
    stiffness_model.errors.UnknownNameError: priors [odds]: unknown effect 'waer'; did you mean 'wear'?
    """
    refuse_unknown("section", table, ("odds", "sizes"), where)
    for section in ("odds", "sizes"):
        expect(isinstance(table.get(section, {}), Mapping), f"a table [{section}]", table.get(section), where)
    odds, sizes = table.get("odds", {}), table.get("sizes", {})
    refuse_unknown("effect", odds, (*EFFECTS, UNNAMED), f"{where} [odds]")
    low, high = 1 / LARGEST_ODDS, LARGEST_ODDS
    wanted = f"odds between {low:g} and {high:g}"
    found = {name: expect_number(v, wanted, f"{where} [odds] {name}", low=low, high=high) for name, v in odds.items()}
    refuse_unknown("effect", sizes, EFFECTS, f"{where} [sizes]")
    return Priors(found, {key: size for name, v in sizes.items() for key, size in _sizes(name, v, where).items()})


def _sizes(name: str, values: Any, where: str) -> dict[str, float]:
    """Typical sizes, SI, of an effect by `effect.parameter`."""
    effect, at = find_effect(name), f"{where} [sizes.{name}]"
    known = {effect.parameters[k].name: effect.parameters[k] for k in amplitudes(effect)}
    expect(isinstance(values, Mapping), "a table of parameters", values, at)
    refuse_unknown("parameter", values, known, at)
    return {f"{name}.{key}": _size(value, known[key], f"{at}: {key}") for key, value in values.items()}


def _size(value: Any, parameter: Parameter, where: str) -> float:
    size = parse_parameter(value, parameter, where)
    expect(size > 0, f"a size above zero, such as '{example_value(parameter)}'", value, where)
    return size
