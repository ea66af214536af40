"""Scatter of cycloidal drives along a record: individuals that it was not made from lie within it."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.diagnosis.preprocessing.trace import Blocks, make_trace
from reefmu.diagnosis.random_effects.cycloidal_scatter import CycloidalScatter, cycloidal_scatter
from reefmu.record import make_record
from stiffness_model.cycloidal.cycloidal_drive import CycloidalDrive
from stiffness_model.cycloidal.gear_turn import draw_gear

DRIVE = sm.load_drive("printed_cycloidal")
LEVER = 13 * 1.5e-3


def made(twist: np.ndarray, output: np.ndarray) -> tuple[CycloidalScatter, np.ndarray]:
    assert isinstance(DRIVE, CycloidalDrive)
    angles = {"crank_angle": DRIVE.ratio * (twist + output), "output_angle": output}
    record = make_record({"time": 0.1 * np.arange(len(twist)), **angles, "output_torque": 0 * twist})
    blocks = Blocks(np.arange(len(twist)), np.ones(len(twist)))
    return cycloidal_scatter(DRIVE, make_trace(record, DRIVE.ratio), blocks, twist, LEVER)


def scale_free(torque: np.ndarray, mean: np.ndarray) -> np.ndarray:
    return torque * float(mean @ mean) / float(torque @ mean) - mean


TWIST = 0.9 * DRIVE.max_twist * np.sin(np.linspace(0, 2 * np.pi, 60))
NOISE = 0.05
"""N.m, a thousandth of full torque, in which the interpolation of the curves is lost."""


@pytest.mark.slow
def test_the_covariance_is_that_of_the_curves_of_other_individuals() -> None:
    """With the output locked an individual has one curve. Whitened by the covariance its deviation has a variance of
    1."""
    scatter, individuals = made(TWIST, 0 * TWIST)
    assert scatter.crank_stands
    covariance = scatter.covariance_at(TWIST)
    noisy = covariance + NOISE**2 * np.eye(len(TWIST))
    population = sm.simulate(DRIVE, TWIST, n_drives=20, seed=7).torque
    mean = sm.simulate(DRIVE, TWIST, n_drives=100, seed=1).torque.mean(axis=0)
    fresh = np.array([scale_free(torque, mean) for torque in population])
    assert np.sqrt((fresh**2).mean()) == pytest.approx(np.sqrt(np.diag(covariance).mean()), rel=0.3)
    left = np.array([deviation @ np.linalg.solve(noisy, deviation) for deviation in (*fresh, *individuals)])
    assert np.median(left) < 3 * len(scatter.components), "as many degrees of freedom as components, at most"
    # Components without the play's part of the flanks do not hold them.
    play = np.interp(TWIST, scatter.grid, scatter.components[0])
    without = noisy - np.outer(play, play)
    assert np.mean([d @ np.linalg.solve(without, d) for d in fresh]) > 3 * np.mean(left)


def test_a_clearance_shifts_the_flanks() -> None:
    scatter, _ = made(TWIST, 0 * TWIST)
    play = 0.2 * DRIVE.max_twist
    shifted = scatter.covariance_at(TWIST + np.sign(TWIST) * play, LEVER * play)
    np.testing.assert_allclose(shifted, scatter.covariance_at(TWIST), atol=1e-9)


@pytest.mark.slow
def test_where_the_crank_turns_the_position_matters() -> None:
    """A turning individual has a ripple at constant twist, which the components hold."""
    turn = np.linspace(0, 2 * np.pi, 90)
    twist = np.full(90, 0.8 * DRIVE.max_twist)
    scatter, individuals = made(twist, turn)
    assert not scatter.crank_stands
    ripple = individuals - individuals.mean(axis=1, keepdims=True)
    assert np.sqrt((ripple**2).mean()) > 0.2
    assert isinstance(DRIVE, CycloidalDrive)
    gear = draw_gear(DRIVE, 1000)
    angle = float(gear.deviations.crank_angle[0]) + DRIVE.ratio * turn
    torque = gear.at(angle, twist[:, None]).torque[:, 0]
    own = torque / torque.mean()
    rows = scatter.components / np.linalg.norm(scatter.components, axis=1, keepdims=True)
    left = (own - 1) - rows.T @ (rows @ (own - 1))
    assert np.sqrt((left**2).mean()) < 0.7 * np.sqrt(((own - 1) ** 2).mean())
