"""No test depends on the speed of the machine."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HERE = Path(__file__)
TESTS = HERE.parents[1]
FILES = [
    path for path in sorted(TESTS.rglob("*.py")) if path != HERE and path.relative_to(TESTS).parts[0] != "benchmarks"
]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(TESTS).as_posix())
def test_no_limit_in_seconds(path: Path) -> None:
    """Every process gets the time limit `subprocesses.TIMEOUT`, and no test measures durations."""
    text = path.read_text("utf-8")
    assert re.findall(r"timeout=(?!TIMEOUT\b).*", text) == []
    if path.name.startswith("test_"):
        assert re.findall(r".*\b(?:perf_counter|process_time)\b.*", text) == []
