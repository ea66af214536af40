"""Models of a curve and of a catalogue gear: lines with rounded corners, flanks, the sheet's loop, no contact loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.joint import JointModel, Masses, joint_system
from reefmu.joint.joint_simulation import simulate_joint
from reefmu.model import DriveModel, build_curve_model, build_model
from reefmu.model.contacts.curve_contacts import curve_function
from reefmu.model.model_file import load_model, save_model
from reefmu.model.signals import CONTACT_LOADS
from reefmu.simulate import inputs_at_twist, simulate_signal
from reefmu.torque_loop import torque_loop
from stiffness_model.lookup.curve_lookup import CurveLookup, curve_lookup
from stiffness_model.lookup.table import Lookup
from stiffness_model.numerics.arrays import equal_values

POINTS = [5.4e-4, 1.55e-3, 3e-3], [54.0, 196.0, 420.0]


@pytest.fixture(scope="module")
def sheet() -> CurveLookup:
    return curve_lookup(*POINTS, 0.01, "sheet", -50)


@pytest.fixture(scope="module")
def gear() -> DriveModel:
    return build_model("CHA-40A-50")


def test_casadi_and_numpy_have_the_same_curve(sheet: CurveLookup) -> None:
    function = curve_function(sheet)
    twist = np.concatenate([np.linspace(-4e-3, 4e-3, 801), sheet.line.twist])
    for clearance in (-4e-5, -1e-5, -2e-6, 0.0, 3e-6, 1e-5, 4e-5):
        found = np.array(function.map(len(twist))(twist, clearance, 0.0)).reshape(5, -1)
        torque, stiffness, by_clearance = sheet.evaluate(twist, clearance)
        np.testing.assert_allclose(found[0], torque, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(found[1], stiffness, rtol=1e-9, atol=1e-6)
        step = 1e-9
        if abs(clearance) < sheet.clearance.stop - step:
            change = (sheet.torque(twist, clearance + step) - sheet.torque(twist, clearance - step)) / (2 * step)
            assert np.percentile(np.abs(change - by_clearance), 95) < 1e-3 * np.abs(by_clearance).max()


@pytest.mark.parametrize("crank", [0.0, 0.7, -12.3])
def test_a_joint_without_a_load_rests_in_the_middle_of_its_play(sheet: CurveLookup, crank: float) -> None:
    joint = JointModel(build_curve_model(sheet, {"backlash": {"clearance": 2e-6}}), Masses(2e-4, 0.7))
    x, u = joint.equilibrium(0.0, crank_angle=crank)
    assert x[2] == pytest.approx(crank / joint.ratio, abs=1e-15)
    assert u == pytest.approx(0, abs=1e-12)


def test_clearance_separates_the_flanks_and_interference_adds_them(sheet: CurveLookup) -> None:
    """A play of 1e-4 rad to either side carries nothing within; an interference of it loads both flanks."""
    line, play = sheet.line, 1e-4
    free, beyond = sheet.torque([0.0, 5e-5, -5e-5], 1e-6), sheet.torque([6e-4, -6e-4], 1e-6)
    np.testing.assert_allclose(free, 0.0, atol=1e-9)
    np.testing.assert_allclose(beyond, line.at(np.array([5e-4, -5e-4])), rtol=1e-9)
    near, far = sheet.torque(3e-5, -1e-6), sheet.torque(1e-3, -1e-6)
    np.testing.assert_allclose(near, line.at(3e-5 + play) + line.at(3e-5 - play), rtol=1e-9)
    np.testing.assert_allclose(far, line.at(1e-3 + play), rtol=1e-9)


def test_a_model_of_a_curve_has_the_torque_of_its_points_to_the_digit(gear: DriveModel) -> None:
    at_rest = simulate_signal(gear, [0.0], inputs_at_twist([1e-3], gear))
    assert at_rest["output.tau"] == pytest.approx([118.4], rel=1e-13)
    assert at_rest["crank.tau"] == pytest.approx([-118.4 / 50], rel=1e-13)


def test_outputs_of_contacts_are_missing_and_one_line_says_why(gear: DriveModel) -> None:
    assert {signal.name for signal in gear.outputs}.isdisjoint(CONTACT_LOADS)
    assert "CHA-40A-50 has no max_contact_force and load_share" in gear.lacks
    response = simulate_signal(gear, [0.0], inputs_at_twist([1e-3], gear))
    for name in CONTACT_LOADS:
        with pytest.raises(sm.InputError, match="CHA-40A-50 has no max_contact_force and load_share"):
            response[name]
    with pytest.raises(sm.UnknownNameError, match=r"did you mean 'output\.tau'"):
        response["output.taw"]
    assert not [head for head in torque_loop(gear) if "contact" in head or "share" in head]


def test_a_drive_with_contacts_keeps_all_outputs(model: DriveModel) -> None:
    assert set(CONTACT_LOADS) < {signal.name for signal in model.outputs}
    assert model.lacks == ""


def test_the_loop_has_the_width_of_the_sheet_s_hysteresis_loss(gear: DriveModel) -> None:
    """1 arcmin between the branches at zero torque, in a slow loop between the curve's ends."""
    reach = gear.lookup.twist.stop
    twist = np.concatenate(
        [np.linspace(0, reach, 200), np.linspace(reach, -reach, 8001), np.linspace(-reach, reach, 8001)]
    )
    time = 0.01 * np.arange(len(twist))
    torque = simulate_signal(gear, time, inputs_at_twist(twist, gear))["output.tau"]
    down, up = slice(200, 8201), slice(8201, None)
    crossings = [np.interp(0.0, torque[up], twist[up]), np.interp(0.0, torque[down][::-1], twist[down][::-1])]
    assert crossings[1] - crossings[0] == pytest.approx(sm.ARCMIN, rel=1e-4)


def test_values_of_the_caller_replace_the_sheet_s_effect() -> None:
    model = build_model("CHA-40A-50", {"hysteresis": {"torque": 0.0}})
    values = {p.name: p.value for p in model.parameters}
    assert values["hysteresis.torque"] == 0.0
    assert [effect.name for effect in build_model("CHA-40A-50", inherent=False).effects] == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"effects": {"missing_ball": {}}}, "missing_ball: CHA-40A-50 is a catalogue gear without responses"),
        ({"effects": {"modulus_error": {}}}, "modulus_error: CHA-40A-50 is a catalogue gear"),
        ({"individual": 3}, "individual: CHA-40A-50 is a catalogue gear without individual drives"),
    ],
)
def test_what_the_kind_lacks_is_refused_in_one_line(words: dict[str, object], message: str) -> None:
    with pytest.raises(sm.InputError, match=message):
        build_model("CHA-40A-50", **words)  # type: ignore[arg-type]


def test_band_has_no_meaning_and_no_range(gear: DriveModel) -> None:
    band = gear.parameters[1]
    assert (band.name, band.minimum, band.maximum) == ("band", 0.0, 0.0)
    with pytest.raises(sm.InputError):
        gear.with_parameters(band=1.0)


def test_model_file_keeps_the_drive_and_its_effects(gear: DriveModel, tmp_path: Path) -> None:
    save_model(gear, tmp_path / "model.toml")
    again = load_model(tmp_path / "model.toml")
    assert again == gear
    assert again.drive == sm.load_drive("CHA-40A-50")
    bare = build_model("CHA-40A-50", inherent=False)
    save_model(bare, tmp_path / "bare.toml")
    assert load_model(tmp_path / "bare.toml") == bare


def test_a_lookup_file_keeps_the_curve(sheet: CurveLookup, tmp_path: Path) -> None:
    sheet.save(tmp_path / "lookup.npz")
    again = Lookup.load(tmp_path / "lookup.npz")
    assert isinstance(again, CurveLookup)
    assert again.line == sheet.line
    assert again.drawing == sheet.drawing


def test_an_unknown_ratio_is_never_one(tmp_path: Path) -> None:
    """A curve without a ratio simulates with an assumed one, which its file does not state; a reader has to."""
    unknown = curve_lookup(*POINTS, 0.01, "locked", None)
    with pytest.raises(sm.InputError, match="expected a curve with its ratio"):
        build_curve_model(unknown)
    save_model(build_curve_model(unknown, assumed_ratio=1.0), tmp_path / "model.toml")
    assert "ratio" not in (tmp_path / "model.toml").read_text("utf-8")
    with pytest.raises(sm.InputError, match="expected the field 'ratio', crank to output with its sign, got none"):
        load_model(tmp_path / "model.toml")
    assert load_model(tmp_path / "model.toml", ratio=-50).parameters[0].value == -50


def test_a_joint_of_a_catalogue_gear_conserves_energy() -> None:
    """Over corners: the torque is the derivative of one energy, since the rounded corners have a slope."""
    masses = Masses(1e-3, 2.0)
    joint = JointModel(build_model("CHA-40A-50", inherent=False), masses)
    assert "max_contact_force" not in joint.equations.outputs
    assert joint_system(joint, name="a").ninputs == 2
    start = joint.state(np.array([0.0, 0.0, -2.2e-3, 0.0]))
    motion = simulate_joint(joint, lambda _t, _x: (0.0, 0.0), step=1e-4, duration=0.05, start=start, substeps=8)
    twist = np.linspace(0, 3e-3, 200001)
    energy = np.concatenate(
        [[0.0], np.cumsum((joint.drive.lookup.torque(twist)[1:] + joint.drive.lookup.torque(twist)[:-1]) / 2)]
    )
    stored = np.interp(np.abs(motion["twist"]), twist, energy * (twist[1] - twist[0]))
    moving = masses.motor_inertia * motion["crank.w"] ** 2 / 2 + masses.load_inertia * motion["output.w"] ** 2 / 2
    total = stored + moving
    assert np.ptp(motion["twist"]) > 4e-3
    np.testing.assert_allclose(total, total[0], rtol=1e-5)


def test_models_of_equal_drawings_are_equal_wherever_the_drawings_lie(tmp_path: Path) -> None:
    drive = sm.load_drive("CHA-40A-50")
    sm.save_drive(drive, tmp_path / "sheet.toml")
    again = sm.load_drive(tmp_path / "sheet.toml")
    assert again.where != drive.where
    assert equal_values(again, drive)
    assert build_model(again) == build_model(drive)
    assert not equal_values(sm.load_drive("CHA-40A-50", k1="101 kN.m/rad"), drive)
