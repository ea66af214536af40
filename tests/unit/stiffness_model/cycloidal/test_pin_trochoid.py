"""The flank meshes with the pins at the ratio -(N - 1), and all normals pass through the instantaneous centre."""

from __future__ import annotations

import numpy as np
import pytest

from stiffness_model.cycloidal.pin_trochoid import PinTrochoid

PATH = PinTrochoid(34e-3, 1.5e-3, 14)
PIN = 3.5e-3


def distances(turn: float, crank: float) -> np.ndarray:
    """Distance of every pin's centre from the flank, m, with the disc turned by `turn` at a crank angle, rad."""
    flank = PATH.profile(np.linspace(0, 2 * np.pi, 40001), PIN) * np.exp(1j * turn)
    flank = flank + PATH.eccentricity * np.exp(1j * crank)
    pins = PATH.circle_radius * np.exp(2j * np.pi * np.arange(PATH.pins) / PATH.pins)
    return np.abs(flank[:, None] - pins).min(0)


@pytest.mark.parametrize("crank", [0.0, 0.4, 2.0, 4.5])
def test_every_pin_touches_the_flank_at_the_ratio_of_pins_less_one(crank: float) -> None:
    np.testing.assert_allclose(distances(-crank / 13, crank), PIN, atol=1e-8)


def test_no_other_ratio_meshes() -> None:
    """With 14 as the number of lobes (ratio 14) pins and flank would overlap by tenths of a millimetre."""
    for lobes in (12, 14):
        assert np.abs(distances(-2.0 / lobes, 2.0) - PIN).max() > 0.1e-3


def test_profile_is_that_of_the_author_s_file() -> None:
    """End points of half a lobe in cycloid_N14_R34_Rr3.5_E1.5.dxf (JelmerV/Anti-Backlash-Cycloidal-Actuator), mm.

    Half a lobe of the disc takes 180/13 degrees there: 14 counts the pins.
    """
    valley, tip = 1j * PATH.profile([0.0, np.pi / 13], PIN) * 1e3
    assert abs(valley - 29.0j) < 1e-9
    assert abs(tip - (-7.658101257201848 + 31.070138157633664j)) < 1e-9


def test_normals_pass_through_the_instantaneous_centre() -> None:
    contacts = PATH.contacts(np.linspace(0.1, 6.2, 50))
    # From the disc's centre, e (N - 1) along the eccentricity.
    towards = 13 * 1.5e-3 - contacts.centre
    assert np.abs((towards * np.conj(contacts.push)).imag).max() < 1e-15


def test_curvature_is_that_of_the_path() -> None:
    t = np.linspace(0, 2 * np.pi, 200001)
    path = 34e-3 * np.exp(1j * t) - 1.5e-3 * np.exp(14j * t)
    first = np.gradient(path, t)
    second = np.gradient(first, t)
    numeric = (np.conj(first) * second).imag / np.abs(first) ** 3
    # The angle of the pin from the eccentricity turns by -13 t.
    np.testing.assert_allclose(PATH.curvature(-13 * t)[5:-5:997], numeric[5:-5:997], rtol=1e-5, atol=1e-3)


def test_undercut_flank_is_found() -> None:
    """At the least convex radius the flank gets a cusp: its speed vanishes there."""
    limit = PATH.least_convex_radius()
    t = np.linspace(0, 2 * np.pi / 13, 20001)
    speed = np.abs(np.gradient(PATH.profile(t, limit), t))
    assert speed[1:-1].min() < 1e-3 * speed.max()
