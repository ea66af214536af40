"""The Python and shell blocks of README and docs run as they are printed, those of a page one after the other."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from reefmu.cli import build_parser
from tests.examples import page_program
from tests.examples.page_program import EXCLUDED, blocks
from tests.subprocesses import TIMEOUT
from tests.unit.test_docs import PAGES, ROOT

RUN = {page: blocks(page) for page in PAGES}
IDS = {page: page.relative_to(ROOT).with_suffix("").as_posix() for page in PAGES}


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if RUN[page]], ids=IDS.get)
def test_examples_of_a_page(page: Path, tmp_path: Path) -> None:
    (tmp_path / "examples").mkdir()
    shutil.copy(ROOT / "examples/hidden_effect.csv.gz", tmp_path / "examples")
    done = subprocess.run(
        [sys.executable, page_program.__file__, str(page)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT,
        env={**os.environ, "MPLBACKEND": "Agg"},
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr


def test_the_pages_have_examples() -> None:
    assert len([page for page in PAGES if RUN[page]]) >= 10


def calls_shown() -> list[tuple[str, str]]:
    """Calls in blocks that do not run: lists of uses with remarks beside the calls, and files of the reader's own."""
    found: list[tuple[str, str]] = []
    for page in PAGES:
        text = page.read_text("utf-8")
        for fence in re.finditer(r"^```(text|sh)?\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
            if fence[1] != "sh" or EXCLUDED.search(text[: fence.start()]):
                lines = (re.split(r"\s{3,}", line)[0] for line in fence[2].splitlines())
                found += [(IDS[page], line) for line in lines if line.startswith("reefmu ") and "DRIVE" not in line]
        found += [(IDS[page], call) for call in re.findall(r"^\| `(reefmu [^`]+)` \|", text, re.MULTILINE)]
    return found


@pytest.mark.parametrize(("page", "call"), calls_shown())
def test_calls_that_are_shown_are_understood(page: str, call: str) -> None:
    build_parser().parse_args(shlex.split(call)[1:])
