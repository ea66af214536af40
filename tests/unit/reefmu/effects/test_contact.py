"""Modulus error and missing ball in the model: tables, sign, rotation, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS, Signals
from reefmu.model.contacts.element import with_contact_tables
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.model_file import load_model, save_model
from reefmu.simulate import inputs_at_twist, simulate_signal
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.contact.usable_elements import is_usable
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.lookup.build_lookup import Lookup, mean_torque
from stiffness_model.lookup.modulus import with_modulus

from .conftest import Build, Trajectory


@pytest.mark.parametrize("error", [-0.3, 0.5])
def test_modulus_against_a_lookup_of_the_other_drawing(
    error: float, build: Build, drive: sm.Drive, trajectory: Trajectory
) -> None:
    found = simulate_signal(build(modulus_error={"error": error}), trajectory.time, trajectory.inputs)
    twist = np.linspace(-1, 1, 41) * drive.max_twist
    exact = mean_torque(with_modulus(drive, error), twist)
    model = build(modulus_error={"error": error}, backlash={"clearance": 0.0})
    tau = simulate_signal(model, np.arange(41.0), inputs_at_twist(twist, model))["output.tau"]
    # The lookup averages the sampling noise over both signs.
    assert tau == pytest.approx((exact - exact[::-1]) / 2, abs=1e-3 * exact.max())
    plain = simulate_signal(build(), trajectory.time, trajectory.inputs)
    for name in ("output.tau", "stiffness", "max_contact_force"):
        ratio = found[name][np.abs(plain[name]) > 1] / plain[name][np.abs(plain[name]) > 1]
        assert ratio == pytest.approx(ratio[0], rel=1e-9)
        assert (ratio[0] < 1) == (error < 0)


def test_missing_ball_against_one_element_solved(model: DriveModel, lookup: Lookup) -> None:
    """A rotating drive without tolerances, with one element missing."""
    fine = sm.load_drive(
        "drive_1",
        **{f"{part}_tolerance": "0.01 um" for part in ("element", "crank", "cage", "gear")},
        cage_offset="2 um",
    )
    # The dip is a difference, so that the lookup with tolerances serves; one without takes long to build.
    lacking = build_model(fine, {"missing_ball": {"size": 1.0, "phase": 0.4}}, lookup=lookup)
    twist = 0.7 * fine.max_twist
    output = np.linspace(0.0, 0.7, 150)  # some three turns of the crank
    crank = fine.ratio * (output + twist)
    inputs = np.stack([crank, 0 * crank, output, 0 * crank, 20 + 0 * crank], axis=1)
    time = np.arange(len(crank), dtype=float)
    dip = simulate_signal(model, time, inputs)["output.tau"] - simulate_signal(lacking, time, inputs)["output.tau"]
    # In space the element is at the angle `output`, the eccentric at 0.4 + crank less the part of the twist.
    beta = (0.4 + (crank - fine.ratio * twist) - output + np.pi) % (2 * np.pi) - np.pi
    radius = np.full(beta.shape, fine.element_radius)
    element = Deviations(beta, radius, np.full(beta.shape, fine.crank_radius), radius + 2e-6, radius)
    alone = solve(build_contacts(fine, element), np.array([twist * fine.ratio])).output_torque[0]
    alone[~is_usable(fine, beta)] = 0.0
    sharp = np.abs(np.abs(beta) - fine.usable_limit) > 0.011
    assert dip[sharp] == pytest.approx(alone[sharp], abs=2e-3 * model.full_torque)
    assert dip.max() > 0.05 * model.full_torque, "the ball carries something on half of the turn"
    assert (dip > -1e-4 * model.full_torque).all(), "and never against the twist"
    assert np.mean(dip < 1e-4 * model.full_torque) > 0.4


@pytest.mark.parametrize("lobes", [28, 30])
def test_the_next_element_meets_the_same_profile(lobes: int) -> None:
    """The gear is fixed: after one cage pitch an element is where its neighbour was, on the same profile."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    pitch = 2 * np.pi / drive.transmission_ratio
    signals = Signals(*[0.0] * len(Signals._fields))._replace(ratio=drive.ratio, output_angle=pitch)
    _, turned = EFFECTS["missing_ball"].contribution(signals, {"size": 1.0, "phase": 0.7, "windup": 0.0}, {})
    # The neighbour was one pitch ahead on the cage, so that its angle to the eccentric is one pitch less.
    assert (turned - (0.7 - pitch)) / (2 * np.pi) == pytest.approx(round((turned - (0.7 - pitch)) / (2 * np.pi)))


def test_windup_of_the_output_shaft_does_not_move_the_element() -> None:
    """With the crank locked the output turns by the twist, and the cage by the share of it within the contacts."""
    signals = Signals(*[0.0] * len(Signals._fields))._replace(ratio=-29.0, crank_angle=2.9, output_angle=-0.11)
    contribution = EFFECTS["missing_ball"].contribution
    at = [contribution(signals, {"size": 1.0, "phase": 0.7, "windup": share}, {})[1] for share in (0.0, 0.5, 1.0)]
    assert at[0] == pytest.approx(0.7 - 30 * -0.11)
    assert at[2] == pytest.approx(0.7 + 2.9 * (1 + 1 / 29))
    assert at[1] == pytest.approx((at[0] + at[2]) / 2)


def test_the_dip_moves_with_the_cage_relative_to_the_crank(build: Build, drive: sm.Drive, lookup: Lookup) -> None:
    model = build(missing_ball={"size": 1.0, "phase": 0.0})
    crank = np.linspace(0, 40 * 2 * np.pi, 8001)
    torque = simulate_signal(
        model, np.arange(8001.0), inputs_at_twist(np.full(8001, 0.5 * drive.max_twist), model, crank)
    )
    dip = torque["output.tau"] - float(lookup.torque(0.5 * drive.max_twist))
    orders = np.linspace(0.9, 1.1, 401)
    strength = [np.abs(np.sum((dip - dip.mean()) * np.exp(-1j * order * crank))) for order in orders]
    assert orders[int(np.argmax(strength))] == pytest.approx(1 - 1 / drive.ratio, abs=1e-3)  # 30/29, not 1


def test_size_scales_the_dip_and_stiffness_follows(build: Build, drive: sm.Drive) -> None:
    def at(size: float, twist: float):
        model = build(missing_ball={"size": size, "phase": 1.2}, structural_compliance={"compliance": 2e-6})
        return simulate_signal(model, [0.0], inputs_at_twist([twist], model))

    full, half, none = (at(size, 0.5 * drive.max_twist)["output.tau"][0] for size in (1.0, 0.5, 0.0))
    assert full < half < none
    assert at(1.0, -0.5 * drive.max_twist)["output.tau"][0] == pytest.approx(
        at(0.0, -0.5 * drive.max_twist)["output.tau"][0], rel=1e-4
    ), "it carried this direction only"


def test_lookup_and_model_files_hold_the_tables_of_the_effects(
    drive: sm.Drive, lookup: Lookup, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    effects = {"modulus_error": {"error": -0.2}, "missing_ball": {"size": 1.0, "phase": 2.0}}
    model = build_model(drive, effects, lookup=lookup)
    assert (lookup.modulus, lookup.element) == (None, None)
    save_model(model, tmp_path / "model.toml")
    model.lookup.save(tmp_path / "lookup.npz")
    for name in ("modulus_shares", "cached_element_table"):
        monkeypatch.setattr(f"reefmu.model.contacts.element.{name}", None)  # nothing is solved again
    again = load_model(tmp_path / "model.toml", lookup=tmp_path / "lookup.npz")
    assert again.lookup.modulus == model.lookup.modulus
    u = inputs_at_twist([0.001], model)
    assert np.array_equal(simulate_signal(again, [0.0], u).outputs, simulate_signal(model, [0.0], u).outputs)
    assert with_contact_tables(again.lookup, drive, EFFECTS.values()) is again.lookup
    assert build_model(drive, {"hysteresis": {}}, lookup=lookup).lookup is lookup
