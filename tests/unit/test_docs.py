"""README and docs refer to files, headings and modules that exist."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GENERATED = ("docs/_build", "docs/gallery", "docs/reference/effects")
"""Folders that a build of the site writes (.gitignore)."""
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(
    page
    for page in (ROOT / "docs").rglob("*.md")
    if not page.relative_to(ROOT).as_posix().startswith(tuple(f"{folder}/" for folder in GENERATED))
)
NAMES = [page.relative_to(ROOT).as_posix() for page in PAGES]
MAX_LINE = 120


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub and GitLab make them."""
    heads = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_resolve(page: Path) -> None:
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text("utf-8")):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.exists(), target
        if anchor:
            assert anchor in anchors(file), target


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=lambda page: page.name)
def test_paths_and_modules_exist(page: Path) -> None:
    """The changelog is left out, because it also names earlier layouts; what commands write is in .gitignore."""
    text = page.read_text("utf-8")
    written = {line.rstrip("/") for line in (ROOT / ".gitignore").read_text("utf-8").splitlines()}
    for path in re.findall(r"(?<![\w/.])(?:stiffness_model|reefmu|tests|examples|docs)/[\w/.]*\w", text):
        assert path in written or (ROOT / path).exists(), path
    for name in re.findall(r"`((?:stiffness_model|reefmu)(?:\.[a-z_0-9]+)+)`", text):
        package, _, last = name.rpartition(".")
        assert importlib.util.find_spec(package) is not None, name
        module = importlib.import_module(package)
        assert hasattr(module, last) or importlib.util.find_spec(name) is not None, name


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_lines_are_no_longer_than_code(page: Path) -> None:
    """Except rows of tables and indented equations, which cannot be broken."""
    lines = page.read_text("utf-8").splitlines()
    assert [line for line in lines if len(line) > MAX_LINE and not line.startswith(("|", "    "))] == []


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_no_line_begins_with_a_percent_sign(page: Path) -> None:
    """The site takes such a line for a comment and leaves it out."""
    assert [line for line in page.read_text("utf-8").splitlines() if line.lstrip().startswith("%")] == []
