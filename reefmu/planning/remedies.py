"""What a rig cannot tell, and which sensor, motion or longer test would: the same criterion for a better rig."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from .checked_choice import MARGIN, Choice, Ended
from .design import Candidates, potential, wanted_separations
from .protocols.motion_pieces import feasible
from .protocols.rig import Rig

QUIETER = 1 / 3
"""Factor on the noise of a better sensor. Chosen by judgement: the next accuracy class of torque sensors and encoders
differs by two to four."""
MAX_RIVALS = 3
"""Rivals of one effect that are listed at most, the nearest first, for a reader's sake."""
NOTHING = "no effect"
"""Name of the hypothesis that nothing is missing."""


@dataclass(frozen=True)
class Remedy:
    """An effect that is not separated from `rival` (or from `NOTHING`) at its typical size; remedy: what would, empty
    where nothing that is offered would.
    """

    effect: str
    rival: str
    remedy: str


@dataclass(frozen=True)
class Upgrade:
    """A better rig: what it has, in words, the capabilities that it adds, and its rig for the noise."""

    words: str
    allowed: frozenset[str]
    rig: Rig


def upgrades(rig: Rig) -> list[Upgrade]:
    """What could be added to a rig, cheapest first as judged."""
    none = frozenset[str]()
    assert rig.torque_noise is not None
    offered: list[Upgrade] = []
    if not rig.can_set_angles:
        offered.append(Upgrade("a crank that can be locked at several angles", frozenset({"angles"}), rig))
    if not rig.can_turn:
        offered.append(Upgrade("a crank that turns under load", frozenset({"angles", "turning"}), rig))
    if not rig.can_heat:
        offered.append(
            Upgrade("a drive that is heated by 25 K, with its temperature recorded", frozenset({"temperature"}), rig)
        )
    offered += [
        Upgrade("load up to the full torque of the drive", frozenset({"torque"}), rig),
        Upgrade("a higher speed of the crank", frozenset({"speed"}), rig),
        Upgrade(
            "a torque sensor with a third of the noise",
            none,
            replace(rig, torque_noise=QUIETER * rig.torque_noise, torque_resolution=QUIETER * rig.torque_resolution),
        ),
        Upgrade(
            "angle encoders with a third of the noise",
            none,
            replace(
                rig,
                output_noise=QUIETER * rig.output_noise,
                output_resolution=QUIETER * rig.output_resolution,
                crank_noise=QUIETER * rig.crank_noise,
                crank_resolution=QUIETER * rig.crank_resolution,
            ),
        ),
    ]
    return offered


def find_remedies(
    candidates: Candidates, with_rig: Callable[[Rig], Candidates], chosen: Choice, power: float
) -> list[Remedy]:
    """What could tell every effect from its nearest rival that the chosen protocol names too rarely.

    with_rig: the same candidates with the noise of another rig. A longer protocol is offered where the time ended the
    choice, and an upgrade where it separates the effect, as far as the records along the protocol hold what the
    library's information promises. Rivals that are as near as the nearest within a factor of 2 are listed too.
    """
    nothing, rival = wanted_separations(power)

    def ratios(over: Sequence[Array]) -> Array:
        """(t, r + 1) separation of each true hypothesis over the wanted one, lower quartile of its traces: amplitudes
        of either sign count."""
        wanted = np.array([nothing, *[rival] * (over[0].shape[1] - 1)])
        return np.array([np.quantile(part, 0.25, axis=0, method="lower") for part in over]) / wanted

    now = ratios(chosen.checked.separations)
    promised = ratios(candidates.found(chosen.schedule.chosen)[1])
    # Where the separation is promised and yet the name is rare, only a larger one helps.
    needed = np.where(promised >= 1, MARGIN * np.maximum(promised / np.maximum(now, 1e-9), 1.0), 1.0)

    def best(over: Candidates, allowed: frozenset[str]) -> Array:
        return ratios(potential(over, feasible(over.library, allowed)))

    # The choice itself went on towards what all pieces of the rig reach.
    better = [("a longer protocol on the same rig", best(candidates, frozenset()))]
    better = better if chosen.ended is Ended.TIME else []
    better += [
        (offer.words, best(candidates if offer.rig is candidates.rig else with_rig(offer.rig), offer.allowed) / needed)
        for offer in upgrades(candidates.rig)
        if not offer.allowed or any(piece.needs & offer.allowed for piece in candidates.library)
    ]
    labels = [NOTHING, *(h.label for h in candidates.rivals)]
    remedies: list[Remedy] = []
    for row, (h, right) in enumerate(zip(candidates.true, chosen.checked.named_right(), strict=True)):
        if right >= power:
            continue
        others = np.array([k for k, label in enumerate(labels) if label != h.label])
        least = int(others[now[row, others].argmin()])
        nearest = others[now[row, others] <= 2 * now[row, least] + 1e-9]
        # An effect that hardly shows is not compared with others too.
        nearest = nearest[np.argsort(now[row, nearest], kind="stable")]
        for column in [0] if least == 0 else [int(k) for k in nearest if k][:MAX_RIVALS]:
            words = next((text for text, reached in better if reached[row, column] >= 1), "")
            remedies.append(Remedy(h.label, labels[column], words))
    return remedies
