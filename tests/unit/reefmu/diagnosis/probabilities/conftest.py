"""A record of a catalogue gear with loops of friction, its fit without effects and that of the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from tests.friction_record import fitted_friction


@dataclass(frozen=True)
class Fitted:
    """The problem of a record, its fit without effects and that of the hysteresis that is true, 4 N.m."""

    problem: Problem
    base: Fit
    hysteresis: Fit


@pytest.fixture(scope="session")
def fitted() -> Fitted:
    """Four loops of the gear with a locked crank; white noise."""
    problem, fit = fitted_friction(1.5e-3 * np.sin(2 * np.pi * np.arange(1600) / 400), None, ("hysteresis",))
    return Fitted(problem, base_fit(problem), fit)
