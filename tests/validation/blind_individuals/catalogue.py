"""The catalogue: case k of a seed is the same whatever the count, the order or the workers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.validation.blind.drawings import DRAWINGS
from tests.validation.blind.protocols import POOR
from tests.validation.blind.sizing import EFFECTS

from .foreign import KINDS
from .priors import TOLERATED, Rng

WEIGHTS = {
    "single": 22,
    "mean_single": 8,
    "pair": 12,
    "three": 4,
    "unknown": 15,
    "known_and_unknown": 4,
    "base": 6,
    "clean": 4,
    "scatter": 8,
    "poor": 6,
    "missing_channels": 4,
    "slow_noise": 5,
    "tiny": 2,
}
"""Cases of each category in every hundred. All but "mean_single", "clean" and every other "tiny" are individuals."""
NOTHING = ("clean", "scatter", "base")
"""Categories in which no effect is hidden."""
_NOT_TOGETHER = ({"backlash", "preload"}, {"modulus_error", "structural_compliance"})
_WITHOUT_CRANK = (
    "hysteresis",
    "structural_compliance",
    "creep",
    "backlash",
    "load_dependent_hysteresis",
    "damping",
    "modulus_error",
    "torque_sensor_offset",
    "preload",
    "torque_sensor_drift",
)
_WITHOUT_TEMPERATURE = tuple(name for name in EFFECTS if name != "thermal_clearance")
_EVERYWHERE = tuple(e for e in EFFECTS if e not in ("thermal_clearance", "wear", "missing_ball", "kinematic_error"))


@dataclass(frozen=True)
class Rig:
    """Faults of the measurement. noise: rms of torque's, over full torque; correlation: of neighbouring samples;
    mixed: share of its power that is white beside; of_angle: share that comes from the output angle; lag: s, of the
    torque behind the angles; torque_step: over full torque; angle_step: rad; jitter: of the time stamps.
    """

    noise: float = 0.003
    correlation: float = 0.0
    mixed: float = 0.0
    of_angle: float = 0.2
    lag: float = 0.0
    torque_step: float = 1e-4
    angle_step: float = 1e-6
    jitter: float = 0.02


@dataclass(frozen=True)
class Case:
    """One case. names: of the vocabulary; foreign: a kind, or none; drawing: index of `blind.drawings.DRAWINGS`;
    missing: columns that are left out ("crank_angle" gives a twist column)."""

    seed: int
    number: int
    category: str
    names: tuple[str, ...]
    foreign: str | None
    drawing: int
    protocol: str
    individual: bool
    rig: Rig
    missing: tuple[str, ...] = ()

    def stream(self, purpose: int) -> Rng:
        """Random numbers of this case for one purpose."""
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(self.number, 2, purpose)))


def case(number: int, seed: int) -> Case:
    """Case `number` of the catalogue of `seed`."""
    block, place = divmod(number, sum(WEIGHTS.values()))
    order = _order(block, seed)
    category = order[place]
    earlier = block * WEIGHTS[category] + order[:place].count(category) + 4 * list(WEIGHTS).index(category) + 7 * seed
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number, 1)))
    drawing = int(rng.integers(len(DRAWINGS)))
    names: tuple[str, ...] = ()
    foreign, protocol, missing = None, "full", ()
    turned = _turned(EFFECTS, earlier)
    match category:
        case "single" | "mean_single" | "slow_noise":
            names = (turned,)
        case "pair" | "three":
            names = _together(turned, 2 if category == "pair" else 3, rng)
        case "unknown" | "known_and_unknown":
            foreign = _turned(tuple(KINDS), earlier)
            if category == "known_and_unknown":
                names = (_turned(EFFECTS, 3 * earlier),)
        case "poor":
            names, protocol = (_turned(_EVERYWHERE, earlier),), POOR[earlier % 3]
        case "missing_channels" if earlier % 2:
            names, protocol, missing = (_turned(_WITHOUT_CRANK, earlier // 2),), "locked", ("crank_angle", "run")
        case "missing_channels":
            names, missing = (_turned(_WITHOUT_TEMPERATURE, earlier // 2),), ("temperature",)
        case "tiny":
            names = (_turned(TOLERATED, earlier // 2),)
        case _:
            protocol = str(rng.choice(["full", *POOR], p=[0.7, 0.1, 0.1, 0.1]))
    individual = category not in ("mean_single", "clean") and not (category == "tiny" and earlier % 2)
    return Case(seed, number, category, names, foreign, drawing, protocol, individual, _rig(category, rng), missing)


def cases(count: int, seed: int, first: int = 0) -> list[Case]:
    """`count` cases from number `first` on."""
    return [case(number, seed) for number in range(first, first + count)]


def _order(block: int, seed: int) -> list[str]:
    names = [name for name, weight in WEIGHTS.items() for _ in range(weight)]
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(block, 0)))
    return [names[k] for k in rng.permutation(len(names))]


def _turned(names: tuple[str, ...], earlier: int) -> str:
    """Names in turn, by steps that have no divisor in common with their number."""
    step = next(s for s in (5, 7, 3) if np.gcd(s, len(names)) == 1)
    return names[(step * earlier) % len(names)]


def _together(first: str, count: int, rng: Rng) -> tuple[str, ...]:
    while True:
        others = rng.choice([name for name in EFFECTS if name != first], count - 1, replace=False)
        names = (first, *(str(name) for name in others))
        if not any(pair <= set(names) for pair in _NOT_TOGETHER):
            return names


def _rig(category: str, rng: Rng) -> Rig:
    low, high = (2e-4, 6e-4) if category == "tiny" else (5e-4, 6e-3)
    slow = category == "slow_noise" or (category in ("clean", "scatter") and rng.uniform() < 0.4)
    noise = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    return Rig(
        noise=noise,
        correlation=float(rng.uniform(0.93, 0.97) if slow else rng.choice([0.0, 0.3, 0.6, 0.8, 0.9])),
        mixed=float(rng.choice([0.0, 0.1, 0.4])),
        of_angle=float(rng.uniform(0.05, 0.5)),
        lag=float(rng.uniform(-1e-4, 1e-4)),
        # From converters of 16 bit over twice full torque to half the noise.
        torque_step=float(np.exp(rng.uniform(np.log(3e-5), np.log(max(0.7 * noise, 4e-5))))),
        # From encoders of 24 bit to such of 18.
        angle_step=float(2 * np.pi / 2 ** rng.integers(18, 25)),
        jitter=float(rng.choice([0.0, 0.02, 0.05])),
    )
