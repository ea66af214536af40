"""The simplified sweep of a design compared with the full simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing import sampling
from stiffness_model.explore.evaluation.response import PRESSURE_DRIVES, simulate_design
from stiffness_model.explore.evaluation.sweep import draw_elements, sweep
from stiffness_model.ratings.peak_pressure import peak_pressures
from stiffness_model.ratings.pressure import wall_forces

TORQUE, DRIVES, TWISTS = 200.0, 40, 21


def at_torque(mean: np.ndarray, values: np.ndarray, torque: float) -> float:
    """The mean of values (n_drives, n_twist) where the mean torque (n_twist,) is `torque`."""
    return float(np.interp(torque, mean, values.mean(axis=0)))


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("drive_1", {"cage_offset": "6 sigma"}),
        ("drive_2", {"cage_offset": "6 sigma", "lobes": 28}),
        ("drive_1", {"cage_offset": "6 sigma", "element": "roller", "element_length": "12 mm"}),
        ("drive_1", {"cage_offset": "6 sigma", "crank_deviation": "eccentric", "gear_offset": "8 um"}),
    ],
)
def test_results_equal_the_full_simulation_where_all_balls_fit_their_bores(
    name: str, fields: dict[str, object]
) -> None:
    drive = sm.load_drive(name, **fields)
    found = simulate_design(drive, drive.usable_limit, TORQUE, DRIVES, TWISTS, 5)
    assert found is not None
    assert found.squeezed == 0
    whole = sm.simulate(drive, found.curve.twist, DRIVES, 5)
    np.testing.assert_allclose(found.torque.T, whole.torque, rtol=1e-9, atol=1e-9)
    assert found.curve.torque[-2] < 1.3 * TORQUE
    assert found.curve.torque[-1] >= TORQUE
    greatest = whole.contact_force.max(axis=2)
    np.testing.assert_allclose(found.force[0], greatest[:, 0], rtol=1e-9, atol=1e-9)
    assert found.force[1].mean() == pytest.approx(at_torque(found.curve.torque, greatest, TORQUE), rel=1e-9)
    k = int(np.searchsorted(found.curve.torque, TORQUE))
    between = np.sort(whole.load_share[:, k - 1 : k + 1], axis=1)
    assert (found.share >= between[:, 0] - 1e-12).all()
    assert (found.share <= between[:, 1] + 1e-12).all()
    # The comparison covers elements that were left out as unloaded.
    segments = sweep(draw_elements(drive, drive.usable_limit, DRIVES, 5), found.curve.twist * drive.ratio)
    assert len(segments[-1].index) < 0.8 * len(segments[0].index)
    assert sum(len(segment.result.gear) for segment in segments) == TWISTS


def test_sum_of_forces_without_load_is_that_of_all_contacts() -> None:
    drive = sm.load_drive("drive_2", elements=3, cage_offset="6 sigma")
    found = simulate_design(drive, drive.usable_limit, 5.0, 6, 12, 0)
    assert found is not None
    # A single element's greatest forces are the forces of all contacts.
    one = sm.load_drive("drive_2", elements=1, eccentrics=1, cage_offset="6 sigma")
    single = simulate_design(one, one.usable_limit, 2.0, 6, 12, 0)
    assert single is not None
    np.testing.assert_allclose(
        np.sort(single.force_sum), np.sort(sm.simulate(one, [0.0, 1e-3], 6).contact_force[:, 0].sum(axis=1)), rtol=1e-9
    )
    assert (found.force_sum >= found.force[0]).all()


@pytest.mark.parametrize("name", ["drive_1", "drive_2"])
def test_balls_larger_than_their_bores_change_the_metrics_by_less_than_a_hundredth(name: str) -> None:
    drive = sm.load_drive(name, cage_offset=0.0)
    found = simulate_design(drive, drive.usable_limit, TORQUE, DRIVES, TWISTS, 0)
    assert found is not None
    assert 0.4 < found.squeezed < 0.6
    whole = sm.simulate(drive, found.curve.twist, DRIVES, 0)
    exact = replace(whole.curve(), torque=found.curve.torque - found.torque.mean(axis=1) + whole.torque.mean(axis=0))
    greatest = whole.contact_force.max(axis=2)
    for here, there in (
        (found.curve.twist_at(TORQUE), exact.twist_at(TORQUE)),
        (found.curve.lost_motion(TORQUE), exact.lost_motion(TORQUE)),
        (found.curve.stiffness_at(found.curve.twist_at(TORQUE)), exact.stiffness_at(exact.twist_at(TORQUE))),
        (found.force[0].mean(), greatest[:, 0].mean()),
        (found.force[1].mean(), at_torque(found.curve.torque, greatest, TORQUE)),
    ):
        assert float(here) == pytest.approx(float(there), rel=0.01)


def test_both_walls_of_a_bore_share_the_force_by_their_indentations() -> None:
    drive = sm.load_drive("drive_2", cage_offset=0.0)
    contacts = build_contacts(drive, sampling.draw(drive, 0, 2, 0))
    net = np.linspace(-900, 900, len(contacts))
    loaded, other = wall_forces(contacts, net)
    np.testing.assert_allclose(loaded - other, np.abs(net), rtol=1e-9, atol=1e-7)
    tight = np.flatnonzero(contacts.cage_gap < 0)
    assert len(tight) > 20
    for k in tight[::7]:
        a, stiffness = -contacts.cage_gap[k], contacts.stiffness_cage[k]

        def force(x: float, a: float = a, stiffness: float = stiffness) -> float:
            return stiffness * ((a + x) ** 1.5 - max(a - x, 0.0) ** 1.5)

        x = brentq(lambda x, k=k, force=force: force(x) - abs(net[k]), 0.0, 1e-4, xtol=1e-18)
        assert loaded[k] == pytest.approx(stiffness * (a + x) ** 1.5, rel=1e-6)


@pytest.mark.parametrize("element", ["ball", "roller"])
def test_the_pressure_is_that_of_the_full_rating(element: str) -> None:
    drive = sm.load_drive("drive_1", element=element, element_length="12 mm", cage_offset="6 sigma")
    found = simulate_design(drive, drive.usable_limit, TORQUE, DRIVES, TWISTS, 0)
    assert found is not None
    twist = float(found.curve.twist_at(TORQUE))
    exact = peak_pressures(drive, np.linspace(0.5, 1.0, 10) * twist, PRESSURE_DRIVES)
    assert found.pressure == pytest.approx(np.percentile(exact.pressure[:, -1, :2].max(axis=1), 90), rel=2e-3)
    # It is the greatest over a turn, and so greater than at the positions where the drives happen to stand.
    standing = sm.contact_pressures(drive, [twist], PRESSURE_DRIVES).pressure[:, 0, :2].max(axis=1)
    assert found.pressure > 1.03 * standing.mean()


def test_a_drive_too_soft_for_the_torque_has_no_response() -> None:
    drive = sm.load_drive("drive_3")
    assert simulate_design(drive, drive.usable_limit, 1e6, 4, 12, 0) is None


def test_the_results_of_a_drive_do_not_depend_on_the_number_of_drives() -> None:
    drive = sm.load_drive("drive_1")
    few, many = (simulate_design(drive, drive.usable_limit, TORQUE, count, 12, 1) for count in (5, 20))
    assert few is not None
    assert many is not None
    np.testing.assert_array_equal(few.force_sum, many.force_sum[:5])


def test_the_mean_of_few_drives_is_corrected_for_its_offset() -> None:
    drive = sm.load_drive("drive_2", crank_deviation="eccentric")
    many = sm.simulate(drive, 0.9 * drive.max_twist * np.linspace(0, 1, 31) ** 1.5, 2000, seed=99).curve()
    plain, corrected = [], []
    for seed in range(8):
        found = simulate_design(drive, drive.usable_limit, TORQUE, 50, 31, seed)
        assert found is not None
        assert abs(found.curve.torque[0]) < 1e-9
        corrected.append(found.curve.lost_motion(TORQUE))
        plain.append(replace(found.curve, torque=found.torque.mean(axis=1)).lost_motion(TORQUE))
    assert np.std(corrected) < 0.5 * np.std(plain)
    assert np.mean(corrected) == pytest.approx(many.lost_motion(TORQUE), rel=0.03)
