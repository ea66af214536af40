"""Every example runs as a reader would run it, and leaves its pictures."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"
RECORDS = Path(__file__).resolve().parents[2] / "shared/data/cycloidal"


@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_example(example: Path, tmp_path: Path) -> None:
    if "Needs a C compiler" in example.read_text("utf-8") and not any(shutil.which(n) for n in ("cc", "gcc", "clang")):
        pytest.skip("no C compiler on the PATH")
    if example.stem == "cycloidal_records" and not RECORDS.is_dir():
        pytest.skip(f"no records in {RECORDS}")
    run = subprocess.run(
        [sys.executable, str(example), str(tmp_path / "out")], cwd=tmp_path, capture_output=True, text=True,
        env={**os.environ, "MPLBACKEND": "Agg"}, timeout=300)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip(), "the example prints its figures"
    assert [path.name for path in tmp_path.iterdir()] == ["out"], "nothing is left outside the folder asked for"
    files = list((tmp_path / "out").iterdir())
    assert any(file.suffix == ".png" for file in files)
    assert all(file.stat().st_size > 0 for file in files)
