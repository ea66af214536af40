"""`reefmu demo` from drawing to joint, with a lookup from few drives."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

import stiffness_model as sm
from reefmu.cli import main
from reefmu.commands import demo
from reefmu.model.drive_model import build_model
from stiffness_model.lookup.build_lookup import Lookup, build_lookup

pytestmark = pytest.mark.slow

FILES = {
    "1-gear.png",
    "2-compare.png",
    "2-curve.png",
    "2-forces.png",
    "5-design.png",
    "5-joint.png",
    "curve.csv",
    "workshop.fmu",
}


@pytest.fixture(scope="module")
def lookup() -> Lookup:
    """The lookup of the demo's drive, with a band from few drives."""
    return build_lookup(sm.load_drive(demo.DRIVE), n_drives=16)


@pytest.fixture
def _few_drives(monkeypatch: pytest.MonkeyPatch, lookup: Lookup) -> None:
    def quick(drive: object, effects: object = None, **_: object) -> object:
        return partial(build_model, lookup=lookup)(drive, effects)  # type: ignore[arg-type]

    monkeypatch.setattr(demo, "build_model", quick)
    monkeypatch.setattr(demo, "DRIVES", 64)


@pytest.mark.usefixtures("_few_drives")
def test_demo_takes_all_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    assert main(["demo", "--out", str(folder)]) == 0
    assert {path.name for path in folder.iterdir()} == FILES
    assert all(path.stat().st_size > 1000 for path in folder.iterdir())
    printed = capsys.readouterr().out
    for part in ("1  The drawing", "2  64 virtual drives", "3  The lookup", "4  The FMU", "5  A robot joint"):
        assert part in printed
    assert "FAIL" not in printed


@pytest.mark.usefixtures("_few_drives")
def test_a_failed_demo_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("a file")
    assert main(["demo", "--out", str(tmp_path / "file")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1

    def broken(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(demo, "_joint", broken)
    assert main(["demo", "--out", str(tmp_path / "new")]) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
