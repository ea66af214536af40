"""The generator: identities of its contacts, the catalogue's order, noise and bounds as stated, nothing leaks."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from reefmu.record import read_record
from stiffness_model.rotation import turning_map
from tests.validation.blind.drawings import load
from tests.validation.blind.sizing import EFFECTS
from tests.validation.blind_individuals import priors
from tests.validation.blind_individuals.__main__ import examined, main, score
from tests.validation.blind_individuals.bounds import BLOCK, _block_correlation, left_over, over_scatter
from tests.validation.blind_individuals.catalogue import NOTHING, WEIGHTS, case, cases
from tests.validation.blind_individuals.contacts import Assembly, draw_assembly, linear_columns, mean_curve
from tests.validation.blind_individuals.foreign import KINDS, Foreign, Scene, added
from tests.validation.blind_individuals.measure import coloured
from tests.validation.blind_individuals.priors import draw_size, size_range
from tests.validation.blind_individuals.records import make
from tests.validation.blind_individuals.simulate import slipping

# -- contacts --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    drawn = draw_assembly(load(3), np.random.default_rng(4))
    return replace(drawn, bore=0 * drawn.bore, lobe=0 * drawn.lobe, eccentric=0 * drawn.eccentric)


PLACE = np.array([0.3, -1.2, 2.9, 0.004])
TWIST = np.array([2e-3, -1e-3, 1.5e-3, -2.2e-3])
NONE = np.zeros(4)


def test_without_errors_of_position_it_is_the_individual_of_the_model(assembly):
    expected = np.diag(turning_map(assembly.one, TWIST, PLACE).torque)
    fits = assembly.one.cage.min() > assembly.one.element.max()
    np.testing.assert_allclose(assembly.torque(TWIST, PLACE, NONE), expected, rtol=1e-9 if fits else 5e-3)


def test_an_error_of_position_that_all_parts_share_is_a_rotation(assembly):
    angle, ratio = 3e-4, assembly.one.drive.ratio
    bores = replace(assembly, bore=assembly.bore + angle)
    lobes = replace(assembly, lobe=assembly.lobe + angle)
    cranks = replace(assembly, eccentric=assembly.eccentric + angle)
    plain = assembly.torque
    np.testing.assert_allclose(bores.torque(TWIST, PLACE, NONE), plain(TWIST - angle, PLACE + angle, NONE), rtol=1e-8)
    np.testing.assert_allclose(cranks.torque(TWIST, PLACE, NONE), plain(TWIST + angle / ratio, PLACE, NONE), rtol=1e-8)
    seen = plain(TWIST + angle * (1 - 1 / ratio), PLACE - angle, NONE)
    np.testing.assert_allclose(lobes.torque(TWIST, PLACE, NONE), seen, rtol=1e-8)


def test_a_missing_element_takes_its_own_torque_away(assembly):
    each = [replace(assembly, missing=k).torque(TWIST, PLACE, NONE) for k in range(assembly.one.drive.elements)]
    whole = assembly.torque(TWIST, PLACE, NONE)
    np.testing.assert_allclose((whole - np.array(each)).sum(axis=0), whole, rtol=1e-9)


@pytest.mark.parametrize("drawing", [2, 5])
def test_the_torque_of_a_locked_drive_has_no_jump(drawing):
    drive = load(drawing)
    one = draw_assembly(drive, np.random.default_rng(0))
    twist = np.linspace(-1, 1, 8001) * drive.max_twist
    torque = one.torque(twist, 1.0 / drive.ratio - twist, 0 * twist)
    # The steepest part of the curve changes by 0.05 % of the greatest torque from one twist to the next.
    assert np.abs(np.diff(torque)).max() < 2e-3 * np.abs(torque).max()


def test_linear_columns_hold_most_of_an_individual():
    drive = load(3)
    rng = np.random.default_rng(1)
    one = draw_assembly(drive, rng)
    twist = np.tile(np.linspace(0.2, 1.0, 9), 4) * drive.max_twist
    cage = np.repeat(rng.uniform(-3, 3, 4), 9)
    columns = linear_columns(drive, one.one.start, twist, cage)
    own = one.torque(twist, cage, 0 * twist) - np.interp(
        twist, np.linspace(0, 1.1, 60) * drive.max_twist, mean_curve(drive, np.linspace(0, 1.1, 60) * drive.max_twist)
    )
    # As a prior of unit deviations: what is left beside a hundredth of noise.
    noise = (0.05 * np.std(own)) ** 2
    covariance = columns.T @ columns
    left = own - covariance @ np.linalg.solve(covariance + noise * np.eye(len(own)), own)
    assert np.mean(left**2) < 0.05 * np.mean(own**2)


# -- forms -----------------------------------------------------------------------------------------------------


def test_dry_friction_stays_within_its_size_and_turns_over():
    way = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)])
    share = slipping(way, np.array([0, 100]), (0.05, 0.2))
    assert np.abs(share).max() <= 1
    assert share[49] == pytest.approx(1)
    assert share[-1] == pytest.approx(-1)


def test_foreign_kinds_are_many_and_a_third_has_no_family():
    assert len(KINDS) >= 12
    assert sum(not kind.family for kind in KINDS.values()) >= len(KINDS) / 3


@pytest.mark.parametrize("kind", KINDS)
def test_every_foreign_kind_adds_something_that_vanishes_with_its_size(kind):
    n = 400
    time = np.arange(n) * 0.2
    schedule = SimpleNamespace(
        time=time,
        run=1 + np.arange(n) // 100,
        crank=np.linspace(0, 12, n),
        temperature=np.linspace(20, 50, n),
        starts=np.array([0, 100, 200, 300, n]),
        load=np.sin(time),
    )
    twist = 2e-3 * np.sin(time)
    held = (time % 20) > 12
    twist[held] = 1e-3
    scene = Scene(schedule, twist, schedule.crank / 29 - twist, 2e5 * twist, twist, 400.0, 2e-3, np.full(n, 2e5))
    torque, angle = added(Foreign(kind, KINDS[kind].high, 0.3), scene)
    change = torque + 2e5 * np.asarray(angle) + np.zeros(n)
    assert np.isfinite(change).all()
    assert np.sqrt(np.mean(change**2)) > 1e-4
    torque, angle = added(Foreign(kind, 1e-9, 0.3), scene)
    assert np.abs(torque + 2e5 * np.asarray(angle)).max() < 1e-3


@pytest.mark.parametrize("name", EFFECTS)
def test_sizes_lie_within_their_ranges(name, monkeypatch):
    monkeypatch.setattr(priors, "mean_of", lambda drawing: SimpleNamespace(full_torque=280.0))
    low, high = size_range(name, 1)
    sizes = [draw_size(name, 1, np.random.default_rng(k)) for k in range(20)]
    least = low / (1 + high) if name == "modulus_error" else low
    assert all(0.999 * least <= abs(size) <= 1.001 * high for size in sizes)


# -- catalogue -------------------------------------------------------------------------------------------------


def test_a_case_does_not_depend_on_the_count_and_categories_are_in_every_hundred():
    assert cases(3, seed=2, first=40) == cases(60, seed=2)[40:43]
    assert cases(5, seed=2) != cases(5, seed=3)
    found = cases(100, seed=3)
    assert {name: sum(c.category == name for c in found) for name in WEIGHTS} == WEIGHTS
    assert all(bool(c.names or c.foreign) != (c.category in NOTHING) for c in found)
    assert sum(c.individual for c in found) >= 85


# -- noise and bounds ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("correlation", "mixed"), [(0.0, 0.0), (0.9, 0.0), (0.96, 0.3)])
def test_the_covariance_of_block_means_is_that_of_the_noise(correlation, mixed):
    starts = np.array([0, 47, 100])
    first = np.array([0, BLOCK, 2 * BLOCK, 47, 47 + BLOCK, 47 + 2 * BLOCK])
    count = np.diff(np.append(first, 100))
    rng = np.random.default_rng(0)
    draws = np.array([np.add.reduceat(coloured(rng, starts, correlation, mixed), first) / count for _ in range(4000)])
    same = np.repeat([0, 1], 3)
    expected = _block_correlation(correlation, mixed, SimpleNamespace(first=first, count=count))
    expected = expected * (same[:, None] == same)
    np.testing.assert_allclose(np.cov(draws.T), expected, atol=0.06 * expected.max())


def test_what_is_left_beside_other_columns():
    own = np.array([3.0, 4.0, 0.0])
    assert left_over(own, [np.array([[1.0], [0.0], [0.0]])]) == pytest.approx(4)
    assert left_over(own, [np.array([[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]]), np.zeros((3, 1))]) == pytest.approx(4)
    drives = np.random.default_rng(0).standard_normal((4000, 3))
    assert over_scatter(own, np.array([0.0, 0.0, 1.0]), drives) == pytest.approx(5, rel=0.05)


# -- whole cases -----------------------------------------------------------------------------------------------


def _first(category: str, protocol: str = "") -> int:
    return next(c.number for c in cases(100, 4) if c.category == category and protocol in ("", c.protocol))


@pytest.mark.slow
def test_a_case_is_made_twice_the_same_and_its_files_hold_no_label(tmp_path):
    what = case(_first("missing_channels", "locked"), 4)
    first, again, other = make(what, False), make(what, False), make(replace(what, seed=5), False)
    assert first.record == again.record != other.record
    text = first.record + first.drawing
    assert not any(label in text for label in (*EFFECTS, *KINDS))
    assert first.record.splitlines()[0] == "time [s],twist [arcmin],output_torque [N.m],temperature [degC]"
    path = tmp_path / "record.csv"
    path.write_text(first.record, encoding="utf-8")
    assert len(read_record(path)) == first.truth.samples
    assert first.truth.noise == pytest.approx(what.rig.noise * first.truth.full_torque, rel=0.5)


@pytest.mark.slow
def test_a_mini_catalogue_is_diagnosed_and_scored(tmp_path, capsys):
    numbers = [_first("poor", "one_loop"), _first("missing_channels", "locked")]
    rows = [examined(4, number) for number in numbers]
    for row in rows:
        assert not row["error"]
        assert row["truth"]["detectable"].keys() == row["truth"]["isolable"].keys() == set(row["truth"]["names"])
        assert row["answer"]["verdict"]
    assert "false alarm" in score(rows)
    out = tmp_path / "rows.jsonl"
    out.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    # A case that the file holds is not run again.
    main(["--seed", "4", "--first", str(numbers[0]), "--count", "1", "--out", str(out)])
    assert len(out.read_text("utf-8").splitlines()) == 2
    main(["--score", str(out)])
    assert "95 % bounds" in capsys.readouterr().out
