"""A record of a catalogue gear with loops of friction, its fit without effects and that of the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import Search, base_fit
from reefmu.diagnosis.inference.evidence import Evidence
from reefmu.diagnosis.inference.nonparametric import CURVE_TERM, TermFit
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from tests.friction_record import fitted_friction


@dataclass(frozen=True)
class Fitted:
    """The problem of a record, its fit without effects and that of the hysteresis that is true, 4 N.m."""

    problem: Problem
    base: Fit
    hysteresis: Fit


SOMETHING = TermFit(CURVE_TERM, 1.0, np.zeros(1))
"""A term of something unnamed that does not matter."""


def make_row(effects: frozenset[str], unnamed: bool, log_evidence: float, beside: TermFit | None = None) -> Row:
    """A row whose fit does not matter."""
    return Row(effects, unnamed, log_evidence, cast(Fit, None), beside)


@pytest.fixture(scope="session")
def fitted() -> Fitted:
    """Four loops of the gear with a locked crank; white noise."""
    problem, fit = fitted_friction(1.5e-3 * np.sin(2 * np.pi * np.arange(1600) / 400), None, ("hysteresis",))
    return Fitted(problem, base_fit(problem), fit)


def evidence_of(fitted: Fitted) -> Evidence:
    """What is known of the record where the search fitted these two sets."""
    return Evidence(fitted.problem, Search(fitted.base, {0: [fitted.base], 1: [fitted.hysteresis]}))
