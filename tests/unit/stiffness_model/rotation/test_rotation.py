"""An individual as it turns: kinematics, symmetries, energy, and the paper's root search at single positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.equilibrium.reference import solve_element
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import mean_torque
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.rotation import Individual, angles_over_turn, draw_individual, mean_individual, turning_map
from stiffness_model.rotation.individual_contacts import IndividualContacts

SIZES = ("element", "crank", "cage")
DRAWINGS = [
    pytest.param("drive_1", {}, id="reversing"),
    pytest.param("drive_2", {"lobes": 28}, id="turning together"),
    pytest.param("drive_3", {"elements": 29, "eccentrics": 1}, id="one row, printed"),
    pytest.param("drive_1", {"element": "roller", "element_length": "10 mm"}, id="rollers"),
    pytest.param("drive_1", {"element_radius": "3 mm", "crank_radius": "45 mm"}, id="whole profile"),
]


def three_twists(drive: sm.Drive) -> np.ndarray:
    return np.array([-1.0, 0.05, 0.6]) * drive.max_twist


def random_angles(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-20, 20, count)


def shifted_parts(one: Individual, bores: int) -> Individual:
    """The same parts, each shifted by some bores of its own row of the cage."""
    by = bores * one.drive.eccentrics
    return replace(one, **{name: np.roll(getattr(one, name), by) for name in SIZES})


@pytest.mark.parametrize(("name", "fields"), DRAWINGS)
def test_the_pattern_has_the_period_of_one_output_turn_and_no_shorter_one(name: str, fields: dict[str, object]) -> None:
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 3), random_angles(60), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    full = np.abs(torque).max()
    assert turning_map(one, twist, angle + 2 * np.pi).torque == pytest.approx(torque, abs=1e-11 * full)
    for part in (2, 3, 5, 7, drive.lobes, drive.elements_per_row, round(drive.transmission_ratio)):
        early = turning_map(one, twist, angle + 2 * np.pi / part).torque
        assert np.abs(early - torque).max() > 1e-3 * full


@pytest.mark.parametrize(("name", "fields"), DRAWINGS)
def test_parts_shifted_by_one_bore_or_lobe_shift_the_angle(name: str, fields: dict[str, object]) -> None:
    """All balls, bores and raceways shifted by one bore are the cage turned by one bore; all lobes shifted by one are
    the gear turned by one lobe, which is cage and crank turned back by one lobe.
    """
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 4), random_angles(60), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    close = pytest.approx(torque, abs=1e-11 * np.abs(torque).max())
    bore = 2 * np.pi / drive.elements_per_row
    assert turning_map(shifted_parts(one, 1), twist, angle + bore).torque == close
    lobes = replace(one, lobe=np.roll(one.lobe, 1, axis=1))
    assert turning_map(lobes, twist, angle + drive.orientation * 2 * np.pi / drive.lobes).torque == close
    other_way = turning_map(lobes, twist, angle - drive.orientation * 2 * np.pi / drive.lobes).torque
    assert np.abs(other_way - torque).max() > 1e-3 * np.abs(torque).max()


@pytest.mark.parametrize(("name", "fields"), DRAWINGS[:3])
def test_the_mirrored_twist_of_the_mirrored_drive(name: str, fields: dict[str, object]) -> None:
    """A mirrored drive carries the opposite torque: positions, and with them all orders, run backwards."""
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 5), random_angles(40), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    n, rows = drive.elements, drive.eccentrics
    k = np.arange(n)
    # beta -> -beta: element k takes the position of -k, in row -k; lobes run backwards.
    over = {name: getattr(one, name)[-k % n] for name in SIZES}
    lobe = one.lobe[-np.arange(rows) % rows][:, -np.arange(drive.lobes) % drive.lobes]
    # Counted backwards, all rows but the first begin one element later, which faces the next lobe.
    per_element = round(drive.ratio / drive.elements_per_row)
    lobe = np.array([np.roll(lobe[row], per_element if row else 0) for row in range(rows)])
    mirrored = replace(one, start=-one.start, lobe=lobe, **over)
    assert turning_map(mirrored, -twist, -angle).torque == pytest.approx(-torque, abs=1e-10 * np.abs(torque).max())


@pytest.mark.parametrize(("name", "fields"), [DRAWINGS[0], DRAWINGS[1], DRAWINGS[4]])
def test_positions_and_torque_from_plain_geometry(name: str, fields: dict[str, object]) -> None:
    """Every element's position in the gear by plain angles, its lobe by the nearest crest, and its torque by the
    paper's root search.
    """
    drive = sm.load_drive(name, **fields)
    one = next(one for one in (draw_individual(drive, seed) for seed in range(9)) if (one.cage > one.element).all())
    crank_twist = 0.7 * drive.max_twist * drive.ratio
    checked = 0
    for angle in random_angles(6, seed=1):
        elements = []
        for k in range(drive.elements):
            row, j = k % drive.eccentrics, k // drive.eccentrics
            # Bores are evenly spaced; the phases of each row's gear and eccentric fit its elements.
            in_gear = angle - 2 * np.pi * j / drive.elements_per_row
            in_pitches = (drive.orientation * drive.lobes * in_gear + one.start + 2 * np.pi * row / drive.elements) / (
                2 * np.pi
            )
            crest = round(in_pitches)
            elements.append((2 * np.pi * (in_pitches - crest), k, row, crest % drive.lobes))
        beta = np.array([e[0] for e in elements])
        if (np.abs(np.abs(beta) - drive.usable_limit) < 1.1 * FADE_HALF_WIDTH).any() and drive.usable_limit < np.pi:
            continue
        keep = [e for e in elements if abs(e[0]) < drive.usable_limit]
        place, k, row, lobe = (np.array(column) for column in zip(*keep, strict=True))
        contacts = build_contacts(
            drive, Deviations(place, one.element[k], one.crank[k], one.cage[k], one.lobe[row, lobe])
        )
        found = [solve_element(contacts, index, crank_twist) for index in range(len(keep))]
        torque = turning_map(one, [0.7 * drive.max_twist], [angle])
        assert torque.torque[0, 0] == pytest.approx(sum(e.output_torque for e in found), rel=3e-6)
        assert torque.crank_torque[0, 0] == pytest.approx(sum(e.crank_torque for e in found), rel=3e-6)
        assert torque.max_force[0, 0] == pytest.approx(
            max(max(e.gear, e.crank, e.cage_plus, e.cage_minus) for e in found), rel=1e-4
        )
        checked += 1
    assert checked >= 1


@pytest.mark.parametrize("name", ["drive_1", "drive_3"])
def test_individuals_have_the_mean_of_the_population(name: str) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.25, 0.5, 1.0]) * drive.max_twist
    means = np.array(
        [
            turning_map(draw_individual(drive, seed), twist, random_angles(24, seed)).torque.mean(axis=0)
            for seed in range(160)
        ]
    )
    error = means.std(axis=0) / np.sqrt(len(means))
    population = mean_torque(drive, twist)
    assert (error < 0.01 * population).all()
    assert (np.abs(means.mean(axis=0) - population) < 4 * error).all()


def test_a_drive_without_deviations_has_the_nominal_mean() -> None:
    drive = sm.load_drive("drive_1")
    twist, limit = three_twists(drive), drive.usable_limit
    # One element along the profile, by the midpoint rule and with the sharp edge of the paper.
    count = 4000
    beta = limit * (2 * (np.arange(count) + 0.5) / count - 1)
    one = mean_individual(drive)
    sizes = [np.full(count, getattr(one, part)[0]) for part in SIZES] + [np.full(count, one.lobe[0, 0])]
    along = solve(build_contacts(drive, Deviations(beta, *sizes)), twist * drive.ratio).output_torque.mean(axis=1)
    passing = turning_map(one, twist, angles_over_turn(drive, per_pass=64)[:64]).torque
    assert passing.mean(axis=0) == pytest.approx(along * drive.elements * limit / np.pi, rel=1e-4)


@pytest.mark.parametrize("lobes", [28, 30])
def test_energy_balances_over_a_turn_with_the_whole_profile(lobes: int) -> None:
    """At constant twist the crank's work over a turn equals the output's: i T_crank and T_out have the same mean. The
    remaining difference comes from the paper's linearised gear contact and grows with the twist.
    """
    drive = sm.load_drive("drive_1", element_radius="3 mm", crank_radius="45 mm", lobes=lobes)
    assert drive.usable_limit == np.pi
    found = turning_map(draw_individual(drive, 1), np.array([0.02, 0.2, 1.0]) * drive.max_twist, random_angles(600))
    balance = found.torque.mean(axis=0) / (drive.ratio * found.crank_torque.mean(axis=0)) - 1
    assert (np.abs(balance) < [5e-4, 1e-3, 4e-3]).all()
    # It also balances at every angle, since the contacts store little energy at a constant twist.
    assert found.torque[:, 2] == pytest.approx(drive.ratio * found.crank_torque[:, 2], rel=6e-3)


def test_missing_energy_leaves_with_the_elements_at_the_limit() -> None:
    """At the limit, where the profile is cut away, a loaded element loses contact together with the energy stored in
    its contacts: the two works over a turn differ by this energy.
    """
    drive = sm.load_drive("drive_1")
    twist = np.array([0.25, 0.5, 1.0]) * drive.max_twist
    one = mean_individual(drive)
    found = turning_map(one, twist, angles_over_turn(drive, per_pass=32)[:32])
    missing = 2 * np.pi * (found.torque - drive.ratio * found.crank_torque).mean(axis=0)
    edge = np.array([1.0, -1.0]) * drive.usable_limit
    sizes = [np.full(2, getattr(one, part)[0]) for part in SIZES] + [np.full(2, one.lobe[0, 0])]
    contacts = build_contacts(drive, Deviations(edge, *sizes))
    at_cut = solve(contacts, twist * drive.ratio)
    stored = sum(
        f * (f / k) ** (2 / 3) * 2 / 5
        for f, k in (
            (at_cut.gear, contacts.stiffness_gear),
            (at_cut.crank, contacts.stiffness_crank),
            (at_cut.cage_plus + at_cut.cage_minus, contacts.stiffness_cage),
        )
    )
    leaves = (stored[:, 0] - stored[:, 1]) * drive.lobes * drive.elements
    work = 2 * np.pi * found.torque.mean(axis=0)
    assert (missing > 0.008 * work).all()
    assert (np.abs(missing - leaves) < [0.002 * work[0], 0.004 * work[1], 0.008 * work[2]]).all()


def test_small_deviations_act_linearly_and_superpose() -> None:
    """Under load, a thousandth of the deviations causes a thousandth of the change, and the parts' changes add up."""
    drive = sm.load_drive("drive_1")
    # With preload, loaded contacts stay closed and all others open.
    nominal, drawn, angle = mean_individual(drive, 0.4), draw_individual(drive, 8), random_angles(50)
    parts = (*SIZES, "lobe")

    def change(share: float, *names: str) -> np.ndarray:
        moved = {
            name: getattr(nominal, name) + share * (getattr(drawn, name) - getattr(nominal, name)) for name in names
        }
        found = turning_map(replace(nominal, **moved), [drive.max_twist], angle, clearance=-2e-5)
        return found.torque - turning_map(nominal, [drive.max_twist], angle, clearance=-2e-5).torque

    small, smaller = change(1e-2, *parts), change(1e-3, *parts)
    scale = np.abs(small).max()
    assert scale > 1e-3
    assert 10 * smaller == pytest.approx(small, abs=0.02 * scale)
    assert sum(change(1e-2, name) for name in parts) == pytest.approx(small, abs=0.02 * scale)


def test_the_tabulated_gear_stiffness_is_that_of_the_contact() -> None:
    for name in ("drive_1", "drive_3"):
        drive = sm.load_drive(name)
        one = draw_individual(drive, 2)
        parts = IndividualContacts(one)
        rng = np.random.default_rng(0)
        beta = rng.uniform(-1, 1, 500) * parts.window.reach
        k, row, lobe = rng.integers(drive.elements, size=500), rng.integers(3, size=500), rng.integers(30, size=500)
        q = one.lobe[row, lobe] + 2e-6
        exact = build_contacts(drive, Deviations(beta, one.element[k], one.crank[k], one.cage[k], q)).stiffness_gear
        assert parts.gear_table.stiffness(beta, q) == pytest.approx(exact, rel=3e-5)


def test_a_seed_determines_the_individual() -> None:
    drive = sm.load_drive("drive_2")
    one, again, other = (draw_individual(drive, seed) for seed in (5, 5, 6))
    for name in (*SIZES, "lobe"):
        assert (getattr(one, name) == getattr(again, name)).all()
        assert (getattr(one, name) != getattr(other, name)).any()
    assert one.start == again.start != other.start
    spread = {"element": one.element, "crank": one.crank, "cage": one.cage, "gear": one.lobe.ravel()}
    for part, sizes in spread.items():
        assert sizes.std() == pytest.approx(drive.tolerances[part].sigma, rel=0.3)


def test_one_crank_radius_per_eccentric_where_the_drawing_says_so() -> None:
    one = draw_individual(sm.load_drive("drive_1", crank_deviation="eccentric"), 1)
    rows = one.crank.reshape(-1, 3)
    assert (rows == rows[0]).all()
    assert len(set(rows[0])) == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"lobe": np.full((3, 29), 7e-3)}, "lobe: expected positive lengths in m of shape"),
        ({"cage": np.full(87, -7e-3)}, "cage: expected positive lengths"),
        ({"start": float("nan")}, "start: expected a finite angle"),
    ],
)
def test_unsuitable_parts_are_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        replace(draw_individual(sm.load_drive("drive_1"), 0), **change)


def test_wrong_input_is_refused_in_one_line() -> None:
    drive = sm.load_drive("drive_1")
    with pytest.raises(InputError, match="at most 29 elements on an eccentric"):
        draw_individual(sm.load_drive("drive_1", elements=90), 0)
    with pytest.raises(InputError, match="seed: expected a whole number"):
        draw_individual(drive, -1)
    one = draw_individual(drive, 0)
    with pytest.raises(InputError, match="output angle: expected a one-dimensional array"):
        turning_map(one, [0.0], [[0.1]])
    with pytest.raises(InputError, match="twist: expected"):
        turning_map(one, [np.nan], [0.1])
