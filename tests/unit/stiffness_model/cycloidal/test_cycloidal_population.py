"""Populations of cycloidal drives: seeds, workers, symmetry, energy, springs in series, one drive as it turns."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from stiffness_model.cycloidal.cycloidal_population import load_share as simulated_share
from stiffness_model.cycloidal.cycloidal_population import simulate_cycloidal
from stiffness_model.cycloidal.gear_equilibrium import solve_gears
from stiffness_model.cycloidal.gear_turn import crank_angles_over_turn, draw_gear, gear_no_load, gear_turn
from stiffness_model.cycloidal.part_deviations import draw_deviations, without_deviations
from stiffness_model.errors import InputError, NotConvergedWarning
from tests.cycloidal_drives import TOLERANCES, cycloidal

DRIVE = cycloidal(bearing_stiffness=2e7, profile_clearance=40e-6, hole_clearance=30e-6, **TOLERANCES)
TWIST = np.linspace(-15e-3, 15e-3, 31)


def test_a_drive_depends_on_seed_and_index_alone() -> None:
    many = simulate_cycloidal(DRIVE, TWIST, 70, seed=3)
    with ThreadPoolExecutor(2) as pool:
        parallel = simulate_cycloidal(DRIVE, TWIST, 70, seed=3, executor=pool)
    assert parallel == many
    few = simulate_cycloidal(DRIVE, TWIST, 5, seed=3)
    np.testing.assert_allclose(few.torque, many.torque[:5], rtol=1e-6, atol=1e-4)
    assert np.abs(simulate_cycloidal(DRIVE, TWIST, 5, seed=4).torque - few.torque).max() > 1.0


def test_results_have_the_shapes_of_every_kind_of_drive() -> None:
    found = simulate_cycloidal(DRIVE, TWIST, 20)
    assert found.torque.shape == found.crank_torque.shape == found.load_share.shape == (20, 31)
    assert found.contact_force.shape == (20, 31, 4)
    assert found.status_counts == {"converged": 620, "not_converged": 0, "limit": 0}
    curve = found.curve()
    assert list(curve.columns())[:5] == [
        "twist [arcmin]", "torque_mean [N.m]", "torque_p10 [N.m]", "torque_p90 [N.m]", "stiffness [N.m/arcmin]",
    ]  # fmt: skip
    assert (np.diff(curve.torque) > -1e-3).all()
    assert 0 < curve.backlash() < curve.lost_motion() < 20e-3
    assert (found.load_share[:, -1] > 1 / 7).all()


def test_forces_explain_the_torque() -> None:
    """Moments of pins and of rollers balance on every disc, and the bearing turns the crank."""
    drive = cycloidal(bearing_stiffness=2e7, discs=2, disc_thickness=12e-3, **TOLERANCES)
    found = solve_gears(drive, draw_deviations(drive, 0, 8, 0), TWIST)
    scale = float(np.abs(found.torque).max())
    np.testing.assert_allclose(found.roller_torque.sum((2, 3)), found.torque, atol=1e-6 * scale)
    np.testing.assert_allclose(found.pin_torque.sum((2, 3)), found.torque, atol=1e-6 * scale)
    small = np.abs(TWIST) < 5e-3
    np.testing.assert_allclose((drive.ratio * found.crank_torque)[:, small], found.torque[:, small], atol=1e-2 * scale)
    work = np.gradient(found.energy, TWIST, axis=1)[:, 2:-2]
    np.testing.assert_allclose(work, (drive.ratio * found.crank_torque)[:, 2:-2], atol=5e-3 * scale)


def test_reversal_mirrors_the_curve_of_a_symmetric_drive() -> None:
    """Pins and rollers are mirror images of each other about the eccentricity at the crank angle 0."""
    drive = cycloidal(bearing_stiffness=2e7, profile_clearance=40e-6)
    torque = solve_gears(drive, without_deviations(drive, np.zeros(1)), TWIST).torque[0]
    np.testing.assert_allclose(torque, -torque[::-1], atol=1e-6 * torque.max())


def test_two_discs_carry_twice_the_torque_of_one() -> None:
    """With 28 pins in all phases alike, half a turn apart, the discs of a drive without deviations share equally."""
    one, two = (
        solve_gears(drive, without_deviations(drive, np.zeros(1)), TWIST).torque[0]
        for drive in (cycloidal(bearing_stiffness=2e7, discs=k) for k in (1, 2))
    )
    np.testing.assert_allclose(two, 2 * one, atol=0.02 * two.max())


def test_housing_is_a_spring_in_series() -> None:
    k = 2000.0
    stiff, soft = cycloidal(bearing_stiffness=2e7), cycloidal(bearing_stiffness=2e7, housing_stiffness=k)
    one = without_deviations(stiff, np.array([0.4]))
    found = solve_gears(soft, one, TWIST)
    assert (found.status == 0).all()
    for twist, torque in zip(TWIST[9:22:3], found.torque[0, 9:22:3], strict=True):
        # The same torque without housing at the twist that the housing leaves; both twists are small.
        alone = solve_gears(stiff, one, np.array([twist - torque / k])).torque[0, 0]
        assert float(torque) == pytest.approx(float(alone), abs=2e-2 * np.abs(found.torque).max())
    work = np.gradient(found.energy[0], TWIST)[1:-1]
    np.testing.assert_allclose(work, (soft.ratio * found.crank_torque[0])[1:-1], atol=1e-2 * found.torque.max())


def test_scatter_of_stiffness_scales_the_torque() -> None:
    drive = cycloidal(bearing_stiffness=2e7, stiffness_scatter=0.3)
    torque = simulate_cycloidal(drive, [10e-3], 400).torque[:, 0]
    assert float(np.log(torque).std()) == pytest.approx(0.3, rel=0.15)


def test_clearance_is_added_to_the_profile_s() -> None:
    added = simulate_cycloidal(DRIVE, TWIST, 4, clearance=20e-6).torque
    drawn = cycloidal(bearing_stiffness=2e7, profile_clearance=60e-6, hole_clearance=30e-6, **TOLERANCES)
    np.testing.assert_allclose(added, simulate_cycloidal(drawn, TWIST, 4).torque, rtol=1e-6, atol=1e-4)


def test_twist_under_a_torque_is_the_inverse_of_the_torque() -> None:
    one, angle = draw_gear(DRIVE, 7), np.linspace(0, 50, 12)
    loaded = gear_turn(one, 8.0, angle)
    np.testing.assert_allclose(one.at(angle, loaded.twist[:, None]).torque[:, 0], 8.0, rtol=1e-5)
    assert np.ptp(loaded.transmission_error) > 1e-4
    with pytest.raises(InputError, match="torque: expected one within"):
        gear_turn(one, 1e4, angle)


def test_the_pattern_repeats_after_a_turn_of_the_output() -> None:
    one, turn = draw_gear(DRIVE, 7), 2 * np.pi * DRIVE.lobes
    angle = np.array([0.3, 0.3 + turn, 0.3 + 2 * np.pi])
    twist = gear_turn(one, 8.0, angle).twist
    assert twist[1] == pytest.approx(twist[0], rel=1e-5)
    assert abs(twist[2] - twist[0]) > 1e-5


def test_play_of_the_drive_as_drawn_is_that_of_its_clearances() -> None:
    """c/(e z) of the pins and c/L of the holes to either side, more where no contact is at its greatest lever."""
    drive = cycloidal(bearing_stiffness=2e7, profile_clearance=40e-6, hole_clearance=30e-6)
    free = 2 * (40e-6 / (13 * 1.5e-3) + 30e-6 / 20e-3)
    play = gear_no_load(draw_gear(drive, None), crank_angles_over_turn(drive, 4)).play
    assert (play >= free).all()
    assert play.max() < 1.15 * free


def test_interference_preloads() -> None:
    """Without play, the drive is stiff at zero twist, and the rollers push in both senses."""
    tight = cycloidal(bearing_stiffness=2e7, profile_clearance=-10e-6, hole_clearance=-10e-6)
    found = simulate_cycloidal(tight, [-1e-4, 0.0, 1e-4], 4)
    assert (np.diff(found.torque, axis=1) > 0.05).all()
    assert (found.contact_force[:, 1, 2:] > 1.0).all()


def test_position_error_is_the_middle_of_the_play() -> None:
    """It vanishes at the crank angle 0, where a drive without deviations is its own mirror image; not for others."""
    drawn = draw_gear(cycloidal(bearing_stiffness=2e7, profile_clearance=40e-6), None)
    found = gear_no_load(drawn, [0.0])
    assert abs(float(found.position_error[0])) < 1e-3 * float(found.play[0])
    one = gear_no_load(draw_gear(DRIVE, 7), [0.0])
    assert float(-one.position_error[0]) == pytest.approx(float(one.backward[0] + one.play[0] / 2))


def test_common_clearances_scatter_between_drives_and_not_within() -> None:
    drive = cycloidal(profile_clearance_tolerance=60e-6, hole_clearance_tolerance=120e-6)
    parts = [draw_deviations(drive, block, 16, seed=1) for block in range(20)]
    lobes = np.concatenate([part.lobe[:, 0] for part in parts])
    holes = np.concatenate([part.hole[:, 0] for part in parts])
    for values, sigma in ((lobes, 10e-6), (holes, 20e-6)):
        assert np.ptp(values, axis=1).max() == 0
        assert float(values[:, 0].std()) == pytest.approx(sigma, rel=0.15)


def test_load_share_is_that_of_the_greatest_moment_of_a_pin() -> None:
    drive = cycloidal(bearing_stiffness=2e7)
    found = solve_gears(drive, without_deviations(drive, np.array([0.3])), np.array([5e-3]))
    share = float(simulated_share(found)[0, 0])
    assert share == pytest.approx(float(found.pin_torque.max() / found.torque[0, 0]))
    assert 2 / 14 < share < 5 / 14


def test_states_without_equilibrium_are_counted_and_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stiffness_model.cycloidal.discs.disc_minimum.MAX_STEPS", 1)
    with pytest.warns(
        NotConvergedWarning, match=r"tested: \d+ of 12 states \(a drive at a twist\) found no equilibrium"
    ):
        found = simulate_cycloidal(DRIVE, [-10e-3, 5e-3, 10e-3], 4)
    assert found.status_counts["not_converged"] > 0
