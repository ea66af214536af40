"""The program: help, version, and one line for every error."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import reefmu
from reefmu.cli import main
from tests.integration.commands.program import preset_text, run_program
from tests.subprocesses import TIMEOUT, messages


def test_help_loads_no_other_package_and_none_of_the_rooms(tmp_path: Path) -> None:
    """This keeps `reefmu --help` quick on any machine."""
    code = (
        "import sys; before = set(sys.modules); from reefmu.cli import build_parser; "
        "build_parser().format_help(); print(*set(sys.modules) - before)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    own = [name for name in loaded if name.split(".")[0] not in sys.stdlib_module_names]
    packages = {".".join(name.split(".")[:2]) for name in own}
    assert packages == {"reefmu", "reefmu.cli", "stiffness_model", "stiffness_model.lazy_names"}
    assert not {"dataclasses", "inspect", "reefmu.cli.completion"} & set(loaded)
    done = run_program("--help", folder=tmp_path)
    assert done.returncode == 0
    for command in ("demo", "curve", "compare", "export", "check", "diagnose", "plan", "draw", "explore"):
        assert command in done.stdout


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"reefmu {reefmu.__version__}\n"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        reefmu.nothing  # noqa: B018


WRONG_CALLS = [
    (["curv", "drive_1"], "unknown command 'curv'; did you mean curve?"),
    (["-q", "xyz"], "unknown command 'xyz'; expected one of demo, new"),
    (["--jsn"], "unrecognized arguments: --jsn"),
    (["curve"], "the following arguments are required: DRIVE"),
    (["plan", "drive_1", "--minutes", "ten", "--out", "o"], "expected a number of minutes, got 'ten'"),
    (["plan", "drive_1", "--effects", "creep,,wear", "--out", "o"], "expected names separated by commas"),
    (["curve", "drive_1", "--drivers", "3"], "unrecognized arguments: --drivers 3; did you mean --drives?"),
    (["curve", "drive_1", "--formt=svg"], "did you mean --format?"),
    (["curve", "drive_1", "drive_2"], "unrecognized arguments: drive_2"),
    (["curve", "drive_1", "--drives", "0"], "argument --drives: expected a whole number from 1 to"),
    (["curve", "drive_1", "--drives", "many"], "got 'many'"),
    (["curve", "drive_1", "--drives", "1e3"], "got '1e3'"),
    (["curve", "drive_1", "--seed", "-1"], "argument --seed: expected a whole number of at least 0, got '-1'"),
    (["curve", "drive_1", "--set", "lobes"], "argument --set: expected FIELD=VALUE, such as lobes=28, got 'lobes'"),
    (["curve", "drive_1", "--set", "=28"], "expected FIELD=VALUE"),
    (["curve", "drive_1", "--set", "lobe=28"], "unknown field 'lobe'; did you mean 'lobes'?"),
    (["curve", "drive_1", "--set", "lobes=29"], "expected transmission_ratio - 1 = 28 lobes"),
    (["curve", "drive_1", "--set", "lobes=many"], "expected a whole number of at least 1, got 'many'"),
    (["curve", "drive_1", "--set", "transmission_ratio=40"], "expected transmission_ratio - 1 = 39 lobes"),
    (["curve", "drive_1", "--set", "transmission_ratio=nan"], "transmission_ratio: expected"),
    (["curve", "drive_1", "--set", "crank_radius=41"], "expected a length with its unit, such as '1 mm', got '41'"),
    (["curve", "drive_1", "--set", "crank_radius=41 mn"], "unknown unit of length 'mn'"),
    (["curve", "drive_1", "--set", "crank_radius=-41 mm"], "crank_radius: expected a positive length"),
    (["curve", "drive_1", "--set", "crank_radius=nan mm"], "crank_radius: expected a length"),
    (["curve", "drive_1", "--set", "element_radius=60 mm"], "expected an element smaller than its path"),
    (["curve", "drive_1", "--set", "gear_tolerance=IT99"], "expected an ISO 286 grade"),
    (["curve", "drive_1", "--set", "gear_offset=1 mm"], "expected a max_twist at which the drive carries torque"),
    (["curve", "drive_9"], "unknown drive 'drive_9'; did you mean 'drive_"),
    (["curve", "nothing.toml"], "nothing.toml: expected a TOML drawing, got no such file"),
    (["curve", "drive_1", "--out", "taken"], "taken: expected a folder that can be written"),
    (["compare", "drive_1", "--out", "taken/below"], "taken/below: expected a folder that can be written"),
    (["curve", "drive_1", "--out", ""], "curve: argument --out: expected a name, got ''"),
    (["compare", "drive_1", "--out", " "], "compare: argument --out: expected a name, got ' '"),
    (["draw", "drive_1", "--out", ""], "draw: argument --out: expected a name, got ''"),
    (["demo", "--out", ""], "demo: argument --out: expected a name, got ''"),
    (["export", "drive_1", "-o", ""], "export: argument -o/--output: expected a name, got ''"),
    (["diagnose", "taken", "--power-law", "--out", ""], "diagnose: argument --out: expected a name, got ''"),
    (["compare", "drive_1", "--catalog", "nothing.toml"], "nothing.toml: expected a readable TOML catalogue"),
    (["compare", "drive_1", "--catalog", "taken"], "taken: expected a TOML catalogue, got a syntax error"),
]


@pytest.mark.parametrize(("args", "words"), WRONG_CALLS, ids=[" ".join(args) or "nothing" for args, _ in WRONG_CALLS])
def test_a_wrong_call_is_one_line_and_status_2(
    args: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("a file, not a folder")
    try:
        status = main([*args, *(["--drives", "4"] if "drive_1" in args and "--drives" not in args else [])])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("reefmu: ")
    assert words in err
    assert len(err.splitlines()) == 1
    assert os.listdir() == ["taken"]


WRONG_DRAWINGS = [
    (lambda text: text + "\n[geometri]\n", "unknown section or field 'geometri'; did you mean 'geometry'?"),
    (lambda text: text.replace("lobes =", "lobs ="), "unknown field 'lobs'; did you mean 'lobes'?"),
    (lambda text: text.replace('"41 mm"', "41"), "expected a length with its unit, such as '41 mm', got 41"),
    (lambda text: text.replace('"41 mm"', '"41"'), "expected a length with its unit"),
    (lambda text: text.replace('"41 mm"', "nan"), "crank_radius: expected a value, got nan"),
    (lambda text: text.replace('"41 mm"', '"-41 mm"'), "crank_radius: expected a positive length"),
    (lambda text: text.replace('"7 mm"', '"70 mm"'), "expected an element smaller than its path"),
    (lambda text: text.replace("ratio = 29", "ratio = 35"), "lobes: expected transmission_ratio - 1 = 34"),
    (lambda text: text.replace("ratio = 29", "ratio = nan"), "transmission_ratio: expected a value, got nan"),
    (lambda text: text.replace("elements = 87", "elements = 86"), "expected a multiple of the 3 eccentrics, got 86"),
    (lambda text: text.replace("elements = 87", ""), "expected the field 'elements'"),
    (lambda text: text[:200], "expected"),
    (lambda text: "not TOML", "expected a TOML drawing, got a syntax error"),
]


@pytest.mark.parametrize("command", ["curve", "compare"])
@pytest.mark.parametrize(("change", "words"), WRONG_DRAWINGS)
def test_a_wrong_drawing_is_one_line_and_status_2(
    command: str,
    change: object,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert callable(change)
    Path("mine.toml").write_text(change(preset_text()), "utf-8")
    assert main([command, "mine.toml", "--drives", "4"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("reefmu: mine.toml")
    assert words in err
    assert len(err.splitlines()) == 1
    assert os.listdir() == ["mine.toml"]


@pytest.mark.parametrize(
    "args",
    [
        ["curve", "drive_1", "--set", "crank_radius=41"],
        ["compare", "drive_1", "--out", "taken"],
        ["curve"],
    ],
)
def test_the_program_prints_no_traceback(args: list[str], tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    done = run_program(*args, folder=tmp_path)
    assert done.returncode == 2
    assert len(messages(done.stderr)) == 1
    assert messages(done.stderr)[0].startswith("reefmu: ")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_full_disk_leaves_the_folder_unchanged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from stiffness_model.plotting import curves as plots

    def no_space(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(plots, "save", no_space)
    monkeypatch.chdir(tmp_path)
    assert main(["curve", "drive_1", "--drives", "4"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "reefmu: [Errno 28] No space left on device\n"
    assert os.listdir() == []


def test_an_error_of_the_program_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from reefmu.commands.drawings import curve

    def fail(*_: object) -> None:
        raise ValueError("a bug")

    monkeypatch.setattr(curve, "run_population", fail)
    with pytest.raises(ValueError, match="a bug"):
        main(["curve", "drive_1", "--out", str(tmp_path / "new")])
    assert os.listdir(tmp_path) == []


def test_an_interrupt_is_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from reefmu.commands.drawings import curve

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(curve, "run_population", interrupt)
    assert main(["curve", "drive_1", "--out", str(tmp_path / "new")]) == 130
    assert capsys.readouterr().err == "reefmu: interrupted\n"
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="pipes close otherwise there")
def test_a_closed_standard_output_is_no_error(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "reefmu", "compare", "drive_1", "--drives", "4"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        err = process.stderr.read()
        assert process.wait(timeout=TIMEOUT) == 0
    assert [line.split()[0] for line in messages(err)] == ["warning:"]
