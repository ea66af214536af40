"""The parameters of a drive model: ratio, band and those of its effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stiffness_model.errors import expect_number, unknown_name

from ..effects import Effect


class ModelParameter(NamedTuple):
    """One parameter of a drive model. tunable: whether its value may change after the model is built."""

    name: str
    value: float
    minimum: float | None
    maximum: float | None
    unit: str
    description: str
    tunable: bool
    nominal: float


BAND = ModelParameter(
    "band",
    0.0,
    -1.0,
    1.0,
    "1",
    "Position in the population: 0 mean, -1 the 10th, +1 the 90th percentile of the torque",
    True,
    1.0,
)
NO_BAND = ModelParameter("band", 0.0, 0.0, 0.0, "1", "Without meaning: there is one curve, no population", False, 1.0)


def model_parameters(
    name: str,
    ratio: float,
    effects: tuple[Effect, ...],
    values: Mapping[str, Mapping[str, float]],
    *,
    has_band: bool = True,
) -> tuple[ModelParameter, ...]:
    """Ratio (signed, crank to output), band and the effects' parameters.

    name: of the model, for errors. has_band: whether there is a population with percentiles. values: by effect and
    parameter name; others are neutral. Raises as `with_values`.
    """
    parameters = (
        ModelParameter(
            "ratio", ratio, None, None, "1", "Transmission ratio, crank to output, signed", False, abs(ratio)
        ),
        BAND if has_band else NO_BAND,
        *(
            ModelParameter(
                f"{e.name}.{p.name}", p.neutral, p.minimum, p.maximum, p.unit, p.description, True, p.nominal
            )
            for e in effects
            for p in e.parameters
        ),
    )
    wanted = {f"{effect}.{parameter}": v for effect, given in values.items() for parameter, v in given.items()}
    return with_values(name, parameters, wanted)


def with_values(
    where: str, parameters: tuple[ModelParameter, ...], values: Mapping[str, float]
) -> tuple[ModelParameter, ...]:
    """Parameters with other values, by dotted name.

    Raises `UnknownNameError` for a name that is not among them or not tunable, `InputError` for a value out of bounds.
    """
    known = {p.name: p for p in parameters}
    for name, value in values.items():
        if name not in known:
            raise unknown_name("parameter", name, known, where)
        p = known[name]
        number = expect_number(value, f"a finite number in {p.unit}", f"{where}: {name}")
        if not p.tunable and number != p.value:
            raise unknown_name("tunable parameter", name, [q.name for q in parameters if q.tunable], where)
        low, high = -np.inf if p.minimum is None else p.minimum, np.inf if p.maximum is None else p.maximum
        expect_number(
            number,
            f"a value within {low:g} ... {high:g} {p.unit}",
            f"{where}: {name}",
            low=np.nextafter(low, -np.inf),
            high=np.nextafter(high, np.inf),
        )
    return tuple(p._replace(value=float(values.get(p.name, p.value))) for p in parameters)
