"""Parameters that a fit leaves at a bound, where the record asks for a value beyond it, and what that means."""

from __future__ import annotations

import numpy as np

from ...effects import Parameter
from ..estimation.intervals import bound_reached, one_sided_limit, standard_errors
from ..estimation.least_squares import Fit, is_logarithmic
from ..estimation.problem import Problem
from ..fitted_values import ParameterAtBound
from ..forward.base_curve import PLAY
from .play import rotational_play

_SHAPE_MEANINGS = {
    ("exponent", "low"): (
        "the torque rises more steeply about zero twist than that of any power law that is fitted; friction, or a high "
        "stiffness about zero, acts like a smaller exponent"
    ),
    ("exponent", "high"): (
        "the torque rises later than that of any power law that is fitted; play acts like a larger exponent "
        "(--exponent holds the exponent and fits the play)"
    ),
    ("scale", "low"): (
        "the gear is softer than this base curve may be: the curve is not that of the gear, or a compliance is in "
        "series"
    ),
    ("scale", "high"): "the gear is stiffer than this base curve may be: the curve is not that of the gear",
    (PLAY, "high"): "nearly all of the twist would be play: the record hardly loads the gear",
}
"""What a shape parameter of the base curve at a bound means."""
_MEANING_OF_HELD_EXPONENT = {
    "low": "the records rise more steeply about zero twist than a spring behind a play does",
    "high": "the records rise later than the most curved contact that is fitted behind a play does",
}
"""What a shared exponent at a bound means."""
_MEANING_OF_LOG_SCALE = "the record does not determine the scale of the power law"
_EFFECT_MEANINGS = {
    ("rad", "low"): "the effect acts over a shorter angle than is fitted, which this record does not resolve",
    ("rad", "high"): "the effect acts over a larger angle than is fitted",
    ("s", "low"): "the effect acts within a shorter time than is fitted, which this record does not resolve",
    ("s", "high"): "the effect takes longer than is fitted, and far longer than this record lasts",
    ("rad/s", "low"): "the effect acts at lower speeds than are fitted",
    ("rad/s", "high"): "the effect acts at higher speeds than are fitted",
}
"""What a length, a time or a speed of an effect at a bound means, by unit."""
_MEANING_OF_SIZE = "the size is beyond that of any gear: something else acts like this effect"


def parameters_at_bounds(problem: Problem, fit: Fit) -> tuple[ParameterAtBound, ...]:
    """The parameters of base curve and effects that ended at a bound of a fit, see `bound_reached`."""
    shape, layout = problem.base.shape, problem.layout(fit.names)
    found = [
        ParameterAtBound(
            "exponent",
            bound,
            float(shape.start[shape.names.index("exponent")]),
            None,
            None,
            "1",
            _MEANING_OF_HELD_EXPONENT[bound],
        )
        for bound in [shape.exponent_bound]
        if bound
    ]
    errors = standard_errors(problem, fit) if fit.at_bound.any() else np.zeros(0)
    for k, name in enumerate(shape.names, layout.shape.start):
        if bound := bound_reached(fit, k):
            limit = one_sided_limit(fit, k, errors[k], bound)
            found.append(_at_bound(name, bound, float(fit.parameters[k]), limit, "1", _meaning(name, bound)))
    owners = [name for name in fit.names for _ in range(layout.effects[name].stop - layout.effects[name].start)]
    for owner, (k, parameter) in zip(owners, layout.effect_parameters(), strict=True):
        if bound := bound_reached(fit, k, parameter):
            value, limit = float(fit.parameters[k]), one_sided_limit(fit, k, errors[k], bound)
            factor, unit = rotational_play(parameter.unit, problem.base)
            found.append(
                _at_bound(
                    f"{owner}.{parameter.name}",
                    bound,
                    factor * value,
                    factor * limit,
                    unit,
                    _meaning_of_effect(parameter, bound),
                )
            )
    return tuple(found)


def _at_bound(name: str, bound: str, value: float, limit: float, unit: str, meaning: str) -> ParameterAtBound:
    unit = "rad" if name == PLAY else unit
    low, high = (None, limit) if bound == "low" else (limit, None)
    return ParameterAtBound(name, bound, value, low, high, unit, meaning)


def _meaning(name: str, bound: str) -> str:
    return _SHAPE_MEANINGS.get((name, bound), _MEANING_OF_LOG_SCALE)


def _meaning_of_effect(parameter: Parameter, bound: str) -> str:
    is_length = is_logarithmic(parameter) and (parameter.unit, bound) in _EFFECT_MEANINGS
    return _EFFECT_MEANINGS[parameter.unit, bound] if is_length else _MEANING_OF_SIZE
