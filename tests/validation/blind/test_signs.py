"""The simulated drive: its contacts and the sign of every effect, each by an independent computation."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.rotation import Individual
from stiffness_model.rotation.element_torques import element_path
from tests.validation.blind import forms
from tests.validation.blind.contact_law import individual_law, mean_torque_at, turn_past_cage
from tests.validation.blind.drawings import load
from tests.validation.blind.elements import draw_individual, individual_torque
from tests.validation.blind.plant import Behaviour, Motion, run
from tests.validation.blind.protocols import PROTOCOLS, Schedule
from tests.validation.blind.sizing import rms
from tests.validation.blind.tables import Tables, tables

warnings.simplefilter("ignore", sm.DoesNotFitWarning)


@pytest.fixture(scope="module")
def table() -> Tables:
    return tables(0)


@pytest.fixture(scope="module")
def test(table: Tables) -> Schedule:
    return PROTOCOLS["full"](np.random.default_rng(1), 29)


@pytest.fixture(scope="module")
def plain(table: Tables, test: Schedule) -> Motion:
    return run(table, Behaviour(), test)


def test_the_mean_drive_is_the_mean_of_the_population(table):
    twist = np.array([0.3, 0.7, 1.0]) * table.full_twist
    torque = sm.simulate(table.drive, twist, 1500, seed=5).torque
    error = torque.std(axis=0) / np.sqrt(len(torque))
    assert (np.abs(torque.mean(axis=0) - mean_torque_at(table, twist)) < 4 * error).all()


def test_places_are_twists_of_bores_and_distances_of_lobes():
    drive = load(0)
    one = draw_individual(drive, np.random.default_rng(0))
    twist = np.linspace(-1, 1, 61) * drive.max_twist
    turn, shift, away = np.array([0.1, 0.7]), 0.013 * drive.max_twist, 2e-6
    # All bores, or all lobes, beside their places by one angle: the output is twisted by it, at a crank that stands.
    turned = individual_torque(drive, one, turn - (drive.ratio - 1) * shift, twist + shift, 0.0)
    for place in (replace(one, bore_place=shift + one.bore_place), replace(one, lobe_place=shift + one.lobe_place)):
        found = individual_torque(drive, place, turn, twist, 0.0)
        np.testing.assert_allclose(found, turned, atol=2e-3 * np.abs(turned).max())
    # All lobes outwards: a greater clearance.
    farther = individual_torque(drive, replace(one, lobe=one.lobe + away), turn, twist, 0.0)
    np.testing.assert_allclose(farther, individual_torque(drive, one, turn, twist, away), rtol=1e-9)


def test_places_deviate_as_stated():
    drive = load(0)
    sizes, sigma = draw_individual(drive, np.random.default_rng(1)), drive.tolerances["gear"].sigma
    assert not sizes.bore_place.any()
    assert not sizes.lobe_place.any()
    drawn = [draw_individual(drive, np.random.default_rng(seed), places=2.0) for seed in range(60)]
    radius = drive.crank_radius + drive.element_radius
    bores, lobes = (np.std([getattr(one, name) for one in drawn]) * radius for name in ("bore_place", "lobe_place"))
    assert bores == pytest.approx(2 * sigma, rel=0.05)
    assert lobes == pytest.approx(2 * sigma, rel=0.05)
    assert np.std([one.lobe for one in drawn]) == pytest.approx(np.sqrt(5) * sigma, rel=0.05)


def test_an_individual_keeps_its_parts_while_it_turns():
    drive = load(0)
    one = draw_individual(drive, np.random.default_rng(0))
    twist, pitch = np.array([-1.0, 0.4, 1.0]) * drive.max_twist, 2 * np.pi / drive.elements
    round_later = 0.1 + 2 * np.pi * drive.lobes
    start, pattern = (individual_torque(drive, one, np.array([t]), twist, 0.0) for t in (0.1, round_later))
    np.testing.assert_allclose(pattern, start, rtol=1e-9)
    # Without deviations the torque repeats after a pitch; with them it does not.
    same = replace(
        one,
        element=np.full(drive.elements, drive.element_radius),
        crank=0 * one.crank + drive.crank_radius,
        cage=0 * one.cage + drive.element_radius,
        lobe=0 * one.lobe + drive.element_radius,
    )
    before, after = individual_torque(drive, same, np.array([0.1, 0.1 + pitch]), twist, 0.0)
    np.testing.assert_allclose(after, before, rtol=1e-9)
    before, after = individual_torque(drive, one, np.array([0.1, 0.1 + pitch]), twist, 0.0)
    assert np.abs(after / before - 1).max() > 1e-3


def test_a_twist_at_a_locked_crank_moves_the_elements_as_in_the_core(table):
    """The torque of an individual whose lobes are alike, against `stiffness_model.rotation` at the same output angle;
    an element fades over 0.02 rad at the edge of the profile in both."""
    drive = table.drive
    one = draw_individual(drive, np.random.default_rng(0))
    one = replace(one, lobe=0 * one.lobe + drive.element_radius + drive.tolerances["gear"].offset)
    angle = np.array([0.4, 2.0, 3.9])
    law = individual_law(table, one, angle, np.zeros(3))
    rows, inside = law.rows(np.zeros(3), angle), np.abs(table.x) < 1.2 * table.full_twist
    core = Individual(drive, float(one.start[0]), one.element, one.crank, one.cage, one.lobe)
    for row, crank in zip(rows, angle, strict=True):
        output = crank / drive.ratio - table.x
        expected = element_path(core, output, table.x).torque.sum(axis=1)
        # With the elements where they stand without twist, the curve is another one.
        still = element_path(core, np.full(len(table.x), crank / drive.ratio), table.x).torque.sum(axis=1)
        error, without = (np.median(np.abs(v - expected)[inside]) / table.full_torque for v in (row, still))
        assert error < 1e-4
        assert without > 3e-3


def test_an_individual_that_turns_on_meets_its_lobes_in_their_order(table):
    """Also between the first and the last of many turns, where a table of few turns would bring the first ones back."""
    drive, chosen = table.drive, np.arange(4, len(table.x), 23)
    one = draw_individual(drive, np.random.default_rng(0), places=1.0)
    crank = 0.4 + 2 * np.pi * np.array([0.0, 5.3, 11.6, 2.0 * drive.lobes + 7.1])
    rows = individual_law(table, one, crank, np.zeros(4)).rows(np.zeros(4), crank)[:, chosen]
    for row, turn in zip(rows, turn_past_cage(table, crank[:, None], table.x)[:, chosen], strict=True):
        exact = individual_torque(drive, one, turn, table.x, 0.0)[np.arange(len(turn)), chosen]
        np.testing.assert_allclose(row, exact, atol=0.01 * table.full_torque)


def test_a_drive_without_effects_has_no_gap(plain, table):
    assert rms(plain.gap) < 2e-5 * table.full_torque


# -- signs, each by an independent computation ---------------------------------------------------------------


def _ramp(motion: Motion, test: Schedule, run_number: int) -> slice:
    return slice(*test.starts[run_number : run_number + 2])


@pytest.mark.parametrize("shift", [2e-6, -2e-6])
def test_backlash_is_a_greater_clearance_and_preload_a_smaller(table, test, shift):
    motion = run(table, Behaviour(clearance=shift), test)
    twist = np.array([-0.9, -0.4, 0.4, 0.9]) * table.full_twist
    solved = [sm.simulate(table.drive, twist, 400, seed=2, clearance=s).torque.mean(axis=0) for s in (0.0, shift)]
    order = np.argsort(motion.twist)
    gap = np.interp(twist, motion.twist[order], motion.gap[order])
    np.testing.assert_allclose(gap, solved[1] - solved[0], rtol=0.03)
    assert (gap * np.sign(twist) * shift < 0).all()


def test_temperature_and_wear_increase_the_clearance(table, test):
    warm = run(table, Behaviour(thermal=5e-8), test)
    hot, first = test.temperature > 40, test.run == 1
    loaded = np.abs(test.load) > 0.3
    assert (np.sign(warm.twist) * warm.gap)[hot & loaded].max() < 0
    assert rms(warm.gap[first]) < 0.1 * rms(warm.gap[hot])
    worn = run(table, Behaviour(wear=2e-10), test)
    last = (test.run == test.run[-1]) & (np.arange(len(test.run)) > len(test.run) - 400)
    assert (np.sign(worn.twist) * worn.gap)[last & loaded].max() < 0
    assert rms(worn.gap[first]) < 1e-3 * rms(worn.gap[last])


def test_a_stiffer_modulus_raises_the_torque_as_the_solver_says(table, test):
    motion = run(table, Behaviour(modulus=1.3), test)
    materials = {
        p: replace(m, youngs_modulus=1.3 * m.youngs_modulus) if p in ("gear", "cage") else m
        for p, m in table.drive.materials.items()
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stiffer = replace(table.drive, materials=materials)
    twist = np.array([0.4, 0.8]) * table.full_twist
    solved = [sm.simulate(d, twist, 300, seed=3).torque.mean(axis=0) for d in (stiffer, table.drive)]
    order = np.argsort(motion.twist)
    torque = np.interp(twist, motion.twist[order], motion.torque[order]) / mean_torque_at(table, twist)
    np.testing.assert_allclose(torque, solved[0] / solved[1], rtol=2e-3)
    assert (torque > 1.02).all()


def test_a_missing_ball_reduces_the_torque_once_per_turn_relative_to_the_cage(table, test):
    motion = run(table, Behaviour(missing=0.3), test)
    beta = (0.3 + (table.drive.ratio - 1) * motion.output + np.pi) % (2 * np.pi) - np.pi
    # The grid of twists resolves where it enters and leaves to about a hundredth of a radian.
    carrying = np.abs(beta) < table.drive.usable_limit + 0.02
    assert rms(motion.gap[~carrying]) < 1e-4 * table.full_torque
    # A missing element reduces the magnitude of the torque under loads of either sign.
    deep = np.abs(motion.gap) > 0.01 * table.full_torque
    assert deep.any()
    assert (motion.gap[deep] * motion.twist[deep] < 0).all()


def test_series_springs_yield_with_the_torque_and_creep_follows_it(table, test, plain):
    soft = run(table, Behaviour(compliance=2e-7), test)
    full = np.abs(soft.torque) > 0.95 * table.full_torque
    np.testing.assert_allclose((soft.twist - plain.twist)[full], 2e-7 * soft.torque[full], rtol=0.01)
    slow = run(table, Behaviour(creep=2e-7, creep_time=8.0), test)
    holds = np.flatnonzero(test.run == 8)
    dwell = holds[(test.load[holds] == 0.8)]
    delayed = (slow.twist - plain.twist)[dwell] / slow.torque[dwell]
    elapsed = test.time[dwell] - test.time[dwell[0]] + 1.5  # the preceding ramp takes 4 s
    expected = 2e-7 * sum(w * (1 - np.exp(-elapsed / 8 / t)) for w, t in ((0.25, 1 / 3), (0.5, 1.0), (0.25, 3.0)))
    np.testing.assert_allclose(delayed[20:], expected[20:], rtol=0.03)
    assert (np.diff(delayed) > 0).all()


def test_the_contacts_see_the_twist_less_the_kinematic_error(table, test, plain):
    motion = run(table, Behaviour(kinematic=1e-4, orders=((2, 1.0, 0.7),)), test)
    np.testing.assert_allclose(
        motion.torque,
        mean_torque_at(table, motion.twist - 1e-4 * np.sin(2 * test.crank + 0.7)),
        atol=1e-4 * table.full_torque,
    )


def test_hysteresis_follows_the_direction_of_the_twist(table, test):
    # Loops except the smallest, whose reversals are too close for the friction to reverse fully.
    loops = (test.run <= 6) & (np.arange(len(test.run)) % 800 >= 200)
    step = np.diff(run(table, Behaviour(), test).twist, prepend=0.0)
    far = loops & (np.abs(test.load) < 0.2)
    inner = run(table, Behaviour(hysteresis=3.0, presliding=2e-5), test)
    np.testing.assert_allclose(inner.gap[far], 3.0 * np.sign(step[far]), atol=0.05)
    loaded = run(table, Behaviour(load_hysteresis=0.05, presliding=2e-5), test)
    half = loops & (np.abs(np.abs(test.load) - 0.5) < 0.1) & (np.abs(step) > 1e-6)
    share = loaded.gap[half] / np.abs(loaded.model[half]) * np.sign(step[half])
    assert np.median(share) == pytest.approx(0.05, rel=0.05)
    damped = run(table, Behaviour(damping=500.0), test)
    quick = np.flatnonzero(test.run == 7)[-240:]
    expected = 500.0 * np.gradient(damped.twist[quick], test.time[quick])
    np.testing.assert_allclose(damped.gap[quick[5:-5]], expected[5:-5], atol=0.02 * np.abs(expected).max())


@pytest.mark.parametrize("effect", ["coulomb", "viscous", "stribeck"])
def test_friction_at_the_output_opposes_its_speed(table, test, effect):
    motion = run(table, Behaviour(**{effect: 2.0}, rubbing=2e-5, turnover=0.1), test)
    speed = forms.rate(motion.output, test.time, test.starts)
    turning = (test.run > 8) & (np.abs(speed) > 0.01) & (test.run < test.run[-1])
    law = {"coulomb": lambda w: np.sign(w), "viscous": lambda w: w, "stribeck": lambda w: np.sign(w) / (1 + 100 * w**2)}
    expected = -2.0 * law[effect](speed[turning])
    assert np.median(np.abs(motion.gap[turning] - expected)) < 0.02
    assert (motion.gap[turning] * speed[turning] < 0).mean() > 0.95
    # The ratio is negative: crank and output turn in opposite senses.
    assert table.drive.ratio < 0
    forwards = turning & (np.diff(test.crank, prepend=0) > 0)
    assert np.median(motion.gap[forwards]) > 0


def test_the_sensor_adds_to_the_torque(table, test, plain):
    np.testing.assert_allclose(run(table, Behaviour(offset=-1.5), test).gap - plain.gap, -1.5, atol=1e-9)
    drift = run(table, Behaviour(drift=2.0), test).gap - plain.gap
    assert drift[0] == pytest.approx(0, abs=1e-9)
    assert drift[-1] == pytest.approx(2.0)
    assert (np.diff(drift) > 0).all()
