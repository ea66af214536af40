"""Discs in equilibrium: geometry of the contacts, derivatives of the energy, closed forms and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stiffness_model.cycloidal.discs.disc_contacts import DiscContacts, build_disc_contacts
from stiffness_model.cycloidal.discs.disc_energy import PAIRS, DiscEnergy
from stiffness_model.cycloidal.discs.disc_equilibrium import DiscStatus, solve_discs
from stiffness_model.cycloidal.part_deviations import draw_deviations, without_deviations
from stiffness_model.elasticity.hertz import LINE_EXPONENT
from tests.cycloidal_drives import TOLERANCES, cycloidal

P = LINE_EXPONENT
RNG = np.random.default_rng(15)
PLAIN = cycloidal()
RIGID = 1e4
"""Factor of stiffness that makes contacts nearly rigid: their approach is a four-thousandth."""


def stiffer(contacts: DiscContacts, pins: float = 1.0, rollers: float = 1.0) -> DiscContacts:
    factor = np.repeat([pins, rollers], [contacts.pins, contacts.gap.shape[-1] - contacts.pins])
    return replace(contacts, stiffness=contacts.stiffness * factor)


def drawn(angle: float = 0.3) -> DiscContacts:
    return build_disc_contacts(PLAIN, without_deviations(PLAIN, np.array([angle])))


def opening(contacts: DiscContacts, pose: np.ndarray) -> np.ndarray:
    """Gaps, (C,), of the first row at a pose, from the public equation of `disc_contacts`."""
    n, t = pose @ contacts.normal[0], pose @ contacts.tangent[0]
    k = contacts.curvature[0, 0]
    return contacts.gap[0, 0] + (np.hypot(1 + k * n, k * t) - 1) / k


def test_gaps_of_pins_agree_with_the_distance_from_the_exact_flank() -> None:
    """For displacements of 0.2 mm and 3 mrad, the gap is off by less than 3 um; the distances differ by 0.3 mm."""
    crank, drive = 0.7, PLAIN
    contacts = drawn(crank)
    # The flank in the frame of the eccentricity.
    parameter = np.linspace(0, 2 * np.pi, 200001)
    flank = drive.path.profile(parameter, drive.pin_radius) * np.exp(-1j * crank * (1 + 1 / drive.lobes))
    pins = 34e-3 * np.exp(1j * (2 * np.pi * np.arange(14) / 14 - crank)) - drive.eccentricity
    for _ in range(4):
        x, y, psi = RNG.uniform(-1, 1, 3) * [0.1e-3, 0.1e-3, 3e-3]
        moved = flank * np.exp(1j * psi) + x + 1j * y
        exact = np.abs(moved[:, None] - pins).min(0) - drive.pin_radius
        pose = np.array([x, y, psi * contacts.radius, 0.0])
        np.testing.assert_allclose(opening(contacts, pose)[:14], exact, atol=3e-6)
        assert np.ptp(exact) > 50e-6


def test_gaps_contain_modifications_and_deviations() -> None:
    """Exact flank with its shifts and the form of each lobe, pins off in radius and place."""
    drive = cycloidal(profile_clearance=30e-6, profile_offset=-25e-6, profile_clearance_tolerance=60e-6, **TOLERANCES)
    parts = draw_deviations(drive, 0, 1, seed=2)
    contacts, crank = build_disc_contacts(drive, parts), float(parts.crank_angle[0])
    t = np.linspace(0, 2 * np.pi, 200001)
    shifted = replace(drive.path, circle_radius=drive.pin_circle_radius + drive.profile_offset)
    lobe = np.floor(13 * t / (2 * np.pi)).astype(int) % 13
    inwards = drive.path.profile(t, 1.0) - drive.path.profile(t, 0.0)
    flank = shifted.profile(t, drive.pin_radius) + (drive.profile_clearance - parts.lobe[0, 0][lobe]) * inwards
    flank = flank * np.exp(-1j * crank / 13) + drive.eccentricity * np.exp(1j * crank)
    radial, tangential = parts.pin_position[0].T
    pins = (drive.pin_circle_radius + radial + 1j * tangential) * np.exp(2j * np.pi * np.arange(14) / 14)
    exact = np.abs(flank[:, None] - pins).min(0) - drive.pin_radius - parts.pin[0]
    assert np.ptp(exact) > 30e-6
    # The step between two lobes' forms in a valley is no part of the model.
    inner = np.abs(np.angle(pins * np.exp(-1j * crank))) > 0.3
    np.testing.assert_allclose(opening(contacts, np.zeros(4))[:14][inner], exact[inner], atol=1e-6)


def test_gaps_of_rollers_are_those_of_circles() -> None:
    crank, drive = 0.7, cycloidal(hole_clearance=20e-6)
    contacts = build_disc_contacts(drive, without_deviations(drive, np.array([crank])))
    turned = 2 * np.pi * np.arange(8) / 8 - crank / 13 - crank
    rollers = 20e-3 * np.exp(1j * turned)
    x, y, psi, gamma = 0.1e-3, -0.05e-3, 1e-3, 2e-3
    holes = drive.eccentricity + rollers + x + 1j * y + 1j * psi * rollers
    exact = drive.hole_radius - drive.roller_radius - np.abs(rollers * (1 - 1j * gamma) - holes)
    pose = np.array([x, y, psi * contacts.radius, gamma * contacts.radius])
    np.testing.assert_allclose(opening(contacts, pose)[14:], exact, atol=1e-12)


@pytest.mark.parametrize("fields", [{}, {"bearing_clearance": 5e-6}, {"ring_stiffness": 2e7, "roller_stiffness": 3e7}])
def test_derivatives_are_those_of_the_energy(fields: dict[str, float]) -> None:
    drive = cycloidal(**{"bearing_stiffness": 5e7, **TOLERANCES, **fields})
    field = DiscEnergy(build_disc_contacts(drive, draw_deviations(drive, 0, 2, seed=1)))
    pose, centre = RNG.uniform(-1, 1, (2, 3, 4)) * 1e-4, np.full((2, 3, 2), 3e-5)
    state, h = field.at(pose, centre), 1e-9
    for i in range(4):
        step = h * np.eye(4)[i]
        high, low = field.at(pose + step, centre), field.at(pose - step, centre)
        np.testing.assert_allclose(state.gradient[..., i], (high.energy - low.energy) / (2 * h), rtol=1e-4, atol=1e-4)
        for k, (a, b) in enumerate(PAIRS):
            if a == i:
                numeric = (high.gradient[..., b] - low.gradient[..., b]) / (2 * h)
                np.testing.assert_allclose(state.hessian[..., k], numeric, rtol=1e-3, atol=2e-4 * np.abs(numeric).max())


def test_rigid_pins_leave_the_rollers_closed_form() -> None:
    """The disc rolls by the twist; a roller at the angle b from the eccentricity is approached by L theta |sin b|."""
    contacts, twist = stiffer(drawn(), pins=RIGID), np.array([1e-4])
    found = solve_discs(contacts, twist)
    b = 2 * np.pi * np.arange(8) / 8 - 0.3 / 13 - 0.3
    sines = np.sin(b)[np.sin(b) < 0] if found.force[0, 0, 14:][np.sin(b) < 0].max() > 0 else np.sin(b)[np.sin(b) > 0]
    expected = contacts.stiffness[0, 0, -1] * 20e-3 ** (P + 1) * 1e-4**P * (np.abs(sines) ** (P + 1)).sum()
    assert float(found.torque[0, 0]) == pytest.approx(expected, rel=2e-3)


def test_rigid_rollers_leave_the_pins_closed_form() -> None:
    """The disc does not turn; a pin is approached by e z theta times the sine of its normal from the eccentricity.

    The forces are those of Kudryavtsev's load distribution for one-sided contacts, F_j ~ l_j^p with the levers l_j of
    the normals about the disc's centre.
    """
    contacts, twist = stiffer(drawn(), rollers=RIGID), np.array([1e-4])
    found = solve_discs(contacts, twist)
    sine = PLAIN.path.contacts(2 * np.pi * np.arange(14) / 14 - 0.3).push.imag
    lever = 13 * 1.5e-3 * sine
    loaded = found.force[0, 0, :14] > 0
    assert (loaded == (lever > 0)).all()
    expected = contacts.stiffness[0, 0, 0] * (1e-4 * lever[loaded]) ** P
    np.testing.assert_allclose(found.force[0, 0, :14][loaded], expected, rtol=2e-2)
    assert float(found.torque[0, 0]) == pytest.approx(float((expected * lever[loaded]).sum()), rel=5e-3)


def test_pins_and_rollers_are_springs_in_series() -> None:
    """Without clearance and with a rigid crank the compliances to the power 0.9 of both stages add."""
    twist = np.array([1e-4])
    both, pins, rollers = (
        float(solve_discs(stiffer(drawn(), *factors), twist).torque[0, 0])
        for factors in ((1.0, 1.0), (1.0, RIGID), (RIGID, 1.0))
    )
    assert both == pytest.approx((pins ** (-1 / P) + rollers ** (-1 / P)) ** -P, rel=2e-3)


def test_greatest_pin_force_is_that_of_the_textbook_formula() -> None:
    """F_max = 4 T/(K1 z R) of a linear contact law, K1 = e N/R, for many pins; here with the power 10/9."""
    drive = cycloidal(
        pins=40, pin_radius=1.5e-3, pin_circle_radius=60e-3, eccentricity=0.8e-3, output_rollers=10, roller_radius=5e-3,
        roller_circle_radius=35e-3,
    )  # fmt: skip
    found = solve_discs(build_disc_contacts(drive, without_deviations(drive, np.array([0.2]))), np.array([1e-4]))
    formula = 4 * float(found.torque[0, 0]) / (drive.path.shortening * 39 * 60e-3)
    assert float(found.force[0, 0, :40].max()) == pytest.approx(formula, rel=0.06)


def test_one_pin_carries_all_where_the_others_clear() -> None:
    drive = cycloidal(profile_clearance=30e-6)
    contacts = build_disc_contacts(drive, without_deviations(drive, np.array([0.3])))
    gap = contacts.gap.copy()
    gap[0, 0, 4] = 0.0
    contacts = stiffer(replace(contacts, gap=gap), rollers=RIGID)
    twist = np.array([5e-4, -5e-4])
    found = solve_discs(contacts, twist)
    lever = 13 * 1.5e-3 * float(drive.path.contacts(2 * np.pi * 4 / 14 - 0.3).push.imag)
    loaded = np.abs(found.torque[0]) > 1e-3
    assert loaded.tolist() == [lever > 0, lever < 0]
    force = contacts.stiffness[0, 0, 4] * (5e-4 * abs(lever)) ** P
    assert float(np.abs(found.torque[0]).max()) == pytest.approx(force * abs(lever), rel=1e-2)
    assert ((found.force[0, ..., :14] > 1e-3).sum(-1) <= 1).all()


def test_torque_is_zero_within_the_play() -> None:
    """The pins' clearance frees c/(e z) and the holes' c/L to either side, at the greatest levers."""
    drive = cycloidal(profile_clearance=40e-6, hole_clearance=30e-6)
    contacts = build_disc_contacts(drive, without_deviations(drive, np.linspace(0, 2, 9)))
    free = 40e-6 / (13 * 1.5e-3) + 30e-6 / 20e-3
    found = solve_discs(contacts, np.array([-1.02, -0.97, -0.5, 0.0, 0.5, 0.97, 1.15]) * free)
    assert np.abs(found.torque[:, 1:6]).max() < 5e-5
    assert float(found.torque[:, -1].min()) > 0.1
    assert (found.status == DiscStatus.CONVERGED).all()


def test_status_says_where_the_geometry_ends() -> None:
    contacts = drawn()
    found = solve_discs(stiffer(contacts, rollers=RIGID), np.array([1e-4, 60e-3]))
    assert found.status[0].tolist() == [DiscStatus.CONVERGED, DiscStatus.LIMIT]
