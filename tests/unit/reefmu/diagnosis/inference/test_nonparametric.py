"""Waves over the twist: what is there is found, and noise of the angles is none."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.inference.nonparametric import TermFit, fit_terms
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.record import make_record
from stiffness_model.numerics.arrays import Array

ARCMIN = np.pi / 180 / 60
STEP = 8 * ARCMIN * 4 / 200
"""rad, between samples of the loops."""


def terms(noise: float, wave: float, period: float) -> list[TermFit]:
    """Terms of a record whose twist stands still for most of the time: at each of five levels 300 samples, and three
    loops of 200. noise: rad, of the twist; wave, period: N.m, rad, of a torque over the twist."""
    loop = 8 * ARCMIN * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * np.arange(600) / 200))
    levels = ARCMIN * np.array([7.2, -4.0, 2.1, -6.3, 5.0])
    twist = np.concatenate([*(np.full(300, level) for level in levels), loop])
    rng = np.random.default_rng(0)
    torque = 60 * twist / ARCMIN + wave * np.sin(2 * np.pi * twist / period) + 0.5 * rng.standard_normal(len(twist))
    run: Array = np.concatenate([*(np.full(300, float(k)) for k in range(5)), np.full(600, 5.0)])
    record = make_record(
        {
            "time": 0.05 * np.arange(len(twist)),
            "run": run,
            "crank_angle": np.zeros(len(twist)),
            "output_angle": -(twist + noise * rng.standard_normal(len(twist))),
            "output_torque": torque,
        }
    )
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    return fit_terms(problem, base_fit(problem))


def test_a_wave_over_the_twist_is_found() -> None:
    best = terms(0.002 * ARCMIN, 3.0, 1.5 * ARCMIN)[0]
    assert best.gain > 100
    assert best.term.coordinate.startswith("twist, period ")
    assert float(best.term.coordinate.split()[2]) == pytest.approx(1.5, abs=0.02)


def test_noise_of_the_angles_is_no_wave() -> None:
    """Where the twist stands still, the measured one varies with its noise, which is in the residual as well: a wave
    with the phase for it at all levels would gain hundreds."""
    found = terms(0.02 * ARCMIN, 0.0, ARCMIN)
    assert found[0].gain < 12
    (over_twist,) = (t for t in found if t.term.coordinate.startswith("twist, period"))
    period = float(over_twist.term.coordinate.split()[2]) * ARCMIN
    assert period > 2 * STEP
