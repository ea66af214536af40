"""A drawn individual has the parts and forces of the individual of the same seed that turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.cli import main
from stiffness_model.plotting.cross_section.element_forces import ElementForces, solve_element_forces
from stiffness_model.rotation import draw_individual, elements_at, turning_map

FIELDS = {
    "drive_1": {},
    "together": {"lobes": 28},
    "every second place": {"transmission_ratio": 20, "lobes": 21, "elements": 3 * 10, "eccentricity": "1.5 mm"},
}


def at_angle(drive: sm.Drive, seed: int, twist: float, angle: float) -> ElementForces:
    one = draw_individual(drive, seed)
    deviations, weight = elements_at(one, angle / drive.ratio)
    return solve_element_forces(drive, deviations, twist, angle, one.start, weight)


@pytest.mark.parametrize("fields", FIELDS)
@pytest.mark.parametrize(("seed", "angle"), [(7, 0.0), (7, 2.5), (3, -40.0)])
def test_a_drawn_individual_has_the_forces_of_the_turning_map(fields: str, seed: int, angle: float) -> None:
    drive = sm.load_drive("drive_1", **FIELDS[fields])
    one, forces = draw_individual(drive, seed), at_angle(drive, seed, 0.8 * drive.max_twist, angle)
    drawn = forces.deviations
    for name in ("element", "crank", "cage"):
        np.testing.assert_array_equal(getattr(drawn, name)[0], getattr(one, name))
    # Eq. 20 in motion, element by element.
    beta = one.start + (drive.ratio - 1) * angle / drive.ratio + 2 * np.pi * np.arange(drive.elements) / drive.elements
    np.testing.assert_allclose(np.exp(1j * drawn.beta[0]), np.exp(1j * beta), atol=1e-9)
    # Every element faces a lobe of its own row, and lobes are shared only if there are fewer lobes than elements.
    for row in range(drive.eccentrics):
        facing = drawn.gear[0, row :: drive.eccentrics]
        assert set(facing) <= set(one.lobe[row])
        assert len(set(facing)) == min(len(facing), drive.lobes)
    turned = turning_map(one, [forces.twist], [angle / drive.ratio])
    # The map interpolates the gear's stiffness in a table, right to 2e-5.
    assert forces.magnitude.max() == pytest.approx(turned.max_force[0, 0], rel=1e-4)
    assert forces.torque.sum() == pytest.approx(turned.torque[0, 0], rel=1e-4)


def test_elements_reach_their_next_lobe_after_a_turn_of_the_crank() -> None:
    """In a turn of the crank every element reaches its next lobe; after a turn of the output everything repeats."""
    drive = sm.load_drive("drive_1")
    one = draw_individual(drive, 5)
    (now, _), (then, _) = (elements_at(one, turn * 2 * np.pi / drive.ratio) for turn in (0.0, 1.0))
    assert (now.element == then.element).all()
    assert (now.gear != then.gear).any()
    whole, _ = elements_at(one, 2 * np.pi)
    np.testing.assert_allclose(whole.gear, now.gear)


@pytest.mark.slow
def test_draw_prints_the_torque_of_the_turning_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["draw", "drive_1", "--individual", "7", "--angle", "70", "--twist", "5", "--out", str(tmp_path)]) == 0
    torque = float(capsys.readouterr().out.split("at 5 arcmin ")[1].split()[0])
    drive = sm.load_drive("drive_1")
    turned = turning_map(draw_individual(drive, 7), [5 * sm.ARCMIN], [np.radians(70) / drive.ratio])
    assert torque == pytest.approx(turned.torque[0, 0], rel=2e-3)
