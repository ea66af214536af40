"""Runs the program in a process of its own, and a drawing for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import stiffness_model as sm
from tests.subprocesses import TIMEOUT


def run_program(*args: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "reefmu", *args],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


def preset_text() -> str:
    return (Path(sm.__file__).parent / "presets" / "drive_1.toml").read_text("utf-8")
