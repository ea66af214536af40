"""The catalogue of cases: case n of a seed does not depend on how many cases are made."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from .drawings import DRAWINGS
from .outside import KINDS
from .protocols import POOR
from .records import Case
from .sensors import Sensors
from .sizing import EFFECTS

WEIGHTS = {
    "single": 22,
    "single_1": 9,
    "floor": 3,
    "none": 9,
    "scatter": 7,
    "base": 3,
    "outside": 6,
    "outside_and": 2,
    "pair": 10,
    "three": 3,
    "poor": 8,
    "autocorrelated": 3,
    "missing": 2,
    "individual": 8,
    "sweep": 5,
}
"""Number of cases of each category in every hundred."""
SWEEP_TRACE = 0.02
"""Trace of the effects in the noise sweep, rms over full torque."""
# Indistinguishable by definition or on every record; they are not combined.
_NOT_TOGETHER = ({"backlash", "preload"}, {"modulus_error", "structural_compliance"})
# Effects that change the torque under every limited protocol.
_EVERYWHERE = tuple(e for e in EFFECTS if e not in ("thermal_clearance", "wear", "missing_ball", "kinematic_error"))
_WITHOUT_TEMPERATURE = tuple(e for e in EFFECTS if e != "thermal_clearance")
_WHEN_LOCKED = (
    "backlash",
    "preload",
    "modulus_error",
    "structural_compliance",
    "creep",
    "hysteresis",
    "load_dependent_hysteresis",
    "damping",
    "torque_sensor_offset",
    "torque_sensor_drift",
)

Rng = np.random.Generator


def case(number: int, seed: int = 0) -> Case:
    """Case `number` of the catalogue of `seed`."""
    block, place = divmod(number, sum(WEIGHTS.values()))
    order = _order(block, seed)
    category = order[place]
    # Every category starts at another position in the lists of effects.
    earlier = block * WEIGHTS[category] + order[:place].count(category) + 3 * list(WEIGHTS).index(category)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number, 1)))
    return _MAKERS[category](
        partial(Case, number, category, drawing=int(rng.integers(len(DRAWINGS))), seed=seed), rng, earlier
    )


def cases(count: int, seed: int = 0, first: int = 0) -> list[Case]:
    """`count` cases from number `first` on."""
    return [case(n, seed) for n in range(first, first + count)]


def _order(block: int, seed: int) -> list[str]:
    names = [name for name, weight in WEIGHTS.items() for _ in range(weight)]
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(block, 0)))
    return [names[k] for k in rng.permutation(len(names))]


def _sensors(
    rng: Rng, correlations: tuple[float, ...] = (0.0, 0.3, 0.6, 0.8, 0.9), noise: float | None = None
) -> Sensors:
    share = float(np.exp(rng.uniform(np.log(0.001), np.log(0.008)))) if noise is None else noise
    return Sensors(
        share, float(rng.choice(correlations)), float(rng.uniform(0.05, 0.5)), float(rng.choice([0.0, 0.02, 0.05]))
    )


def _size(rng: Rng, low: float = 3.0, high: float = 12.0) -> float:
    # Slightly above the lower limit, because the noise that is drawn may be slightly larger than stated.
    return float(np.exp(rng.uniform(np.log(1.05 * low), np.log(high))))


def _turned(names: tuple[str, ...], earlier: int) -> str:
    return names[(5 * earlier) % len(names)] if len(names) % 5 else names[earlier % len(names)]


Maker = Callable[..., Case]


def _single(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(EFFECTS, earlier), _size(rng)),), sensors=_sensors(rng))


def _single_1(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(EFFECTS, earlier), 1.05),), sensors=_sensors(rng))


def _floor(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(EFFECTS, earlier), float(rng.choice([0.05, 0.1, 0.3]))),), sensors=_sensors(rng))


def _protocol(rng: Rng) -> str:
    """The full protocol in three cases of four, otherwise a limited one."""
    return str(rng.choice(["full", *POOR], p=[0.76, 0.08, 0.08, 0.08]))


def _none(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(sensors=_sensors(rng, (0.0, 0.5, 0.8, 0.9, 0.95, 0.97)), protocol=_protocol(rng))


def _scatter(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(sensors=_sensors(rng, (0.0, 0.6, 0.9, 0.97)), protocol=_protocol(rng), individual=True)


def _base(new: Maker, rng: Rng, earlier: int) -> Case:
    scale, bend = rng.uniform(-1, 1), rng.uniform(-0.5, 0.5)
    return new(sensors=_sensors(rng), base=(float(scale), float(bend)))


def _outside(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(KINDS, earlier), _size(rng)),), sensors=_sensors(rng))


def _outside_and(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(
        ((_turned(KINDS, earlier), _size(rng)), (_turned(EFFECTS, 3 * earlier), _size(rng))), sensors=_sensors(rng)
    )


def _several(count: int, new: Maker, rng: Rng, earlier: int) -> Case:
    while True:
        first = _turned(EFFECTS, earlier)
        others = [str(e) for e in rng.choice([e for e in EFFECTS if e != first], count - 1, replace=False)]
        names = [first, *others]
        if not any(pair <= set(names) for pair in _NOT_TOGETHER):
            return new(tuple((name, _size(rng)) for name in names), sensors=_sensors(rng))


def _poor(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(_EVERYWHERE, earlier), _size(rng)),), sensors=_sensors(rng), protocol=POOR[earlier % 3])


def _autocorrelated(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(EFFECTS, earlier), _size(rng)),), sensors=_sensors(rng, (0.93, 0.95, 0.97)))


def _missing(new: Maker, rng: Rng, earlier: int) -> Case:
    if earlier % 2:
        return new(
            ((_turned(_WHEN_LOCKED, earlier // 2), _size(rng)),),
            sensors=_sensors(rng),
            protocol="locked",
            missing=("crank_angle", "run"),
        )
    return new(
        ((_turned(_WITHOUT_TEMPERATURE, earlier // 2), _size(rng)),), sensors=_sensors(rng), missing=("temperature",)
    )


def _individual(new: Maker, rng: Rng, earlier: int) -> Case:
    return new(((_turned(EFFECTS, earlier), _size(rng)),), sensors=_sensors(rng), individual=True)


def _sweep(new: Maker, rng: Rng, earlier: int) -> Case:
    noise = float(np.geomspace(5e-4, 0.02, 9)[earlier % 9])
    return new(((_turned(EFFECTS, earlier), SWEEP_TRACE / noise),), sensors=_sensors(rng, noise=noise))


_MAKERS: dict[str, Callable[[Maker, Rng, int], Case]] = {
    "single": _single,
    "single_1": _single_1,
    "floor": _floor,
    "none": _none,
    "scatter": _scatter,
    "base": _base,
    "outside": _outside,
    "outside_and": _outside_and,
    "pair": partial(_several, 2),
    "three": partial(_several, 3),
    "poor": _poor,
    "autocorrelated": _autocorrelated,
    "missing": _missing,
    "individual": _individual,
    "sweep": _sweep,
}
