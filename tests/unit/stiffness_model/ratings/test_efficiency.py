"""Friction losses: energy and moment balances by a linear programme and by statics, and limiting cases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize

import stiffness_model as sm
from stiffness_model import ARCMIN
from stiffness_model.montecarlo.solved_blocks import SolvedBlock, solved_blocks
from stiffness_model.ratings.efficiency import (
    contact_friction,
    expected_losses,
    friction_losses,
    min_sliding_power,
    sliding_velocities,
)
from stiffness_model.transmission_losses import preloaded_loss

MU = 0.04
EXACT = {f"{part}_{kind}": "0 um" for part in ("element", "crank", "cage", "gear") for kind in ("tolerance", "offset")}


def block_of(drive: sm.Drive, twist: float, n_drives: int = 1) -> SolvedBlock:
    return next(solved_blocks(drive, [twist], n_drives, 4))


@pytest.mark.parametrize("lobes", [30, 28])
@pytest.mark.parametrize("changes", [{}, {"bearing_stiffness": "250 N/um"}])
def test_input_is_output_and_losses(lobes: int, changes: dict[str, str]) -> None:
    """Statics with friction, independent of `min_sliding_power`: frictional forces that satisfy the moment balances of
    elements and rings and dissipate most (the dual linear programme), normal forces that balance the elements with
    them, and the torque that then turns the crank. Input power must equal output power plus losses.
    """
    drive = sm.load_drive("drive_1", lobes=lobes, **EXACT, **changes)
    block = block_of(drive, 0.05 * ARCMIN)
    c, r = block.contacts, block.result
    slip, by_turn, by_ring = sliding_velocities(drive, block)
    force = np.stack([r.gear, r.crank, r.cage_plus, r.cage_minus])[:, 0]
    n = len(c)
    # Frictional forces p at the contacts, |p| <= mu N, that maximise the power sum p.slip under both moment balances.
    balance = np.zeros((n + 3, 4 * n))
    for k in range(4):
        balance[np.arange(n), k * n + np.arange(n)] = by_turn[k]
    for j in range(n):
        balance[n + block.eccentric[j], n + j] = by_ring[j] / by_ring.mean()
    bounds = [(-MU * f, MU * f) for f in force.ravel()]
    dual = optimize.linprog(-slip[:, 0].ravel(), A_eq=balance, b_eq=np.zeros(n + 3), bounds=bounds, method="highs")
    assert dual.success
    lost = MU * float(min_sliding_power(drive, block)[0].sum())
    assert lost > 0
    assert -dual.fun == pytest.approx(lost, rel=1e-6)

    p_gear, p_crank, p_plus, p_minus = dual.x.reshape(
        4, n
    )  # in the direction of sliding; on the elements they act against it
    u_r, u_t = (u[0] for u in block.crank_normal())
    n_r, n_t = c.normal_r, c.normal_t
    # Normal forces at gear and crank that balance each element, with the cage's forces unchanged.
    push_r = -p_gear * -n_t - p_crank * -u_t - (p_plus + p_minus)
    push_t = -p_gear * n_r - p_crank * u_r - (force[2] - force[3])
    _, crank = np.linalg.solve(
        np.stack([np.stack([-n_r, u_r], -1), np.stack([-n_t, u_t], -1)], 1), -np.stack([push_r, push_t], -1)[..., None]
    )[..., 0].T
    centre_r, centre_t = (e[0] for e in block.centre())
    on_crank_r, on_crank_t = -crank * u_r - p_crank * u_t, -crank * u_t + p_crank * u_r
    torque_in = -(centre_r * on_crank_t - centre_t * on_crank_r).sum()
    # The cage carries the walls' normal forces and their friction, which acts radially at the elements' sides.
    torque_out = ((c.path_radius) * (force[2] - force[3]) - c.element_radius * (p_plus - p_minus)).sum()
    assert torque_in == pytest.approx(torque_out / drive.ratio + lost, rel=2e-3)
    # The losses are significant: without them the balance would not close.
    assert abs(torque_in - torque_out / drive.ratio) > 0.5 * lost
    assert lost > 0.02 * abs(torque_in)


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_losses_lie_between_zero_and_those_without_rolling(name: str) -> None:
    drive = sm.load_drive(name)
    block = block_of(drive, drive.max_twist, 4)
    r = block.result
    force = np.stack([r.gear, r.crank, r.cage_plus, r.cage_minus])
    least, ring = min_sliding_power(drive, block)
    still = (force * np.abs(sliding_velocities(drive, block)[0])).sum(axis=0)
    assert 0 < least.sum() < 0.6 * still.sum()
    for other in (-0.05, 0.05):  # any other rotation of the rings dissipates more
        slip, by_turn, by_ring = sliding_velocities(drive, block)
        slip = slip.copy()
        slip[1] += by_ring * (ring + other)
        radius = block.contacts.element_radius
        best = np.min(
            [
                (force * np.abs(slip + by_turn[:, None, None] * radius * (-s / by_turn[k] / radius))).sum(axis=0)
                for k, s in enumerate(slip)
            ],
            axis=0,
        )
        assert best.sum() > least.sum()


def test_efficiency_falls_with_friction_and_follows_its_definition() -> None:
    drive = sm.load_drive("drive_2", friction_coefficient=0.05)
    twist = np.array([0.0, 0.3, 1.0]) * drive.max_twist
    one, half = (friction_losses(drive, twist, 16, coefficient=mu) for mu in (None, 0.025))
    np.testing.assert_allclose(one.loss, 2 * half.loss, rtol=1e-12)
    assert (half.efficiency >= one.efficiency).all()
    power = one.torque / drive.ratio
    np.testing.assert_allclose(np.abs(power) / one.efficiency, np.abs(power) + one.loss, rtol=1e-12)
    assert (one.backdriving_efficiency < one.efficiency).all()
    # Interference preloads drive 2: its no-load torque is several times that of drive 1.
    precise = friction_losses(sm.load_drive("drive_1"), twist[:1], 16, coefficient=0.05)
    assert one.loss[:, 0].mean() > 5 * precise.loss[:, 0].mean() > 0


def test_no_load_torque_needs_interference() -> None:
    loose = sm.load_drive("drive_1", gear_offset="30 um")
    assert not np.any(friction_losses(loose, [0.0], 8, coefficient=0.1).loss)
    tight = [
        friction_losses(sm.load_drive("drive_1", gear_offset=f"-{size} um"), [0.0], 8, coefficient=0.1).loss.mean()
        for size in (3, 6, 12)
    ]
    assert 0 < tight[0] < tight[1] < tight[2]


@pytest.mark.parametrize("mu", [None, 0.0, 1.2, -0.1])
def test_a_coefficient_must_be_stated(mu: float | None) -> None:
    with pytest.raises(sm.InputError, match="coefficient of friction"):
        friction_losses(sm.load_drive("drive_1"), [0.001], 2, coefficient=mu)


SHARES = (0.003, 0.007, 0.012, 0.03, 0.04, 0.06, 0.09, 0.12, 0.17, 0.25, 0.35, 0.5, 0.65, 0.8, 0.95, 1.0)
"""Twists over the greatest one; none is among those to which the friction is fitted, except the last."""


@pytest.mark.parametrize(
    ("name", "mu"),
    [
        ("drive_1", 0.3),
        ("drive_3", 0.05),
        *(pytest.param(name, 0.05, marks=pytest.mark.slow) for name in ("drive_1", "drive_2", "workshop")),
        *(pytest.param(name, 0.3, marks=pytest.mark.slow) for name in ("drive_2", "drive_3", "workshop")),
    ],
)
def test_friction_of_models_has_these_efficiencies_at_any_load(name: str, mu: float) -> None:
    drive = sm.load_drive(name, friction_coefficient=mu)
    (parameters,) = contact_friction(drive).values()
    losses = expected_losses(drive, np.array(SHARES) * drive.max_twist)
    useful = np.abs(losses.torque.mean(axis=0) / drive.ratio)
    lost = preloaded_loss(parameters, useful)
    driving, driven = losses.mean_efficiencies()
    np.testing.assert_allclose(useful / (useful + lost), driving, atol=0.01)
    np.testing.assert_allclose(np.maximum(1 - lost / useful, 0), driven, atol=0.01)
    greatest = float(losses.loss.mean(axis=0).max())
    assert greatest / parameters["stiffness"] == pytest.approx(1e-3, rel=0.05)


def test_expected_losses_are_those_of_many_drawn_drives() -> None:
    """Without the error of the sample; a single sample of 32 drives is off by more."""
    drive = sm.load_drive("drive_3", friction_coefficient=0.05)
    twist = np.array([0.0, 0.05, 1.0]) * drive.max_twist
    expected = expected_losses(drive, twist)
    drawn = friction_losses(drive, twist, 1000)
    for name in ("torque", "loss"):
        mean, many = getattr(expected, name).mean(axis=0), getattr(drawn, name)
        error = many.std(axis=0) / np.sqrt(len(many))
        np.testing.assert_array_less(np.abs(mean - many.mean(axis=0)), 3 * error + 1e-9)
    assert expected.torque.mean(axis=0)[0] == pytest.approx(0, abs=1e-12)
    few = friction_losses(drive, [0.0], 32).loss.mean()
    assert abs(few / expected.loss.mean(axis=0)[0] - 1) > 0.1
