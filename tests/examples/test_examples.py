"""Every example runs as a program of its own and writes its pictures, whose texts do not collide."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.subprocesses import TIMEOUT

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
RECORDS = Path(__file__).resolve().parents[3] / "shared/data/cycloidal"
"""Measured records of third parties, under their own licence."""


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_example(example: Path, tmp_path: Path) -> None:
    if "Needs a C compiler" in example.read_text("utf-8") and not any(shutil.which(n) for n in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler on the PATH")
    if example.stem == "cycloidal_records" and not RECORDS.is_dir():
        pytest.skip(f"measured records, which are not part of this repository: none in {RECORDS}")
    run = subprocess.run(
        [sys.executable, "-m", "tests.picture_layout", str(example), str(tmp_path / "out")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={**os.environ, "MPLBACKEND": "Agg", "PYTHONPATH": str(EXAMPLES.parent)},
        timeout=TIMEOUT,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip(), "the example prints its figures"
    assert [path.name for path in tmp_path.iterdir()] == ["out"], "an example writes to its folder only"
    files = list((tmp_path / "out").iterdir())
    assert any(file.suffix == ".png" for file in files)
    assert all(file.stat().st_size > 0 for file in files)
    if example.stem == "cycloidal_records":
        check_play_and_friction_of_measured_records(run.stdout)


def check_play_and_friction_of_measured_records(table: str) -> None:
    """Play decreases with preload, friction depends on load in all records, and the remainder exceeds the noise."""
    rows = [line for line in table.splitlines() if re.match(r" +[0-5] +\w+ +\d+ arcmin", line)]
    assert len(rows) == 6
    assert all("load_dependent_hysteresis" in row for row in rows)
    play = [int(re.findall(r"(\d+) arcmin", row)[1]) for row in rows]
    assert play == sorted(play, reverse=True)
    assert play[-1] < 0.5 * play[0]
    noise, remainder = (np.array([float(re.findall(r"([\d.]+) N\.m", row)[k]) for row in rows]) for k in (-2, -1))
    assert (remainder > 3 * noise).all()
