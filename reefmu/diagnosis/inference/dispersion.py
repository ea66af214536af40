"""By how much gains exceed what the covariance of a record expects: gains by chance, and the dispersion of evidence.

An effect that is absent gains about 1 in -2 log likelihood for each of its parameters if the covariance is right. Where
cycles scatter it gains more, since that scatter is correlated where the weights of the blocks take it as independent;
what has no name gains more along individual drives, which deviate in more ways than the columns of the scatter span.
What is gained along simulated records is no evidence. What is left is divided by what even the likeliest explanation
leaves beyond noise and scatter, and by the error of laws and scatter beside large effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from ..estimation.weighting import Projection, Weighting
from .nonparametric import TermFit, fit_terms_to
from .simulated_records import SimulatedRecords

COVARIANCE_ERROR = 0.005
"""Error of the trace of large effects on an individual, over the trace: the laws of effects and the scatter beside them
are no better known. Chosen among six values from 0 to 0.02 by the calibration of the probabilities, to which 0.003 to
0.007 are the same."""
N_WITH_TERMS = 8
"""Simulated records to which nonparametric terms are fitted. Chosen by judgement to bound the time."""


def dispersion(problem: Problem, explanations: Sequence[tuple[Fit, TermFit | None]], gain: float) -> float:
    """Variance of the residual over that of the weights, at least 1: what the likeliest explanation leaves in all over
    what it should (Pearson's estimate: McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5), or what any
    leaves everywhere, where noise is larger or slower than estimated, whichever is more.

    explanations: fits with or without a nonparametric term beside; gain: greatest one in -2 log likelihood, of effects
    on an individual, 0 on the mean drive.
    """

    def explained(beside: TermFit | None) -> float:
        return max(0.0, beside.gain) if beside else 0.0

    fit, beside = min(explanations, key=lambda e: e[0].cost - explained(e[1]))
    in_all = (fit.chi_square - explained(beside)) / problem.expected_chi_square(fit.weighting)
    everywhere = min(
        estimate_overdispersion(problem, one, problem.torque - one.prediction.torque - (term.torque if term else 0))
        for one, term in explanations
    )
    return max(in_all, everywhere) + COVARIANCE_ERROR**2 * gain


@dataclass(frozen=True)
class ChanceGains:
    """Gains along records without effects, in -2 log likelihood, with and without names.

    base: the fit without effects; records: m simulated ones without effects; gains: memo by weighting.
    """

    problem: Problem
    base: Fit
    records: SimulatedRecords
    gains: dict[tuple[float, int], float] = field(default_factory=dict)

    def of_effects(self, fits: Sequence[Fit], weighting: Weighting) -> list[Array]:
        """(m,) gains of the effects of each fit over its base parameters along the noise of the records, with scatter
        between cycles, under a weighting, to first order. The deviations of individuals are in the covariance."""
        records = weighting.project(self.records.noise)
        return [_gains_of_effects(fit, weighting, records, self.problem.layout(()).n_base) for fit in fits]

    def unnamed(self, weighting: Weighting) -> float:
        """Greatest gain of any nonparametric term beside the base curve on some of the records, at the contacts of the
        drive without effects."""
        key = weighting.size, weighting.roughness
        if key not in self.gains:
            fit = replace(self.base, weighting=self.problem.weights.like(weighting))
            records = self.records.under(fit.weighting).T[:N_WITH_TERMS]
            self.gains[key] = max(0.0, *(fit_terms_to(self.problem, fit, record)[0].gain for record in records))
        return self.gains[key]


def _gains_of_effects(fit: Fit, weighting: Weighting, records: Projection, n_base: int) -> Array:
    slope = fit.bounds.slope(fit.parameters)
    columns = weighting.project(fit.prediction.sensitivities * slope)
    curvature = columns.inner(columns) + np.diag((slope / fit.bounds.prior_deviation) ** 2)
    unit = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
    along, curvature = columns.inner(records) / unit[:, None], curvature / np.outer(unit, unit)
    return _explained(along, curvature) - _explained(along[:n_base], curvature[:n_base, :n_base])


def _explained(along: Array, curvature: Array) -> Array:
    """(m,) by how much columns of a curvature (k, k), along which m records have the inner products (k, m), reduce
    their costs."""
    return (along * (np.linalg.pinv(curvature, hermitian=True) @ along)).sum(axis=0)
