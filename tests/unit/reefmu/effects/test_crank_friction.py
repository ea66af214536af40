"""Friction at the crank: power out over power in is the friction analysis' or the sheet's efficiency, both ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.model.drive_model import DriveModel, build_model, describe_effects
from reefmu.model.model_file import load_model, save_model
from reefmu.simulate import Response, simulate_signal
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.ratings.efficiency import expected_losses

from .conftest import Build, Trajectory

MU = 0.05
SHEET = """
kind = "catalogue"
name = "sheet"
source = "own rig"
ratio = -50
stiffness = "20 kN.m/rad"
rated_torque = "100 N.m"
[efficiency]
speed = ["500 rpm", "2000 rpm"]
torque = ["20 N.m", "50 N.m", "100 N.m"]
value = [[0.66, 0.78, 0.83], [0.58, 0.74, 0.81]]
"""


def turning(model: DriveModel, twist: float, crank_speed: float, temperature: float = 20.0) -> Response:
    """The drive turning at a constant twist, long enough for its friction to slide."""
    ratio = model.parameters[0].value
    time = np.linspace(0, 10 / abs(crank_speed), 50)
    crank = crank_speed * time
    speeds = [np.full_like(time, speed) for speed in (crank_speed, crank_speed / ratio)]
    warm = np.full_like(time, temperature)
    return simulate_signal(model, time, np.stack([crank, speeds[0], crank / ratio - twist, speeds[1], warm], axis=1))


def efficiencies(model: DriveModel, twist: float, output_speed: float) -> tuple[float, float]:
    """Power out over power in with the crank driving, and with the output driving: < 0 where both shafts drive."""
    ratio = model.parameters[0].value
    found = []
    for sense in (1, -1):
        speed = sense * output_speed
        response = turning(model, twist, ratio * speed)
        at_output, at_crank = response["output.tau"][-1] * speed, -response["crank.tau"][-1] * ratio * speed
        found.append(at_output / at_crank if sense > 0 else at_crank / at_output)
    return found[0], found[1]


@pytest.mark.parametrize("share", [0.006, 0.03, 0.1, 0.3, 1.0])
def test_drive_has_the_efficiency_of_the_friction_analysis(share: float, drive: sm.Drive, lookup: Lookup) -> None:
    rough = sm.load_drive("drive_1", friction_coefficient=MU)
    twist = share * drive.max_twist
    (driving,), (driven,) = expected_losses(rough, [twist]).mean_efficiencies()
    found = efficiencies(build_model(rough, lookup=lookup), twist, 0.1)
    assert found == pytest.approx((driving, driven), abs=0.01)
    plain = efficiencies(build_model(drive, lookup=lookup), twist, 0.1)
    assert plain == pytest.approx((1.0, 1.0), rel=1e-12)


def test_the_output_does_not_feel_it(build: Build, trajectory: Trajectory) -> None:
    found = simulate_signal(build(crank_friction={"torque": 0.1, "fraction": 0.2}), trajectory.time, trajectory.inputs)
    plain = simulate_signal(build(), trajectory.time, trajectory.inputs)
    for name in set(plain.names) - {"crank.tau"}:
        assert np.array_equal(found[name], plain[name]), name
    friction = plain["crank.tau"] - found["crank.tau"]
    limit = 0.1 + 0.2 * np.abs(plain["output.tau"] / 29)
    assert (np.abs(friction) < 2.01 * limit).all(), "the damping adds at most the limit"
    assert min(friction.max(), -friction.min()) > 0.1


def test_where_friction_exceeds_the_load_both_shafts_must_be_driven(build: Build, drive: sm.Drive) -> None:
    driving, driven = efficiencies(build(crank_friction={"fraction": 1.2}), drive.max_twist, 0.1)
    assert driving == pytest.approx(1 / 2.2, rel=1e-6)
    assert driven == pytest.approx(-0.2, rel=1e-6)


def test_the_sheet_s_efficiencies_become_friction(tmp_path: Path) -> None:
    (tmp_path / "sheet.toml").write_text(SHEET, "utf-8")
    sheet = sm.load_drive(tmp_path / "sheet.toml")
    model = build_model(sheet)
    assert [effect.name for effect in model.effects] == ["crank_friction"]
    for speed in sheet.efficiency.speed:
        for torque in sheet.efficiency.torque:
            driving, _ = efficiencies(model, torque / 20e3, speed / 50)
            assert driving == pytest.approx(float(sheet.efficiency.at(speed, torque)), abs=0.01)
    lines = "\n".join(sm.simulate(sheet, [0.0, 1e-3], 1).lines())
    assert "crank_friction (torque" in lines


def test_viscous_part_thins_and_stribeck_part_fades(build: Build) -> None:
    def friction(speed: float, temperature: float = 20.0, **values: float) -> float:
        return float(-turning(build(crank_friction=values), 0.0, speed, temperature)["crank.tau"][-1])

    cold, warm = (friction(100.0, t, viscous=1e-3, thinning=0.03) for t in (20.0, 60.0))
    assert cold == pytest.approx(0.1, rel=1e-9)
    assert warm == pytest.approx(0.1 * np.exp(-1.2), rel=1e-9)
    slow, fast = (friction(speed, torque=0.05, stribeck=0.4) for speed in (0.05, 100.0))
    assert (slow, fast) == pytest.approx((0.07, 0.05), rel=1e-3)


def test_load_and_no_load_friction_combine_by_the_exponent(build: Build, lookup: Lookup, drive: sm.Drive) -> None:
    useful = float(lookup.torque(drive.max_twist)) / 29
    for exponent in (1.0, 2.0, 5.0):
        model = build(crank_friction={"torque": 0.6, "fraction": 0.09, "exponent": exponent})
        driving, _ = efficiencies(model, drive.max_twist, 0.1)
        lost = (0.6**exponent + (0.09 * useful) ** exponent) ** (1 / exponent)
        assert driving == pytest.approx(useful / (useful + lost), rel=1e-6)


def test_relief_lowers_the_share_of_friction_under_load(build: Build, lookup: Lookup, drive: sm.Drive) -> None:
    useful = float(lookup.torque(drive.max_twist)) / 29
    model = build(crank_friction={"fraction": 0.1, "relief": 0.05})
    driving, _ = efficiencies(model, drive.max_twist, 0.1)
    assert driving == pytest.approx(1 / (1 + 0.1 / (1 + 0.05 * useful)), rel=1e-6)


def test_given_parameters_stand_beside_the_drawing_s(lookup: Lookup, tmp_path: Path) -> None:
    rough = sm.load_drive("drive_1", friction_coefficient=MU)
    derived = describe_effects(build_model(rough, lookup=lookup))["crank_friction"]
    assert derived["fraction"] == pytest.approx(0.09, rel=0.02)
    changed = build_model(rough, {"crank_friction": {"viscous": 1e-4}}, lookup=lookup)
    assert describe_effects(changed)["crank_friction"] == {**derived, "viscous": 1e-4}
    neutral = build_model(rough, {"crank_friction": {}}, lookup=lookup)
    assert describe_effects(neutral)["crank_friction"]["fraction"] == 0.0
    save_model(changed, tmp_path / "model.toml")
    assert describe_effects(load_model(tmp_path / "model.toml", lookup=lookup)) == describe_effects(changed)
