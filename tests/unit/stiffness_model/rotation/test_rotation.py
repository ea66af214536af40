"""An individual that turns: kinematics, symmetries, energy, and the paper's own way at single places."""

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


def anywhere(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-20, 20, count)


def rolled(one: Individual, places: int) -> Individual:
    """The same parts, each moved on by some bores of its own row of the cage."""
    by = places * one.drive.eccentrics
    return replace(one, **{name: np.roll(getattr(one, name), by) for name in SIZES})


@pytest.mark.parametrize(("name", "fields"), DRAWINGS)
def test_a_turn_of_the_output_closes_the_pattern_and_nothing_shorter_does(name: str, fields: dict[str, object]) -> None:
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 3), anywhere(60), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    full = np.abs(torque).max()
    assert turning_map(one, twist, angle + 2 * np.pi).torque == pytest.approx(torque, abs=1e-11 * full)
    for part in (2, 3, 5, 7, drive.lobes, drive.elements_per_row, round(drive.transmission_ratio)):
        early = turning_map(one, twist, angle + 2 * np.pi / part).torque
        assert np.abs(early - torque).max() > 1e-3 * full


@pytest.mark.parametrize(("name", "fields"), DRAWINGS)
def test_parts_moved_by_one_place_shift_the_angle(name: str, fields: dict[str, object]) -> None:
    """All balls, bores and races one bore on is the cage one bore further; all lobes one on is the gear one lobe
    further, which for cage and crank is one lobe back."""
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 4), anywhere(60), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    close = pytest.approx(torque, abs=1e-11 * np.abs(torque).max())
    bore = 2 * np.pi / drive.elements_per_row
    assert turning_map(rolled(one, 1), twist, angle + bore).torque == close
    lobes = replace(one, lobe=np.roll(one.lobe, 1, axis=1))
    assert turning_map(lobes, twist, angle + drive.orientation * 2 * np.pi / drive.lobes).torque == close
    other_way = turning_map(lobes, twist, angle - drive.orientation * 2 * np.pi / drive.lobes).torque
    assert np.abs(other_way - torque).max() > 1e-3 * np.abs(torque).max()


@pytest.mark.parametrize(("name", "fields"), DRAWINGS[:3])
def test_the_mirrored_twist_of_the_mirrored_drive(name: str, fields: dict[str, object]) -> None:
    """Turned over, a drive carries the opposite torque: positions, and with them all orders, run backwards."""
    drive = sm.load_drive(name, **fields)
    one, angle, twist = draw_individual(drive, 5), anywhere(40), three_twists(drive)
    torque = turning_map(one, twist, angle).torque
    n, rows = drive.elements, drive.eccentrics
    k = np.arange(n)
    # beta -> -beta: element k takes the place of -k, whose row is -k too; lobes run backwards.
    over = {name: getattr(one, name)[-k % n] for name in SIZES}
    lobe = one.lobe[-np.arange(rows) % rows][:, -np.arange(drive.lobes) % drive.lobes]
    # Counted backwards, the rows but the first begin one element later, which faces the next lobe.
    per_element = round(drive.ratio / drive.elements_per_row)
    lobe = np.array([np.roll(lobe[row], per_element if row else 0) for row in range(rows)])
    mirrored = replace(one, start=-one.start, lobe=lobe, **over)
    assert turning_map(mirrored, -twist, -angle).torque == pytest.approx(-torque, abs=1e-10 * np.abs(torque).max())


@pytest.mark.parametrize(("name", "fields"), [DRAWINGS[0], DRAWINGS[1], DRAWINGS[4]])
def test_places_and_torque_from_the_drawing_board(name: str, fields: dict[str, object]) -> None:
    """Where every element stands in the gear by plain angles, its lobe by the nearest crest, and its torque by the
    paper's root search."""
    drive = sm.load_drive(name, **fields)
    one = next(one for one in (draw_individual(drive, seed) for seed in range(9)) if (one.cage > one.element).all())
    crank_twist = 0.7 * drive.max_twist * drive.ratio
    checked = 0
    for angle in anywhere(6, seed=1):
        elements = []
        for k in range(drive.elements):
            row, j = k % drive.eccentrics, k // drive.eccentrics
            # Bores stand evenly round the cage; every row's gear and eccentric are phased for its elements.
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
            turning_map(draw_individual(drive, seed), twist, anywhere(24, seed)).torque.mean(axis=0)
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
def test_energy_balances_over_a_turn_where_nothing_is_cut_away(lobes: int) -> None:
    """At constant twist the crank's work over a turn is the output's: i T_crank and T_out have the same mean. What is
    left is the paper's linearised gear contact, and goes with the twist."""
    drive = sm.load_drive("drive_1", element_radius="3 mm", crank_radius="45 mm", lobes=lobes)
    assert drive.usable_limit == np.pi
    found = turning_map(draw_individual(drive, 1), np.array([0.02, 0.2, 1.0]) * drive.max_twist, anywhere(600))
    balance = found.torque.mean(axis=0) / (drive.ratio * found.crank_torque.mean(axis=0)) - 1
    assert (np.abs(balance) < [5e-4, 1e-3, 4e-3]).all()
    # So it is at every single angle: what the contacts store and give back is little, for the twist is.
    assert found.torque[:, 2] == pytest.approx(drive.ratio * found.crank_torque[:, 2], rel=6e-3)


def test_energy_that_is_missing_leaves_at_the_cut() -> None:
    """Where the profile is cut away a loaded element drops out with the energy stored in its contacts: that much the
    two works over a turn differ by."""
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


def test_small_deviations_act_linearly_and_add_up() -> None:
    """Under load, a thousandth of the deviations does a thousandth of the change, each part's beside the others'."""
    drive = sm.load_drive("drive_1")
    # Preload: every contact that carries stays closed, and every other open.
    calm, drawn, angle = mean_individual(drive, 0.4), draw_individual(drive, 8), anywhere(50)
    parts = (*SIZES, "lobe")

    def change(share: float, *names: str) -> np.ndarray:
        moved = {name: getattr(calm, name) + share * (getattr(drawn, name) - getattr(calm, name)) for name in names}
        found = turning_map(replace(calm, **moved), [drive.max_twist], angle, clearance=-2e-5)
        return found.torque - turning_map(calm, [drive.max_twist], angle, clearance=-2e-5).torque

    small, smaller = change(1e-2, *parts), change(1e-3, *parts)
    scale = np.abs(small).max()
    assert scale > 1e-3
    assert 10 * smaller == pytest.approx(small, abs=0.02 * scale)
    assert sum(change(1e-2, name) for name in parts) == pytest.approx(small, abs=0.02 * scale)


def test_the_gears_stiffness_along_the_profile_is_the_contacts_own() -> None:
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


def test_a_seed_is_a_drive() -> None:
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
def test_an_individual_that_cannot_be_is_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        replace(draw_individual(sm.load_drive("drive_1"), 0), **change)


def test_faults_are_refused_in_one_line() -> None:
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
