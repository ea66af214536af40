"""Options that commands have in common: how much they say on stderr, results as JSON, the format of pictures."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from reefmu import commands
from reefmu.cli import build_parser, main
from reefmu.commands.drawings import curve as curve_command
from reefmu.progress import Progress

GEAR = "CHA-40A-50"
STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.fixture
def _slow_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress of a long simulation, on the stderr of a log file."""
    real, now = curve_command.run_population, iter(range(0, 1000, 10))
    monkeypatch.setattr("reefmu.progress.clock", lambda: float(next(now)))

    def simulate(*args: object) -> object:
        with Progress("working", 2) as progress:
            progress.step()
        return real(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(curve_command, "run_population", simulate)


@pytest.mark.usefixtures("_slow_simulation")
@pytest.mark.parametrize(
    ("before", "after", "starts"),
    [
        (["-q"], [], set()),
        ([], ["--quiet"], set()),
        ([], [], {"working", "note"}),
        ([], ["-v"], {"working", "note", "detail"}),
    ],
)
def test_verbosity(
    before: list[str], after: list[str], starts: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*before, "curve", GEAR, "--out", str(tmp_path / "out"), *after]) == 0
    shown = capsys.readouterr()
    assert "k1" in shown.out
    found = {line.split(":")[0] for line in shown.err.splitlines()}
    assert {name for name in found if not name.startswith("simulating")} == starts


def test_a_quiet_command_still_says_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-q", "curve", "drive_9"]) == 2
    assert "did you mean" in capsys.readouterr().err
    with pytest.raises(SystemExit) as stop:
        main(["curve", GEAR, "-q", "-v"])
    assert stop.value.code == 2
    assert "not allowed with argument" in capsys.readouterr().err


@pytest.mark.parametrize("drive", [GEAR, pytest.param("workshop", marks=pytest.mark.slow)])
def test_the_curve_as_json_is_that_of_the_file(drive: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With null for numbers that JSON does not have."""
    out = tmp_path / "out"
    assert main(["curve", drive, "--drives", "4", "--seed", "3", "--out", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    population = (found["name"], found["drives"], found["seed"])
    assert population == ((GEAR, None, None) if drive == GEAR else ("workshop", 4, 3))
    assert sorted(path.name for path in out.iterdir()) == sorted(found["files"])
    with (out / "curve.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert list(found["columns"]) == head
    written = np.array(rows, float)
    read = np.array(list(found["columns"].values()), float).T
    assert read == pytest.approx(np.where(np.isfinite(written), written, np.nan), rel=1e-8, abs=1e-12, nan_ok=True)
    assert found["full_torque [N.m]"] == pytest.approx(written[-1, 1], rel=1e-8)
    assert found["max_twist [arcmin]"] == pytest.approx(written[-1, 0], rel=1e-8)


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
@pytest.mark.parametrize("command", ["curve", "compare"])
def test_pictures_have_the_format_that_is_asked_for(command: str, suffix: str, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    assert main([command, GEAR, "--out", str(out), "--format", suffix]) == 0
    assert f"{command}.csv, {command}.{suffix}" in capsys.readouterr().out
    assert sorted(path.name for path in out.iterdir()) == sorted([f"{command}.csv", f"{command}.{suffix}"])
    assert (out / f"{command}.{suffix}").read_bytes().startswith(STARTS[suffix])


@pytest.mark.slow
def test_the_pictures_of_draw_have_the_format_that_is_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["draw", "workshop", "--out", str(out), "--format", "svg"]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["drive.svg", "forces.svg"]
    assert all(path.read_bytes().startswith(STARTS["svg"]) for path in out.iterdir())


def test_no_command_fixes_the_format_of_a_picture() -> None:
    for path in Path(commands.__file__).parent.rglob("*.py"):
        assert ".png" not in path.read_text("utf-8"), path


@pytest.mark.parametrize("command", ["demo", "curve", "compare", "draw", "explore"])
def test_every_command_with_pictures_takes_their_format(command: str) -> None:
    given = {"demo": [], "explore": ["tolerance_field", "--out", "o"]}.get(command, ["drive_1"])
    assert build_parser().parse_args([command, *given, "--format", "pdf"]).format == "pdf"
