"""Transmission error, backlash and order spectra of an individual as it turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.errors import InputError
from stiffness_model.plotting.curves import save
from stiffness_model.rotation import (
    angles_over_turn,
    draw_individual,
    loaded_turn,
    mean_individual,
    no_load,
    ripple_plots,
    spectrum,
    turning_map,
)
from stiffness_model.rotation.twist_scatter import twist_scatter


@pytest.fixture(scope="module")
def small() -> sm.Drive:
    """Ratio 9: a turn has 270 passings, and the orders are few."""
    return sm.load_drive(
        "drive_1",
        transmission_ratio=9,
        lobes=10,
        elements=27,
        eccentricity="2 mm",
        max_twist="20 arcmin",
        element_radius="6 mm",
        name="small",
    )


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_the_twist_of_a_torque_carries_that_torque(name: str) -> None:
    drive = sm.load_drive(name)
    one = draw_individual(drive, 2)
    angle = np.random.default_rng(1).uniform(0, 6, 30)
    full = float(turning_map(one, [drive.max_twist], angle).torque.mean())
    for share in (-0.9, -0.01, 0.0, 0.3, 1.1):
        loaded = loaded_turn(one, share * full, angle)
        for k in range(0, 30, 7):
            step = 1e-3 * drive.max_twist
            twists = loaded.twist[k] + np.array([-step, 0.0, step])
            torque = turning_map(one, twists, angle[[k]]).torque[0]
            assert torque[1] == pytest.approx(share * full, abs=1e-7 * full)
            assert loaded.stiffness[k] == pytest.approx((torque[2] - torque[0]) / (2 * step), rel=0.02, abs=1e-4 * full)
        assert loaded.transmission_error == pytest.approx(-loaded.twist)


def test_backlash_grows_with_the_clearance(small: sm.Drive) -> None:
    """Without deviations the middle of the backlash is zero. 10 um more at every lobe widen it by the rotation of the
    crank that closes them: the clearance over the lever at the steepest part of the profile.
    """
    angle = angles_over_turn(small, per_pass=4)[:40]
    tight = mean_individual(small)
    loose = replace(tight, lobe=tight.lobe + 1e-5)
    for one in (tight, loose):
        assert no_load(one, angle).position_error == pytest.approx(0, abs=3e-7)
    closed, opened = (no_load(one, angle).play.mean() for one in (tight, loose))
    lever = small.eccentricity * abs(small.ratio)
    assert 2e-5 / lever < opened - closed < 1.3 * 2e-5 / lever
    drawn = no_load(draw_individual(small, 3), angle)
    assert (drawn.play > 0).all()
    assert np.ptp(drawn.position_error) > 0


def test_the_drag_without_load_is_a_thousandth_of_full_torque(small: sm.Drive) -> None:
    """Definition of "no load": the twist carries a drag torque against the motion of the output."""
    one, angle = draw_individual(small, 3), angles_over_turn(small, per_pass=1)[:90]
    free = no_load(one, angle)
    full = turning_map(one, [small.max_twist], angles_over_turn(small, per_pass=1)).torque.mean()
    assert free.drag_torque == pytest.approx(1e-3 * full, rel=0.02)
    for error, torque in ((free.forward, free.drag_torque), (free.backward, -free.drag_torque)):
        assert error == pytest.approx(loaded_turn(one, torque, angle).transmission_error, abs=1e-9)


def test_a_torque_out_of_range_is_refused(small: sm.Drive) -> None:
    with pytest.raises(InputError, match="torque: expected one within"):
        loaded_turn(draw_individual(small, 0), 1e6, [0.0])
    with pytest.raises(InputError, match="finite torque"):
        loaded_turn(draw_individual(small, 0), float("nan"), [0.0])


@pytest.mark.parametrize("count", [63, 64])
def test_orders_keep_the_mean_square(small: sm.Drive, count: int) -> None:
    """Parseval's theorem, for even and odd numbers of samples."""
    values = np.random.default_rng(count).normal(3.0, 1.0, count)
    found = spectrum(small, values)
    assert found.amplitude[0] ** 2 + found.ripple**2 == pytest.approx((values**2).mean(), rel=1e-12)
    assert found.ripple == pytest.approx(values.std(), rel=1e-12)
    assert found.crank_order[9] == pytest.approx(1.0)


def test_every_kind_of_deviation_has_its_orders(small: sm.Drive) -> None:
    """Equal lobes leave multiples of z, equal elements multiples of the elements on an eccentric, no deviations only
    the passing elements; all other orders need both to differ.
    """
    drawn, nominal = draw_individual(small, 6), mean_individual(small, 0.3)
    angle = angles_over_turn(small, per_pass=4)
    kinds = {
        "passing": nominal,
        "elements": replace(drawn, lobe=nominal.lobe),
        "lobes": replace(nominal, lobe=drawn.lobe),
        "both": drawn,
    }
    apart = {}
    for kind, one in kinds.items():
        found = spectrum(small, turning_map(one, [0.5 * small.max_twist], angle).torque[:, 0])
        by_source = dict.fromkeys((*kinds, "rows"), 0.0)
        for order in range(1, len(found.order)):
            source = found.source(order)
            by_source[source] = max(by_source[source], float(found.amplitude[order]))
        apart[kind] = by_source
        allowed = {"passing": {kind}, "both": {*kinds, "rows"}}.get(kind, {"passing", "rows", kind})
        for source, amplitude in by_source.items():
            assert (amplitude > 1e-4) == (source in allowed), (kind, source, amplitude)
            if source not in allowed:
                assert amplitude < 1e-9
    assert apart["both"]["lobes"] == pytest.approx(apart["lobes"]["lobes"], rel=0.3)


def test_a_crank_radius_per_eccentric_repeats_with_every_row_passing(small: sm.Drive) -> None:
    drive = sm.load_drive("drive_1", crank_deviation="eccentric")
    nominal, drawn = mean_individual(drive), draw_individual(drive, 1)
    passing = angles_over_turn(drive, per_pass=4)[:12]
    one = replace(nominal, crank=drawn.crank)
    torque = turning_map(one, [drive.max_twist], np.concatenate([passing, passing + passing[-1] + passing[1]])).torque
    rows = torque.reshape(2, 12)
    assert rows[0] == pytest.approx(rows[1], rel=1e-12)
    assert np.abs(rows[0, :4] - rows[0, 4:8]).max() > 1e-3


@pytest.mark.slow
def test_individuals_scatter_about_the_mean_drive(small: sm.Drive) -> None:
    found = twist_scatter(small, range(12))
    assert found.mean.shape == (12, len(found.torque))
    assert (found.low <= found.mean).all()
    assert (found.mean <= found.high).all()
    error = found.mean.std(axis=0) / np.sqrt(12)
    loaded = np.abs(found.torque) > 0.2 * found.torque.max()
    assert (np.abs(found.mean.mean(axis=0))[loaded] < 4 * error[loaded]).all()


@pytest.mark.slow
def test_pictures(small: sm.Drive, tmp_path: object) -> None:
    one, angle = draw_individual(small, 1), angles_over_turn(small, per_pass=2)
    full = float(turning_map(one, [small.max_twist], angle[:20]).torque.mean())
    loaded, free = loaded_turn(one, full, angle), no_load(one, angle)
    drawn = {
        "map": ripple_plots.ripple_map(turning_map(one, np.linspace(-1, 1, 9) * small.max_twist, angle[:40])),
        "error": ripple_plots.transmission_error_over_turn(loaded),
        "play": ripple_plots.play_over_turn(free),
        "orders": ripple_plots.order_spectrum(spectrum(small, loaded.transmission_error)),
        "fan": ripple_plots.twists_of_individuals(twist_scatter(small, range(2))),
    }
    assert drawn["error"].get_xlim() == (0, 9)
    assert drawn["map"].get_ylabel() == "twist at the output [arcmin]"
    assert drawn["orders"].get_xscale() == "log"
    for name, ax in drawn.items():
        save(ax, f"{tmp_path}/{name}.png")
