"""By how much gains exceed what the covariance of a record expects: gains by chance, and the dispersion of evidence.

An effect that is absent gains about 1 in -2 log likelihood for each of its parameters if the covariance is right. Along
records that are simulated without effects it gains more: scatter between cycles is correlated where the weights of the
blocks take it as independent, and individual drives deviate in more ways than the columns of the scatter span, among
them in those of a kinematic error. The greatest gain along simulated records is no evidence, of effects as of what has
no name. What is left is divided by what even the best explanation leaves beyond the noise, and by the error of laws and
scatter beside large effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from ..estimation.score_test import amplitudes
from ..estimation.weighting import Projection, Weighting
from .nonparametric import fit_terms_to
from .simulated_records import SimulatedRecords

COVARIANCE_ERROR = 0.02
"""Error of the trace of large effects on an individual, over the trace: the laws of effects and the scatter beside them
are no better known. Chosen among 0, 0.02, 0.05 and 0.1 by the calibration of the probabilities; on the mean drive 0 was
best."""
N_WITH_TERMS = 8
"""Simulated records to which nonparametric terms are fitted. Chosen by judgement to bound the time."""


def dispersion(problem: Problem, fits: Sequence[Fit], gain: float) -> float:
    """Variance of the residual over that of the weights, at least 1.

    fits: the likeliest; gain: greatest one in -2 log likelihood, of effects on an individual, 0 on the mean drive.
    """
    left = min(estimate_overdispersion(problem, fit) for fit in fits)
    return left + COVARIANCE_ERROR**2 * gain


@dataclass(frozen=True)
class ChanceGains:
    """The greatest gains along records without effects, in -2 log likelihood, with and without names.

    base: the fit without effects; records: simulated ones without effects; projected, gains: memos by weighting.
    """

    problem: Problem
    base: Fit
    records: SimulatedRecords
    projected: dict[tuple[int, float, int], tuple[Weighting, Projection]] = field(default_factory=dict)
    gains: dict[tuple[float, int], float] = field(default_factory=dict)

    def named(self, fit: Fit) -> float:
        """Sum of what each effect of a fit gains by chance beside the others, at most what it gains here; 0 without
        effects. Both are taken to first order."""
        slope = fit.bounds.slope(fit.parameters)
        columns = fit.weighting.project(fit.prediction.sensitivities * slope)
        unit = np.sqrt(np.maximum(np.diag(fit.curvature), 1e-300))
        covariance = np.linalg.pinv(fit.curvature / np.outer(unit, unit), hermitian=True)
        estimates = covariance @ (columns.inner(self._under(fit.weighting)) / unit[:, None])
        found = 0.0
        for name, where in self.problem.layout(fit.names).effects.items():
            effect, block = find_effect(name), np.arange(where.start, where.stop)
            sizes = block[amplitudes(effect)]
            neutral = np.array([effect.parameters[k].neutral for k in amplitudes(effect)])
            own = ((fit.parameters[sizes] - neutral) / fit.bounds.scale[sizes] * unit[sizes])[:, None]
            here = float(_wald(own, covariance[np.ix_(sizes, sizes)])[0])
            found += min(here, float(_wald(estimates[block], covariance[np.ix_(block, block)]).max()))
        return found

    def unnamed(self, weighting: Weighting) -> float:
        """Greatest gain of any nonparametric term beside the base curve on some of the records, at the contacts of the
        drive without effects."""
        key = weighting.size, weighting.roughness
        if key not in self.gains:
            fit = replace(self.base, weighting=self.problem.weights.like(weighting))
            records = self.records.under(fit.weighting).T[:N_WITH_TERMS]
            self.gains[key] = max(0.0, *(fit_terms_to(self.problem, fit, record)[0].gain for record in records))
        return self.gains[key]

    def _under(self, weighting: Weighting) -> Projection:
        """The records projected by a weighting, which stays alive with the memo."""
        key = id(weighting.mean), weighting.size, weighting.roughness
        if key not in self.projected:
            self.projected[key] = weighting, weighting.project(self.records.under(weighting))
        return self.projected[key][1]


def _wald(estimates: Array, covariance: Array) -> Array:
    """(m,) squares of estimates (k, m) over their covariance (k, k)."""
    return (estimates * (np.linalg.pinv(covariance, hermitian=True) @ estimates)).sum(axis=0)
