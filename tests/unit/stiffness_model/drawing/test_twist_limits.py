"""Twists and angles beyond the limits are refused everywhere, and elements without equilibrium are reported once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.cli import main
from stiffness_model.drawing import sampling
from stiffness_model.drawing.twist_limits import MAX_OUTPUT_ANGLE, MAX_TWIST_FACTOR, QUARTER_TURN, twist_limit
from stiffness_model.equilibrium import newton
from stiffness_model.equilibrium.closed_form import Status
from stiffness_model.errors import InputError, NotConvergedWarning
from stiffness_model.lookup.build_lookup import mean_torque
from stiffness_model.plotting.cross_section.element_forces import solve_element_forces
from stiffness_model.plotting.cross_section.layout import place_parts
from stiffness_model.ratings.bearing_life import bearing_life
from stiffness_model.ratings.efficiency import friction_losses
from stiffness_model.ratings.static_safety import static_safety
from stiffness_model.rotation import draw_individual, turning_map
from stiffness_model.units import ARCMIN

Call = Callable[[sm.Drive, np.ndarray], object]

CALLS: dict[str, Call] = {
    "simulate": lambda drive, twist: sm.simulate(drive, twist, 2),
    "pressure": lambda drive, twist: sm.contact_pressures(drive, twist, 2),
    "strength": lambda drive, twist: static_safety(drive, twist, 2),
    "life": lambda drive, twist: bearing_life(drive, twist, 2),
    "friction": lambda drive, twist: friction_losses(drive, twist, 2, coefficient=0.05),
    "lookup": mean_torque,
    "turning": lambda drive, twist: turning_map(draw_individual(drive, 0), twist, [0.1]),
    "view": lambda drive, twist: solve_element_forces(drive, sampling.nominal(drive), float(twist[-1])),
}


@pytest.fixture
def rated() -> sm.Drive:
    return sm.load_drive("drive_1", bearing_capacity="40 kN")


@pytest.mark.parametrize("call_name", CALLS)
def test_a_missing_factor_arcmin_is_suggested_and_the_limit_itself_is_computed(call_name: str, rated: sm.Drive) -> None:
    with pytest.raises(InputError, match=r"within \+-32 arcmin.*did you mean 8 \* ARCMIN") as caught:
        CALLS[call_name](rated, np.linspace(0, 8, 5))
    assert "\n" not in str(caught.value)
    CALLS[call_name](rated, np.array([twist_limit(rated)]))
    with pytest.raises(InputError, match="for greater twists raise max_twist in the drawing"):
        CALLS[call_name](rated, np.array([-60 * ARCMIN]))


def test_the_greatest_twist_has_eight_times_the_load_and_twice_the_pressure() -> None:
    """Hertz without clearance and scatter: the load grows with the power 3/2 of the twist, the pressure with 1/2."""
    drive = sm.load_drive("drive_1", **{f"{part}_tolerance": "0 um" for part in ("gear", "crank", "element")})
    twist = np.array([1.0, MAX_TWIST_FACTOR]) * drive.max_twist
    found = sm.contact_pressures(drive, twist, 8).pressure[..., :2].mean(axis=(0, 2))
    force = sm.simulate(drive, twist, 8).contact_force[..., 1].mean(axis=0)
    assert found[1] / found[0] == pytest.approx(2.0, rel=0.05)
    assert force[1] / force[0] == pytest.approx(8.0, rel=0.12)


def test_a_quarter_turn_of_the_crank_is_the_limit_whatever_the_drawing_states() -> None:
    wide = replace(sm.load_drive("drive_1"), max_twist=2 * QUARTER_TURN / 29)
    assert twist_limit(wide) == pytest.approx(QUARTER_TURN / 29)
    with pytest.raises(InputError, match="a quarter turn of the crank"):
        sm.simulate(wide, [wide.max_twist], 1)


@pytest.mark.parametrize("value", [2 * MAX_OUTPUT_ANGLE * 29, 1e300])
def test_an_angle_beyond_floating_point_resolution_is_refused(value: float) -> None:
    drive = sm.load_drive("drive_1")
    with pytest.raises(InputError, match="angle: expected a crank angle within"):
        place_parts(drive, value)
    with pytest.raises(InputError, match="output angle: expected angles within"):
        turning_map(draw_individual(drive, 0), [0.0], [value])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (["--twist", "1e308"], "--twist: expected twists within +-32 arcmin"),
        (["--twist", "-3600"], "--twist: expected twists within +-32 arcmin"),
        (["--angle", "1e308"], "--angle: expected a crank angle within"),
        (["--exaggerate", "1e308"], "--exaggerate: expected a factor of at most 1"),
        (["--exaggerate", "1e308", "--twist", "0"], "--exaggerate: expected a factor of at most"),
    ],
)
def test_draw_refuses_values_beyond_the_limits(
    call: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["draw", "drive_1", *call, "--out", str(tmp_path / "new")]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.fixture
def stopped(monkeypatch: pytest.MonkeyPatch) -> sm.Drive:
    """A drive with balls larger than their bores, whose iteration is stopped before its first step."""
    monkeypatch.setattr(newton, "MAX_STEPS", 0)
    return sm.load_drive("drive_1", cage_offset="0 um", bearing_capacity="40 kN")


@pytest.mark.parametrize("call_name", [call_name for call_name in CALLS if call_name not in ("lookup", "view")])
def test_elements_without_an_equilibrium_are_reported_once(call_name: str, stopped: sm.Drive) -> None:
    with pytest.warns(NotConvergedWarning, match=r"drive_1: \d+ of \d+ cases .* count as no force") as caught:
        CALLS[call_name](stopped, np.array([0.5, 1.0]) * stopped.max_twist)
    assert len(caught) == 1


def test_the_count_is_the_population_s_and_commands_report_it(
    stopped: sm.Drive, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.warns(NotConvergedWarning) as caught:
        population = sm.simulate(stopped, [stopped.max_twist], 8)
    lost = population.status_counts[Status.NOT_CONVERGED.name.lower()]
    assert lost > 0
    assert f"{lost} of {8 * stopped.elements} cases" in str(caught[0].message)
    assert main(["curve", "drive_1", "--set", "cage_offset=0 um", "--drives", "4", "--out", str(tmp_path / "c")]) == 0
    said = capsys.readouterr()
    assert sum("no equilibrium" in line for line in said.err.splitlines()) == 1
    assert "cases found no equilibrium and count as no force" in said.out


def test_there_is_no_warning_where_all_elements_converge(rated: sm.Drive) -> None:
    assert sm.simulate(rated, [rated.max_twist], 16).status_counts["not_converged"] == 0
