"""The cases on which the probabilities are calibrated, from the blind catalogue (tests/validation/blind).

One in four is as drawn there, mostly of mean drives; the others are individuals whose bores and lobes deviate in place,
with a torque that is read late and noise with an autocorrelation of up to 0.97. Half of these are there once more with
effects of any size, from what no record shows to what any does. Situations that the catalogue draws too rarely to tell
what they need are added: base curves within tolerance, something unnamed, limited protocols, several effects.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.validation.blind.cases import case
from tests.validation.blind.records import Case

SEED = 905
"""Seed of the catalogue; those of its scores are others."""
COUNT, COUNT_ANY_SIZE = 120, 150
"""Cases of the catalogue, and up to which number half of them have effects of any size."""
PERIOD, AS_DRAWN, CLEAR = 4, 0, 1
"""Of every four cases the first is left as the catalogue draws it; it and the second keep the sizes of the catalogue,
and the other two are there again with effects of any size."""
SIZES = (0.1, 12.0)
"""Range of these sizes, over noise or scatter, whichever is greater; every order of magnitude is as likely."""
RARE = {"base": 20, "outside_and": 20, "outside": 10, "poor": 26}
"""Further cases of situations that are rare; `poor` stands for any limited protocol. One in three is left as drawn, and
where something unnamed is missing one in three has any of `SIZES`."""
FIRST_RARE = 1000
"""Number from which the rare cases are taken."""
SEVERAL, FIRST_SEVERAL, PERIOD_SEVERAL = 40, 3000, 6
"""Further cases with two or three effects, and the number from which they are taken; one in six is left as drawn."""
PLACES, DELAYS, CORRELATIONS = (0.0, 0.5, 1.0), (0.0, 0.001, 0.002), (0.0, 0.5, 0.8, 0.9, 0.95, 0.97)
"""Deviations of places over those of sizes, delays of the torque, s, and autocorrelations of the others."""


def cases() -> Iterator[Case]:
    """The cases of the calibration."""
    for number in range(COUNT_ANY_SIZE):
        drawn, rng = case(number, SEED), _generator(number)
        if number % PERIOD == AS_DRAWN:
            yield drawn
            continue
        single = individual(drawn, rng)
        if number < COUNT or number % PERIOD == CLEAR:
            yield single
        if number % PERIOD != CLEAR:
            yield of_any_size(single, rng)
    yield from rare_cases()
    yield from itertools.islice(several_cases(), SEVERAL)


def rare_cases() -> Iterator[Case]:
    """The cases of `RARE`, in the order of the catalogue."""
    left = dict(RARE)
    for number in itertools.count(FIRST_RARE):
        drawn = case(number, SEED)
        group = "poor" if drawn.protocol != "full" and not drawn.missing else drawn.category
        if not any(left.values()):
            return
        if left.get(group):
            left[group] -= 1
            rng = _generator(number)
            single = drawn if left[group] % 3 == 0 else individual(drawn, rng)
            yield of_any_size(single, rng) if "outside" in group and left[group] % 3 == 1 else single


def several_cases() -> Iterator[Case]:
    """The cases of the catalogue with several effects, from `FIRST_SEVERAL` on."""
    drawn = (case(number, SEED) for number in itertools.count(FIRST_SEVERAL))
    several = (what for what in drawn if what.category in ("pair", "three"))
    for k, what in enumerate(several):
        yield what if k % PERIOD_SEVERAL == 0 else individual(what, _generator(what.number))


def _generator(number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(number, 7)))


def individual(drawn: Case, rng: np.random.Generator) -> Case:
    """A case on an individual, with deviations of places and the noise of a real rig."""
    sensors = replace(
        drawn.sensors, torque_delay=float(rng.choice(DELAYS)), correlation=float(rng.choice(CORRELATIONS))
    )
    return replace(drawn, individual=True, places=float(rng.choice(PLACES)), sensors=sensors)


def of_any_size(what: Case, rng: np.random.Generator) -> Case:
    """A case whose effects have any of `SIZES`."""
    sizes = np.exp(rng.uniform(np.log(SIZES[0]), np.log(SIZES[1]), len(what.effects))).tolist()
    return replace(what, effects=tuple((name, size) for (name, _), size in zip(what.effects, sizes, strict=True)))


def drawn_cases(count: int | None = None) -> list[Case]:
    """So many of the cases in a random order, always the same; all if None."""
    every = list(cases())
    return [every[k] for k in np.random.default_rng(0).permutation(len(every))[:count]]
