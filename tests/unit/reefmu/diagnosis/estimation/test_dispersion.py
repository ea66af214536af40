"""A noise that is louder or slower than estimated is told from a misfit that has its place."""

from __future__ import annotations

from dataclasses import replace

import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.overdispersion import dispersion
from reefmu.diagnosis.estimation.problem import Study
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import Weighting
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.pipeline import prepare_problem
from reefmu.diagnosis.preprocessing.trace import trace_of
from reefmu.model.tables import cached_lookup
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


def clean(correlation: float = 0.0) -> tuple[Study, Fit]:
    """A clean record under its own noise."""
    record = rig.measured({}, noise=0.8, correlation=correlation, seed=5)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    study = prepare_problem(record, trace_of(record, rig.drive().ratio), base)[0]
    return study, base_fit(study)


def quieter(study: Study, fit: Fit, factor: float) -> tuple[Study, Fit]:
    """The same where the noise is believed to be smaller by a factor."""

    def own(weights: Weighting) -> Weighting:
        parts = {
            k: replace(
                getattr(weights, k),
                scale=factor * getattr(weights, k).scale,
                strength=factor**2 * getattr(weights, k).strength,
            )
            for k in ("mean", "individual")
        }
        return replace(weights, **parts)

    believed = replace(study, variance=study.variance / factor**2, block_variance=study.block_variance / factor**2)
    return believed, replace(fit, weighting=own(fit.weighting))


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_noise_as_estimated_counts_once(correlation: float) -> None:
    assert dispersion(*clean(correlation)) < 1.35


def test_a_louder_noise_counts_by_its_variance() -> None:
    assert dispersion(*quieter(*clean(), 2.0)) == pytest.approx(4.0, rel=0.25)


def test_a_misfit_in_its_place_is_no_noise() -> None:
    study, fit = clean()
    rest = study.torque - fit.prediction.torque
    rest[: len(rest) // 4] += 5.0
    assert dispersion(study, fit, rest) < 1.5
    assert dispersion(study, fit, 3 * rest) > 5, "but what is everywhere is"
