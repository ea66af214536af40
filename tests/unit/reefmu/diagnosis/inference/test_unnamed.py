"""Effects and something unnamed, each fitted beside the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.inference.nonparametric import fit_terms
from reefmu.diagnosis.inference.unnamed import fit_beside_term
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig

ERROR, NAMES = 0.05, ("modulus_error",)


def _fitted(ripple: float) -> tuple[Problem, Fit]:
    """A record with a modulus error and a ripple over the twist that no effect makes, N.m, and the fit of the error."""
    record = rig.measured({"modulus_error": {"error": ERROR}}, noise=0.3)
    twist = record.twist(rig.drive().ratio)
    wave = ripple * np.sin(14 * np.pi * twist / rig.drive().max_twist)
    record = replace(record, output_torque=record.output_torque + wave)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    start = np.append(base_fit(problem).parameters, 0.01)
    return problem, problem.fit_from(NAMES, start)


@pytest.mark.slow
def test_a_ripple_does_not_distort_the_effects_beside_it() -> None:
    problem, alone = _fitted(9.0)
    own, term = fit_beside_term(problem, alone)
    assert own.cost - term.gain < alone.cost - fit_terms(problem, alone)[0].gain - 10
    assert own.weighting.size < alone.weighting.size
    found, before = (problem.layout(NAMES).by_effect(fit.parameters)["modulus_error"]["error"] for fit in (own, alone))
    assert abs(found - ERROR) < 0.5 * abs(before - ERROR)
    # The cost is that of the whole residual, which the fit does not minimise.
    assert own.cost == pytest.approx(own.weighting.cost(problem.torque - own.prediction.torque), rel=1e-3)


@pytest.mark.slow
def test_a_fit_beside_which_nothing_is_missing_stays_as_it_is() -> None:
    problem, alone = _fitted(0.0)
    own, term = fit_beside_term(problem, alone)
    assert own.cost - term.gain <= alone.cost - fit_terms(problem, alone)[0].gain
    if term.gain <= 0:
        assert own is alone
