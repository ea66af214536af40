"""Design studies that several tests of `reefmu explore` compare with."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from stiffness_model.explore.optimisation.run import run_study
from stiffness_model.explore.report.results import assess_designs, columns
from tests.integration.commands.studies.explore_runs import LONGER, write_study
from tests.small_study import study
from tests.subprocesses import TIMEOUT, messages


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of the small study, evaluated by one worker, and what the command printed."""
    folder = tmp_path_factory.mktemp("explore")
    made = subprocess.run(
        [
            sys.executable,
            "-m",
            "reefmu",
            "explore",
            str(write_study(folder)),
            "--workers",
            "1",
            "--out",
            str(folder / "out"),
        ],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert messages(made.stderr) == []
    return folder / "out", made.stdout


@pytest.fixture(scope="session")
def longer(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The columns of the longer study, from one process without interruption."""
    long_study = study(**LONGER)
    with ProcessPoolExecutor(1) as executor:
        return columns(assess_designs(long_study, *run_study(long_study, tmp_path_factory.mktemp("longer"), executor)))
