"""The table of hypotheses that a diagnosis would make of simulated scores, and what it would name.

As a diagnosis does, it fits every hypothesis under the size of the scatter that is likeliest with it, and extends the
likeliest one by every other effect that gains enough beside it: each of these sets takes a part of the probability.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..calibrated_odds import NAMED, log_odds
from ..estimation.search import MIN_GAIN
from .amplitude_evidence import AmplitudeEvidence
from .rival_hypotheses import RivalHypothesis
from .simulated_scores import SimulatedScores


class SimulatedTable:
    """Names of the hypotheses `candidates` along simulated records with effects of known traces added."""

    def __init__(self, simulated: SimulatedScores, candidates: Sequence[RivalHypothesis]) -> None:
        self._at, self._candidates = simulated.at, candidates
        self._sets = _Sets(range(len(candidates)), candidates)
        self._evidence = [AmplitudeEvidence(at.information, self._sets.combinations) for at in simulated.at]
        self._beside: dict[tuple[int, int], tuple[_Sets, AmplitudeEvidence]] = {}

    def names(self, traces: Array, record: NDArray[np.intp]) -> NDArray[np.intp]:
        """(d,) name, an index of the candidates or their number for none, that each of some traces (d, k) of effects
        gets in the simulated record of a number (d,)."""
        draws, n_effects = np.arange(len(record)), np.array([len(h.names) for h in self._candidates])
        scores = [at.scores[record] + traces @ at.information for at in self._at]
        nothing = np.stack([-0.5 * self._cost(z, traces, record, scores[z]) for z in range(len(self._at))])
        of_variants = np.stack([e.log_evidence(s) for e, s in zip(self._evidence, scores, strict=True)])
        alone = np.stack([self._sets.mean(log) for log in of_variants]) + nothing[:, None, :]
        # Rows of the table: nothing, every hypothesis, and the likeliest of them extended.
        parent = alone.max(axis=0).argmax(axis=0)
        own_size = alone.argmax(axis=0)[parent, draws]
        likeliest = np.where(self._sets.of_variant[:, None] == parent, of_variants[own_size, :, draws].T, -np.inf)
        extended = self._extended(scores, own_size, likeliest.argmax(axis=0)) + alone[own_size, parent, draws]
        log = np.vstack([nothing.max(axis=0), alone.max(axis=0), extended])
        count = np.zeros(log.shape)
        count[1 : 1 + len(n_effects)] = n_effects[:, None]
        count[1 + len(n_effects) :] = n_effects[parent] + 1
        log_posterior = log_odds(log.max(axis=0) - log, count)
        log_posterior -= np.asarray(logsumexp(log_posterior, axis=0))
        best = log_posterior.argmax(axis=0)
        is_named = (best > 0) & (best <= len(n_effects)) & (log_posterior[best, draws] >= np.log(NAMED))
        return np.where(is_named, best - 1, len(n_effects))

    def _cost(self, z: int, traces: Array, record: NDArray[np.intp], scores: Array) -> Array:
        """(d,) -2 log likelihood without effects under one size of the scatter."""
        return self._at[z].cost[record] + ((self._at[z].scores[record] + scores) * traces).sum(axis=1)

    def _extended(self, scores: Sequence[Array], size: NDArray[np.intp], variant: NDArray[np.intp]) -> Array:
        """(h, d) log evidence of each single effect beside the likeliest variant (d,) of a record, over that of the
        latter; -inf where it is part of it, or gains too little to be tried."""
        found = np.full((len(self._candidates), len(size)), -np.inf)
        for z, v in {*zip(size.tolist(), variant.tolist(), strict=True)}:
            inside = np.flatnonzero((size == z) & (variant == v))
            sets, evidence = self._evidence_beside(z, v)
            log = evidence.log_evidence(self._evidence[z].scores_beside(v, scores[z][inside]))
            tried = sets.greatest(evidence.gain(log)) > MIN_GAIN
            found[np.ix_(sets.places, inside)] = np.where(tried, sets.mean(log), -np.inf)
        return found

    def _evidence_beside(self, z: int, v: int) -> tuple[_Sets, AmplitudeEvidence]:
        """The single effects that may be beside a variant, as they are where that is fitted."""
        if (z, v) not in self._beside:
            names = self._candidates[self._sets.of_variant[v]].names
            places = [
                j
                for j, other in enumerate(self._candidates)
                if len(other.names) == 1 and _may_be_beside(other.names[0], names)
            ]
            sets = _Sets(places, [self._candidates[j] for j in places])
            self._beside[z, v] = sets, AmplitudeEvidence(self._evidence[z].information_beside(v), sets.combinations)
        return self._beside[z, v]


class _Sets:
    """Some hypotheses, of which each has several combinations of variants; places: their indices in the table."""

    def __init__(self, places: Sequence[int], hypotheses: Sequence[RivalHypothesis]) -> None:
        self.places = np.array(places, np.intp)
        self.combinations = [parts for h in hypotheses for parts in h.variants]
        self._count = np.array([len(h.variants) for h in hypotheses], np.intp)
        self._first = np.cumsum(self._count) - self._count
        self.of_variant = np.repeat(self.places, self._count)

    def mean(self, log: Array) -> Array:
        """(h, d) logarithm of the mean over the variants of what has the logarithms (n, d)."""
        return np.logaddexp.reduceat(log, self._first, axis=0) - np.log(self._count)[:, None]

    def greatest(self, values: Array) -> Array:
        """(h, d) greatest over the variants of values (n, d)."""
        return np.maximum.reduceat(values, self._first, axis=0)


def _may_be_beside(name: str, names: Sequence[str]) -> bool:
    return name not in names and find_effect(name).identification.sign_pair not in names
