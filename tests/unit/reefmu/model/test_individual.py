"""An individual drive as a component: expressions against the solver, files, FMUs, the joint."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.cli import main
from reefmu.commands.drawings import turning_individual
from reefmu.fmu.export import export_fmu
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.joint import JointModel, Masses
from reefmu.model.contacts.individual import individual_function
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.model_file import load_model, model_text, save_model
from stiffness_model.errors import InputError, UnknownNameError
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.rotation import Individual, draw_individual, loaded_turn, turning_map
from stiffness_model.units import ARCMIN

SMALL = {
    "transmission_ratio": 9,
    "lobes": 10,
    "elements": 27,
    "eccentricity": "2 mm",
    "max_twist": "20 arcmin",
    "element_radius": "6 mm",
    "name": "small",
}


@pytest.fixture(scope="module")
def one(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, lookup=lookup, individual=3)


def seed_of(drive: sm.Drive, *, tight: bool) -> Individual:
    """The first individual with a ball larger than its bore, or without."""
    drawn = (draw_individual(drive, seed) for seed in range(200))
    return next(one for one in drawn if bool((one.cage < one.element).any()) is tight)


def worst(drive: sm.Drive, lookup: Lookup, one: Individual) -> tuple[float, float]:
    """Greatest differences of torque and force, of their greatest, to the solver, over the whole range, many turns and
    three clearances."""
    rng = np.random.default_rng(0)
    angle, twist = rng.uniform(-40, 40, 12), np.linspace(lookup.twist.start, lookup.twist.stop, 31)
    function = individual_function(one, lookup)
    off: list[tuple[float, float]] = []
    for clearance in (-3e-6, 0.0, 5e-6):
        solved = turning_map(one, twist, angle, clearance=clearance)
        t, a = np.meshgrid(twist, angle)
        torque, _, force, share, in_range = (
            np.asarray(v).reshape(t.shape) for v in function.map(t.size)(t.ravel(), clearance, a.ravel())
        )
        off.append(
            (
                float(np.abs(torque - solved.torque).max() / np.abs(solved.torque).max()),
                float(np.abs(force - solved.max_force).max() / solved.max_force.max()),
            )
        )
        assert in_range.all()
        assert (share > 1 / drive.elements).all()
        assert (share <= 1).all()
    return max(o[0] for o in off), max(o[1] for o in off)


@pytest.mark.parametrize(
    ("fields", "limit"),
    [
        pytest.param({}, 5e-7, id="reversing"),
        pytest.param({"lobes": 28, "gear_tolerance": "IT9"}, 5e-7, id="turning together, milled"),
        pytest.param({"element": "roller", "element_length": "10 mm"}, 1e-6, id="rollers"),
        pytest.param({"element_radius": "3 mm", "crank_radius": "45 mm"}, 5e-7, id="whole profile"),
        pytest.param({"elements": 63}, 5e-7, id="fewer balls than places"),
    ],
)
def test_the_expressions_equal_the_solver(fields: dict[str, object], limit: float, lookup: Lookup) -> None:
    drive = sm.load_drive("drive_1", **fields)
    torque, force = worst(drive, lookup, seed_of(drive, tight=False))
    assert torque < limit
    assert force < 3e-5


def test_a_ball_larger_than_its_bore_counts_as_one_that_fits(drive: sm.Drive, lookup: Lookup) -> None:
    assert 1e-6 < worst(drive, lookup, seed_of(drive, tight=True))[0] < 4e-4


def test_derivatives_and_extrapolation(drive: sm.Drive, lookup: Lookup) -> None:
    function = individual_function(draw_individual(drive, 3), lookup)
    by = function.factory(
        "by",
        ["twist", "clearance", "angle"],
        ["torque", "stiffness", "jac:torque:twist", "jac:torque:clearance", "jac:torque:angle"],
    )
    step = np.array([1e-8, 1e-11, 1e-8])
    for point in np.array([[0.7, 1e-6, 0.3], [-0.4, 0.0, 5.0], [0.02, -1e-6, 1.0]]):
        point[0] *= drive.max_twist
        torque, stiffness, *slopes = (float(v) for v in by(*point))
        assert np.isfinite(torque)
        assert stiffness == pytest.approx(slopes[0], rel=1e-12)
        for k, slope in enumerate(slopes):
            ahead, behind = (float(function(*(point + side * step * (np.arange(3) == k)))[0]) for side in (1, -1))
            assert slope == pytest.approx((ahead - behind) / (2 * step[k]), rel=1e-4, abs=1e-3 * stiffness)
    end, far = lookup.twist.stop, 1.5 * lookup.twist.stop
    at_end, slope, *_ = (float(v) for v in function(end, 0, 0.4))
    torque, stiffness, _, _, inside = (float(v) for v in function(far, 0, 0.4))
    assert (torque, stiffness, inside) == pytest.approx((at_end + slope * (far - end), slope, 0))
    # Without contact: no force, and finite derivatives.
    assert all(np.isfinite(float(v)) for v in by(0, lookup.clearance.stop, 0.1))


def test_the_torque_depends_on_the_output_angle(one: DriveModel, drive: sm.Drive) -> None:
    """Torque, stiffness and force of the model at angles of crank and output are the solver's; the mean's are not."""
    assert one.individual is not None
    twist, angle = 0.6 * drive.max_twist, np.array([0.0, 0.05, 0.4, 2.0])
    p = one.parameter_vector()
    found = [np.asarray(one.output([], [drive.ratio * (a + twist), 0, a, 0, 20], p)).ravel() for a in angle]
    solved = turning_map(one.individual, [twist], angle)
    assert [y[0] for y in found] == pytest.approx(solved.torque[:, 0], rel=1e-6)
    assert [y[4] for y in found] == pytest.approx(solved.max_force[:, 0], rel=1e-4)
    assert np.ptp([y[0] for y in found]) > 1
    # The crank's torque follows from virtual work, as for the mean.
    assert [drive.ratio * y[1] for y in found] == pytest.approx([-y[0] for y in found], rel=1e-12)


def test_an_individual_with_effects(drive: sm.Drive, lookup: Lookup) -> None:
    """Backlash is a clearance of every lobe; a compliance is in series with the contacts."""
    effects = {
        "backlash": {"clearance": 4e-6},
        "structural_compliance": {"compliance": 4e-6},
        "hysteresis": {"torque": 3.0, "presliding": 4e-5},
    }
    whole = build_model(drive, effects, lookup=lookup, individual=3)
    assert whole.individual is not None
    twist, angle = 0.8 * drive.max_twist, 0.7
    u, p = [drive.ratio * (angle + twist), 0, angle, 0, 20], whole.parameter_vector()
    y = np.asarray(whole.output(whole.initial(u, p), u, p)).ravel()
    contacts = turning_map(whole.individual, [twist - 4e-6 * y[0]], [angle], clearance=4e-6)
    assert contacts.torque[0, 0] == pytest.approx(y[0], rel=1e-6)
    assert np.isfinite(np.asarray(whole.jacobian(whole.initial(u, p), u, p))).all()


def test_the_mean_drive_contains_nothing_of_an_individual(model: DriveModel, one: DriveModel) -> None:
    for name in ("output", "jacobian"):
        nodes = {f.name() for f in _within(getattr(model, name))}
        assert not any("individual" in node or "element" in node for node in nodes)
        assert any("individual" in f.name() for f in _within(getattr(one, name)))
    assert "individual" not in model_text(model)


def _within(function: ca.Function) -> list[ca.Function]:
    inside = function.find_functions()
    return [function, *inside]


def test_a_band_has_no_meaning(one: DriveModel) -> None:
    with pytest.raises(UnknownNameError):
        one.with_parameters(band=0.5)


def test_model_file_keeps_the_seed(one: DriveModel, lookup: Lookup, tmp_path: Path) -> None:
    lookup.save(tmp_path / "lookup.npz")
    save_model(one, tmp_path / "model.toml")
    again = load_model(tmp_path / "model.toml", lookup=tmp_path / "lookup.npz")
    u, p = [0.3, 0, -0.012, 0, 20], one.parameter_vector()
    assert (np.asarray(again.output([], u, p)) == np.asarray(one.output([], u, p))).all()
    text = model_text(one)
    for wrong, said in (
        ("individual = -1", "individual: expected a whole number"),
        ('individual = "3"', "individual: expected a whole number"),
        ("individual = 3\nband = 0.5", "no band beside an individual"),
        ("individuals = 3", "did you mean 'individual'"),
    ):
        (tmp_path / "model.toml").write_text(text.replace("individual = 3", wrong))
        with pytest.raises(InputError, match=said):
            load_model(tmp_path / "model.toml", lookup=tmp_path / "lookup.npz")


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["python", "native"])
def test_fmus_of_an_individual(one: DriveModel, backend: str, tmp_path: Path) -> None:
    if backend == "native" and not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler on the PATH")
    report = check_fmu(export_fmu(one, tmp_path / "one.fmu", backend=backend))
    assert report.passed, str(report)


def test_a_joint_has_the_twist_of_the_individual(one: DriveModel, drive: sm.Drive) -> None:
    """At equilibrium under load; the twist differs between crank angles."""
    assert one.individual is not None
    joint = JointModel(one, Masses(1e-4, 2.0, 1e-3, 0.5))
    twists = []
    for crank in (0.0, 3.0, 9.0):
        x, _ = joint.equilibrium(load_torque=-100.0, crank_angle=crank)
        twists.append(crank / drive.ratio - x[2])
        assert twists[-1] == pytest.approx(loaded_turn(one.individual, 100.0, [x[2]]).twist[0], abs=1e-6 * ARCMIN)
    assert np.ptp(twists) > 0.02 * ARCMIN


@pytest.mark.slow
def test_curve_command_writes_an_individual(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawing = tmp_path / "small.toml"
    sm.save_drive(sm.load_drive("drive_1", **SMALL), drawing)
    words = ["curve", str(drawing), "--individual", "2", "--drives", "8", "--out", str(tmp_path / "out")]
    turned = turning_individual.turn_individual(sm.load_drive(drawing), 2)
    # Both calls print the same individual, which takes some seconds.
    monkeypatch.setattr(turning_individual, "turn_individual", lambda drive, seed: turned)
    assert main(words) == 0
    assert "repeats after one turn of the output, 9 of the crank" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["individual"]
    assert found["seed"] == 2
    with (tmp_path / "out" / "individual_turn.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    loaded = found["loaded"][-1]
    at = head.index(f"transmission_error_{loaded['torque [N.m]']:.4g}_N.m [arcmin]")
    error, stiffness = np.array(rows, float)[:, at : at + 2].T
    assert loaded["transmission_error [arcmin]"] == pytest.approx(np.ptp(error), rel=1e-6)
    assert loaded["least_stiffness [N.m/arcmin]"] == pytest.approx(stiffness.min(), rel=1e-6)
    assert loaded["greatest_stiffness [N.m/arcmin]"] == pytest.approx(stiffness.max(), rel=1e-6)
    sizes = [order["amplitude [arcmin]"] for order in found["strongest_orders"]]
    assert sizes == sorted(sizes, reverse=True)
    names = {path.name for path in (tmp_path / "out").glob("individual*")}
    assert names == {
        f"individual_{name}"
        for name in ("map.csv", "turn.csv", "orders.csv", "map.png", "error.png", "orders.png", "fan.png")
    }
    with (tmp_path / "out" / "individual_map.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head == [
        "output_angle [deg]",
        "crank_turns [1]",
        "twist [arcmin]",
        "torque [N.m]",
        "crank_torque [N.m]",
        "max_force [N]",
    ]
    angle, turns, twist, torque, *_ = np.array(rows[1000], float)
    one = draw_individual(sm.load_drive(drawing), 2)
    assert turning_map(one, [twist * ARCMIN], [np.radians(angle)]).torque[0, 0] == pytest.approx(torque, rel=1e-6)
    assert turns == pytest.approx(9 * angle / 360)
    with (tmp_path / "out" / "individual_orders.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[0] == "order_per_output_turn [1]"
    assert [row[-1] for row in rows[:11]] == ["mean", *["both"] * 8, "lobes", "elements"]


def test_export_command_takes_an_individual(
    one: DriveModel, lookup: Lookup, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("reefmu.model.drive_model.cached_lookup", lambda *_: lookup)
    target = tmp_path / "three.fmu"
    assert main(["export", "drive_1", "-o", str(target), "--individual", "3"]) == 0
    assert "drive_1 individual 3: " in capsys.readouterr().out
    save_model(one, tmp_path / "model.toml")
    again = tmp_path / "again.fmu"
    assert main(["export", str(tmp_path / "model.toml"), "-o", str(again)]) == 0
    assert again.read_bytes() == target.read_bytes()
    capsys.readouterr()
    assert main(["export", str(tmp_path / "model.toml"), "-o", str(target), "--individual", "4"]) == 2
    assert "no --individual beside a model file" in capsys.readouterr().err
