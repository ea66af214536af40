"""`reefmu compare`: what it prints and writes."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.commands.drawings.compare import torque_steps
from tests.integration.commands.program import run_program


@pytest.mark.slow
def test_compare_prints_and_writes_the_published_gears(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        '[[gear]]\nmaker = "Own"\ntype = "X1"\nsource = "own rig"\nstiffness = "50 N.m/arcmin"\n'
        'rated_torque = "120 N.m"\n'
    )
    done = run_program(
        "compare", "drive_1", "--drives", "32", "--catalog", "own.toml", "--out", "here/below", folder=tmp_path
    )
    assert done.returncode == 0
    assert sorted(path.name for path in (tmp_path / "here" / "below").iterdir()) == ["compare.csv", "compare.png"]
    with (tmp_path / "here" / "below" / "compare.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[:3] == ["torque [N.m]", "drive_1 twist [arcmin]", "Harmonic Drive CHA-40A (ratio 50) twist [arcmin]"]
    assert head[-1] == "Own X1 twist [arcmin]"
    by_torque = {float(row[0]): row for row in rows}
    assert float(by_torque[100.0][-1]) == pytest.approx(2.0)
    assert by_torque[150.0][-1] == ""  # above what its row allows
    drive = sm.simulate(sm.load_drive("drive_1"), np.linspace(0, 8, 61) * sm.ARCMIN, 32).curve()
    assert float(by_torque[100.0][1]) == pytest.approx(float(drive.twist_at(100.0)) / sm.ARCMIN, rel=1e-6)
    for words in ("RV-42N", "quoted at second hand", "F1C-A25", "not found", "Own X1"):
        assert words in done.stdout


@pytest.mark.parametrize("greatest", [0.04, 0.8, 1.0, 7.9, 8.0, 12.7, 281.3, 357.0, 1e4, 99999.0])
def test_torque_steps_are_few_and_round(greatest: float) -> None:
    steps = torque_steps(greatest)
    assert 3 <= len(steps) <= 8
    assert steps[-1] <= greatest * (1 + 1e-9)
    assert steps[-1] > 0.6 * greatest
    assert all(float(f"{step:.2g}") == step for step in steps)
    np.testing.assert_allclose(np.diff(steps), steps[0])
