"""The command line: what it prints and writes, and one line for every fault."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import reefmu
import stiffness_model as sm
from reefmu import progress as progress_module
from reefmu.cli import main
from reefmu.commands.compare import torque_steps
from reefmu.progress import CountingExecutor, Progress
from stiffness_model.ratings.efficiency import friction_losses
from stiffness_model.ratings.peak_pressure import peak_pressures
from tests.subprocesses import TIMEOUT, messages

CURVE_FILES = ["curve.csv", "curve.png", "forces.png", "load_share.png"]


def call(*args: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "reefmu", *args],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


def preset_text() -> str:
    return (Path(sm.__file__).parent / "presets" / "drive_1.toml").read_text("utf-8")


def test_help_loads_nothing_but_python_and_itself(tmp_path: Path) -> None:
    """That is what makes it quick, on any machine."""
    code = (
        "import sys; before = set(sys.modules); from reefmu.cli import build_parser; "
        "build_parser().format_help(); new = set(sys.modules) - before; "
        "print(*{name.split('.')[0] for name in new} - sys.stdlib_module_names)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.split() == ["reefmu"]
    done = call("--help", folder=tmp_path)
    assert done.returncode == 0
    assert "curve" in done.stdout
    assert "compare" in done.stdout


def test_curve_prints_a_table_and_writes_its_files(tmp_path: Path) -> None:
    done = call("curve", "drive_1", "--drives", "32", folder=tmp_path)
    assert done.returncode == 0
    # One plain note: the elements do not fit.
    assert messages(done.stderr) == [f"note: drive_1: {sm.load_drive('drive_1').seats.overlap_message()}"]
    assert sorted(path.name for path in (tmp_path / "drive_1-curve").iterdir()) == CURVE_FILES
    with (tmp_path / "drive_1-curve" / "curve.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:5] == [
        "twist [arcmin]",
        "torque_mean [N.m]",
        "torque_p10 [N.m]",
        "torque_p90 [N.m]",
        "stiffness [N.m/arcmin]",
    ]
    values = np.array(rows[1:], float)
    assert values.shape[0] == 61
    expected = sm.simulate(sm.load_drive("drive_1"), np.linspace(0, 8, 61) * sm.ARCMIN, 32).curve()
    np.testing.assert_allclose(values[:, 1], expected.torque, rtol=1e-7, atol=1e-7)
    last = done.stdout.split("8.00", 1)[1].split()
    assert float(last[0]) == pytest.approx(expected.full_torque, abs=0.01)
    for words in ("backlash", "lost motion", "carry load", "have play", "cut away", "drive_1-curve"):
        assert words in done.stdout


@pytest.mark.slow
def test_curve_tells_what_a_switch_changes_and_what_the_forces_mean(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert (
        main(
            [
                "curve",
                "drive_1",
                "--drives",
                "16",
                "--out",
                "soft",
                "--set",
                "bearing_stiffness=250 N/um",
                "--set",
                "friction_coefficient=0.05",
                "--set",
                "bearing_capacity=40 kN",
                "--set",
                "crank_speed=1500 rpm",
            ]
        )
        == 0
    )
    with Path("soft/curve.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    soft = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    expected = sm.simulate(soft, [soft.max_twist], 16)
    assert float(rows[-1]["torque_mean [N.m]"]) == pytest.approx(expected.torque.mean(), rel=1e-7)
    assert float(rows[-1]["pressure_crank [MPa]"]) == pytest.approx(
        np.percentile(peak_pressures(soft, [soft.max_twist], 16).pressure[..., 1], 90) / 1e6, rel=1e-3
    )
    assert float(rows[-1]["pressure_safety [1]"]) == pytest.approx(4200 / float(rows[-1]["pressure_crank [MPa]"]))
    assert 0.85 < float(rows[-1]["efficiency [1]"]) < 0.95
    idle = friction_losses(soft, [0.0], 16, coefficient=0.05).loss.mean() * 1e3
    assert float(rows[-1]["bearing_load [N]"]) > 2000
    assert float(rows[-1]["bearing_life [Mrev]"]) > 100
    out = capsys.readouterr().out
    for words in (
        "beyond the plain model: bearing_stiffness = 250 N/um",
        "plain model 28",
        "static safety 1.0",
        "stays above 1 up to",
        "efficiency 91",
        f"no-load torque at the crank {idle:.1f} mN.m",
        "P = 3.",
        "no rating life",
    ):
        assert words in out


@pytest.mark.slow
def test_curve_names_the_contacts_without_a_limit_and_a_limit_already_passed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["curve", "drive_3", "--drives", "16"]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("static safety"))
    assert re.search(
        r"at the crank \(limit 4200 MPa\).*no limit known at the gear, 3\d\d MPa.*at the cage, \d+ MPa", line
    )
    assert main(["curve", "drive_2", "--drives", "16", "--set", "gear_offset=-40 um"]) == 0
    assert "is 1 or below already at" in capsys.readouterr().out


@pytest.mark.slow
def test_compare_prints_and_writes_the_published_gears(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        '[[gear]]\nmaker = "Own"\ntype = "X1"\nsource = "own rig"\nstiffness = "50 N.m/arcmin"\n'
        'rated_torque = "120 N.m"\n'
    )
    done = call("compare", "drive_1", "--drives", "32", "--catalog", "own.toml", "--out", "here/below", folder=tmp_path)
    assert done.returncode == 0
    assert sorted(path.name for path in (tmp_path / "here" / "below").iterdir()) == ["compare.csv", "compare.png"]
    with (tmp_path / "here" / "below" / "compare.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[:3] == ["torque [N.m]", "drive_1 twist [arcmin]", "Harmonic Drive CHA-40A (ratio 50) twist [arcmin]"]
    assert head[-1] == "Own X1 twist [arcmin]"
    by_torque = {float(row[0]): row for row in rows}
    assert float(by_torque[100.0][-1]) == pytest.approx(2.0)
    assert by_torque[150.0][-1] == ""  # above what its row allows
    drive = sm.simulate(sm.load_drive("drive_1"), np.linspace(0, 8, 61) * sm.ARCMIN, 32).curve()
    assert float(by_torque[100.0][1]) == pytest.approx(float(drive.twist_at(100.0)) / sm.ARCMIN, rel=1e-6)
    for words in ("RV-42N", "quoted at second hand", "F1C-A25", "not found", "Own X1"):
        assert words in done.stdout


def test_a_drawing_and_fields_set_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(preset_text(), "utf-8")
    assert (
        main(
            ["curve", "mine.toml", "--drives", "4", "--seed", "7", "--set", "lobes=28", "--set", "crank_radius=40.5 mm"]
        )
        == 0
    )
    values = np.loadtxt("mine-curve/curve.csv", delimiter=",", skiprows=1)
    drive = sm.load_drive("drive_1", lobes=28, crank_radius="40.5 mm")
    expected = sm.simulate(drive, np.linspace(0, 8, 61) * sm.ARCMIN, 4, seed=7).curve()
    np.testing.assert_allclose(values[:, 1], expected.torque, rtol=1e-7, atol=1e-7)
    assert "seed 7" in capsys.readouterr().out


FAULTY_CALLS = [
    ([], "the following arguments are required: COMMAND"),
    (["curv", "drive_1"], "invalid choice: 'curv'"),
    (["curve"], "the following arguments are required: DRIVE"),
    (["curve", "drive_1", "--drivers", "3"], "unrecognized arguments: --drivers"),
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


@pytest.mark.parametrize(("args", "words"), FAULTY_CALLS, ids=[" ".join(args) or "nothing" for args, _ in FAULTY_CALLS])
def test_a_faulty_call_is_one_line_and_status_2(
    args: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("a file, not a folder")
    try:
        status = main([*args, *(["--drives", "4"] if "drive_1" in args and "--drives" not in args else [])])
    except SystemExit as leaving:
        status = leaving.code
    assert status == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("reefmu: ")
    assert words in err
    assert len(err.splitlines()) == 1
    assert os.listdir() == ["taken"]


FAULTY_DRAWINGS = [
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
@pytest.mark.parametrize(("spoil", "words"), FAULTY_DRAWINGS)
def test_a_faulty_drawing_is_one_line_and_status_2(
    command: str,
    spoil: object,
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert callable(spoil)
    Path("mine.toml").write_text(spoil(preset_text()), "utf-8")
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
def test_no_traceback_from_the_real_program(args: list[str], tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    done = call(*args, folder=tmp_path)
    assert done.returncode == 2
    assert len(messages(done.stderr)) == 1
    assert messages(done.stderr)[0].startswith("reefmu: ")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_fault_while_writing_leaves_the_folder_as_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from stiffness_model.plotting import curves as plots

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(plots, "save", full)
    monkeypatch.chdir(tmp_path)
    assert main(["curve", "drive_1", "--drives", "4"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "reefmu: [Errno 28] No space left on device\n"
    assert os.listdir() == []


def test_a_fault_of_the_program_is_not_hidden(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from reefmu.commands import study

    def broken(*_: object) -> None:
        raise ValueError("a bug")

    monkeypatch.setattr(study, "run_population", broken)
    with pytest.raises(ValueError, match="a bug"):
        main(["curve", "drive_1", "--out", str(tmp_path / "new")])
    assert os.listdir(tmp_path) == []


def test_an_interrupt_is_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from reefmu.commands import study

    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(study, "run_population", stopped)
    assert main(["curve", "drive_1", "--out", str(tmp_path / "new")]) == 130
    assert capsys.readouterr().err == "reefmu: interrupted\n"
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="pipes close otherwise there")
def test_a_reader_that_leaves_is_no_fault(tmp_path: Path) -> None:
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
    assert [line.split()[0] for line in messages(err)] == ["note:"]


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leaving:
        main(["--version"])
    assert leaving.value.code == 0
    assert capsys.readouterr().out == f"reefmu {reefmu.__version__}\n"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        reefmu.nothing  # noqa: B018


class Screen:
    """A stream that may say it is a terminal."""

    def __init__(self, terminal: bool) -> None:
        self.text, self._terminal = "", terminal

    def isatty(self) -> bool:
        return self._terminal

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        pass


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_rewrites_its_line_on_a_terminal_only(terminal: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(0, 1000, 10))
    monkeypatch.setattr(progress_module, "clock", lambda: float(next(clock)))
    screen = Screen(terminal)
    with Progress("counting", 4, screen) as progress:  # type: ignore[arg-type]
        for _ in range(4):
            progress.step()
    if terminal:
        assert "\n" not in screen.text
        assert screen.text.split("\r")[1].startswith("counting: 25 %")
        assert screen.text.endswith("\r\033[K")  # leaves nothing behind
    else:
        assert screen.text.splitlines() == [f"counting: {percent} %" for percent in (25, 50, 75, 100)]


def test_short_work_is_silent_in_a_log(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(100))
    monkeypatch.setattr(progress_module, "clock", lambda: float(next(clock)))
    screen = Screen(terminal=False)
    with Progress("counting", 2, screen) as progress:  # type: ignore[arg-type]
        progress.step()
        progress.step()
    assert screen.text == ""


def test_the_counting_executor_is_an_executor() -> None:
    with CountingExecutor("adding") as executor:
        assert list(executor.map(pow, [2, 3], [3, 2])) == [8, 9]
        assert executor.submit(pow, 2, 5).result() == 32
        with pytest.raises(ZeroDivisionError):
            executor.submit(lambda: 1 / 0).result()


@pytest.mark.parametrize("greatest", [0.04, 0.8, 1.0, 7.9, 8.0, 12.7, 281.3, 357.0, 1e4, 99999.0])
def test_torque_steps_are_few_and_round(greatest: float) -> None:
    steps = torque_steps(greatest)
    assert 3 <= len(steps) <= 8
    assert steps[-1] <= greatest * (1 + 1e-9)
    assert steps[-1] > 0.6 * greatest
    assert all(float(f"{step:.2g}") == step for step in steps)
    np.testing.assert_allclose(np.diff(steps), steps[0])


@pytest.mark.slow
def test_elements_larger_than_their_bores_are_counted_once_and_the_remedy_told(tmp_path, capsys):
    def told(offset: str) -> str:
        assert (
            main(["curve", "drive_1", "--drives", "16", "--set", f"cage_offset={offset}", "--out", str(tmp_path)]) == 0
        )
        return capsys.readouterr().out

    # 16 drives of 87 elements at 61 twists: of 1392 elements half, not of 84 912 cases.
    tight = re.search(r"(\d+) elements \((\d+) %\) are larger than their bores", told("0 um"))
    assert tight is not None
    assert 600 < int(tight[1]) < 800
    assert "1.26 um above nominal (cage_offset, or a fit)" in told("0 um")
    assert "cage_offset, or a fit" not in told("3 sigma")
