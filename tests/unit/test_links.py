"""Links, anchors and paths of the documentation resolve."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
PLACES = "stiffness_model|reefmu|tests|examples|docs"


def anchors(page: Path) -> set[str]:
    """Anchors of the headings, as code hosts make them."""
    headings = re.findall(r"(?m)^#+ (.+)$", page.read_text("utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_resolve(page: Path) -> None:
    broken: list[str] = []
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        linked = (page.parent / path) if path else page
        if not linked.exists() or (anchor and anchor not in anchors(linked)):
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=lambda page: page.name)
def test_files_and_modules_in_the_text_exist(page: Path) -> None:
    """Paths such as `docs/curve.png` and dotted names such as `reefmu.simulate`."""
    words = re.findall(r"`([^`\s]+)`", page.read_text("utf-8"))
    paths = [word for word in words if re.fullmatch(rf"(?:{PLACES})(?:/[\w.]+)+", word)]
    modules = [word for word in words if re.fullmatch(r"(?:stiffness_model|reefmu)(?:\.\w+)+", word)]
    assert [path for path in paths if not (ROOT / path).exists()] == []
    assert [name for name in modules if not exists(name)] == []


def exists(dotted_name: str) -> bool:
    """Whether the name, or the name without its last part (a function or class), is a module or package."""
    folders = [ROOT.joinpath(*parts) for parts in (dotted_name.split("."), dotted_name.split(".")[:-1])]
    return any(path.is_dir() or path.with_suffix(".py").is_file() for path in folders)
