"""The distribution: type information for type checkers, and tests that run without records outside the repository."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

import reefmu
import stiffness_model as sm
from tests.subprocesses import TIMEOUT
from tests.unit.test_docs import PAGES

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def test_the_packages_are_typed_as_the_classifier_says() -> None:
    """PEP 561: each package contains the marker, and the wheel contains the packages completely."""
    assert "Typing :: Typed" in PROJECT["project"]["classifiers"]
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel.keys() == {"packages"}
    for name in wheel["packages"]:
        assert files(importlib.import_module(name)).joinpath("py.typed").is_file(), name


@pytest.mark.skipif(shutil.which("git") is None or not (ROOT / ".git").exists(), reason="foreign host: no repository")
def test_the_wheel_contains_the_markers() -> None:
    """Hatchling skips what .gitignore names."""
    markers = [f"{name}/py.typed" for name in PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]]
    ignored = subprocess.run(["git", "check-ignore", *markers], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ignored.stdout == ""


@pytest.mark.slow
def test_tests_of_records_outside_the_repository_skip_with_their_reason(tmp_path: Path) -> None:
    """In a copy of the tree without the records beside it; in CI, where other skips fail the run, this one does not."""
    copy = tmp_path / "copy"
    tests = ("conftest.py", "subprocesses.py", "examples/test_site.py", "examples/site_links.py", "unit/test_docs.py")
    for name in ("pyproject.toml", *(f"tests/{test}" for test in tests)):
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)
    shutil.copytree(ROOT / "examples", copy / "examples")
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n", "0", "-rs", "-m", "", "-k", "play_and_friction", "tests"],
        cwd=copy,
        capture_output=True,
        text=True,
        check=False,
        timeout=TIMEOUT,
        env={**os.environ, "CI": "true", "PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 skipped" in done.stdout
    assert "not part of this repository" in done.stdout


def test_the_version_of_the_last_release_is_stated_alike() -> None:
    """In the citation, in the changelog and as the version of a copy without Git."""
    fallback = PROJECT["tool"]["hatch"]["version"]["fallback-version"]
    citation = re.search(r"(?m)^version: (.+)$", (ROOT / "CITATION.cff").read_text("utf-8"))
    released = re.search(r"(?m)^## (\d.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    assert citation is not None
    assert released is not None
    assert citation[1] == released[1] == fallback
    assert re.fullmatch(r"\d+\.\d+\.\d+", fallback), "a semantic version"


def test_commands_that_install_an_extra_work_in_a_clone() -> None:
    """The package is on no index, so that its name is no argument of pip; messages and pages name declared extras."""
    extras = PROJECT["project"]["optional-dependencies"]
    sources = [path for folder in ("stiffness_model", "reefmu", "examples") for path in (ROOT / folder).rglob("*.py")]
    pages = [page for page in PAGES if page.name != "CHANGELOG.md"]
    text = "\n".join(path.read_text("utf-8") for path in [*sources, *pages])
    assert not re.findall(r"pip install [^\n]*reefmu\[", text)
    named = re.findall(r"pip install (?:-\w )*'?\.\[(\w+)\]", text) + re.findall(r"install_command\(.(\w+).\)", text)
    assert {"native", "mujoco", "explore", "dxf", "cluster", "dataframe", "docs"} <= set(named)
    assert set(named) <= set(extras)
    install = (ROOT / "docs/start/index.md").read_text("utf-8").split("## Install")[1].split("\n## ")[0]
    assert set(re.findall(r"(?m)^\| `(\w+)` \|", install)) == set(extras), "the page explains every extra"


def test_both_packages_state_the_version_of_the_distribution() -> None:
    assert reefmu.__version__ == sm.__version__ == importlib.metadata.version("reefmu")
