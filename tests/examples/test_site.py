"""The site is built without a warning, every example runs, and no link of a page leads nowhere or to a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import build_parser
from reefmu.effects import EFFECTS
from tests.examples.site_links import broken_links, read_pages
from tests.subprocesses import TIMEOUT
from tests.unit.test_docs import GENERATED, ROOT

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
    ),
]

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
RECORDS = Path(__file__).resolve().parents[3] / "shared/data/cycloidal"
"""Measured records of third parties, under their own licence."""


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources without what an earlier build has left, so that every example runs; the site is beside
    them."""
    copy = tmp_path_factory.mktemp("repository") / "reefmu"
    left_out = {Path(folder).name for folder in GENERATED if folder != "docs/reference/effects"}
    shutil.copytree(
        ROOT / "docs",
        copy / "docs",
        ignore=lambda folder, names: (
            left_out & set(names) | ({"effects"} & set(names) if Path(folder).name == "reference" else set())
        ),
    )
    shutil.copytree(ROOT / "examples", copy / "examples", ignore=shutil.ignore_patterns("__pycache__"))
    for linked in ("stiffness_model", "reefmu"):
        (copy / linked).symlink_to(ROOT / linked, target_is_directory=True)
    if RECORDS.is_dir():
        (copy.parent / "shared").symlink_to(RECORDS.parents[1], target_is_directory=True)
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "docs", str(copy.parent / "site")],
        cwd=copy,
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT,
        env={**os.environ, "MPLBACKEND": "Agg"},
    )
    assert done.returncode == 0, done.stderr
    return copy / "docs"


def printed(sources: Path, example: str) -> str:
    """What an example has printed, from its page in the gallery."""
    text = (sources / "gallery" / f"{example}.rst").read_text("utf-8")
    return "\n".join(
        re.findall(r"rst-class:: sphx-glr-script-out\n\n.*?code-block:: none\n\n(.*?)\n\n\n", text, re.DOTALL)
    )


def test_every_example_has_a_page_with_its_pictures_and_a_notebook(sources: Path) -> None:
    site = sources.parents[1] / "site"
    for example in EXAMPLES:
        name, output = example.stem, printed(sources, example.stem)
        assert output.strip(), f"{name} prints its figures"
        assert (sources / "gallery" / f"{name}.ipynb").stat().st_size > 0
        assert list(site.glob(f"_downloads/*/{name}.ipynb"))
        if "This example needs" not in output:
            assert list((sources / "gallery/output" / name).glob("*.png")), name
            assert list((site / "_images").glob(f"sphx_glr_{name}_001*.png")), name
    assert not {path.name for path in (sources.parent / "examples").iterdir()} - {
        *(path.name for path in (ROOT / "examples").iterdir()),
        "__pycache__",
    }, "an example writes to its folder only"


def test_effects_commands_and_links(sources: Path) -> None:
    site = sources.parents[1] / "site"
    pages = read_pages(site)
    assert sorted(broken_links(pages)) == []
    for name in EFFECTS:
        text = (site / f"reference/effects/{name}.html").read_text("utf-8")
        assert f"{name}.png" in text
    commands = re.findall(r"(?m)^    (\w+)", build_parser().format_help().split("COMMAND\n")[1])
    anchors = pages[(site / "reference/commands.html").resolve()].anchors
    assert len(commands) > 7
    assert {f"reefmu-{command}" for command in commands} <= anchors


@pytest.mark.skipif(not RECORDS.is_dir(), reason=f"measured records are not part of this repository: none in {RECORDS}")
def test_play_and_friction_of_measured_records(sources: Path) -> None:
    """Play decreases with preload from its second step on, all records have both kinds of friction, and the remainder
    exceeds the noise."""
    table = printed(sources, "cycloidal_records")
    rows = [line for line in table.splitlines() if re.match(r" +[0-5] +\w+ +\d+ arcmin", line)]
    assert len(rows) == 6
    assert all(name in row for row in rows for name in (" hysteresis", "load_dependent_hysteresis"))
    play = [int(re.findall(r"(\d+) arcmin", row)[1]) for row in rows]
    # With little preload friction that grows with the load takes a part of the play.
    assert play[2:] == sorted(play[2:], reverse=True)
    assert play[-1] < 0.5 * max(play)
    noise, remainder = (np.array([float(re.findall(r"([\d.]+) N\.m", row)[k]) for row in rows]) for k in (-2, -1))
    # The noise counts what cycles of one state differ by.
    assert (remainder > noise).all()


@pytest.mark.parametrize("example", ["cycloidal_records", "friction_damper_record", "robot_joint_record"])
def test_an_example_without_its_records_says_so_in_a_sentence(tmp_path: Path, example: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / f"examples/{example}.py"), "out", "--data", str(tmp_path / "none")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT,
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(
        r"This example needs measured records, which are not part of this repository: .+\.\n", done.stdout
    )
