"""`reefmu diagnose`: one record and several, and what is wrong in one line."""

from __future__ import annotations

import contextlib
import gzip
import io
import json
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.preprocessing.audit import audit
from reefmu.diagnosis.shared_exponent import PLAY
from reefmu.progress import Progress
from reefmu.record import Record, make_record
from stiffness_model.errors import InputError
from tests import diagnosis_rig as rig


def write(record: Record, path: Path) -> Path:
    columns = {
        "time [s]": record.time,
        "run": record.run,
        "crank_angle [rad]": record.crank_angle,
        "output_angle [rad]": record.output_angle,
        "output_torque [N.m]": record.output_torque,
        "temperature [degC]": record.temperature,
    }
    table = np.stack([np.asarray(v, float) for v in columns.values()], axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
    return path


@pytest.mark.slow
def test_several_records_give_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tight = write(rig.measured({"hysteresis": {"torque": 4.0}}, seed=6), tmp_path / "tight.csv")
    loose = write(
        rig.measured({"hysteresis": {"torque": 4.0}, "backlash": {"clearance": 4e-6}}, seed=7), tmp_path / "loose.csv"
    )
    assert main(["diagnose", str(tight), str(loose), "--drive", "drive_1", "--out", str(tmp_path / "out")]) == 0
    found = {name: json.loads((tmp_path / "out" / name / "diagnosis.json").read_text()) for name in ("tight", "loose")}
    assert [e["name"] for e in found["tight"]["effects"]] == ["hysteresis"]
    assert {e["name"] for e in found["loose"]["effects"]} == {"hysteresis", "backlash"}
    said = capsys.readouterr().out
    head = next(line for line in said.splitlines() if line.split()[:2] == ["record", "verdict"])
    assert head.split() == ["record", "verdict", "backlash", "hysteresis", "remainder"]
    row = next(line for line in said.splitlines() if line.split()[:2] == ["tight", "named"])
    assert row.split()[2] == "-"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.csv", "--drive", "drive_1"], "none.csv: expected a readable CSV file"),
        (["bad.csv", "--drive", "drive_1"], "bad.csv: expected a column 'output_torque'"),
        (["bad.csv", "--drive", "drive_9"], "unknown drive 'drive_9'"),
        (["bad.csv"], "one of the arguments --drive --curve --power-law is required"),
        (["bad.csv", "--power-law", "--columns", "none.toml"], "none.toml: expected a column map"),
        (["bad.csv", "bad.csv.gz", "--power-law"], "expected records with different names"),
    ],
)
def test_wrong_input_gives_one_line_and_no_files(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.csv").write_text("time [s],twist [rad]\n0,0\n1,1\n")
    with pytest.raises(SystemExit) if "required" in message else contextlib.nullcontext():
        assert main(["diagnose", *arguments, "--out", "out"]) == 2
    error = capsys.readouterr().err.splitlines()
    assert len(error) == 1
    assert message in error[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_curve_file_replaces_the_drawing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ratio then follows from the angles of crank and output."""
    assert main(["curve", "drive_1", "--drives", "200", "--out", str(tmp_path / "curve")]) == 0
    record = write(rig.measured({"hysteresis": {"torque": 6.0}}, seed=8), tmp_path / "record.csv")
    curve = tmp_path / "curve" / "curve.csv"
    assert main(["diagnose", str(record), "--curve", str(curve), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] in ("named", "partly")
    assert "hysteresis" in [e["name"] for e in found["effects"]]
    size = next(e for e in found["effects"] if e["name"] == "hysteresis")["parameters"]["torque"]["value"]
    assert size == pytest.approx(6.0, rel=0.1)
    capsys.readouterr()


def test_angles_without_a_ratio_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(0)
    table = np.stack([np.arange(400.0), rng.uniform(0, 6, 400), rng.uniform(0, 0.1, 400), rng.normal(size=400)], axis=1)
    np.savetxt(
        tmp_path / "record.csv",
        table,
        delimiter=",",
        comments="",
        header="time [s],crank_angle [rad],output_angle [rad],output_torque [N.m]",
    )
    assert main(["diagnose", str(tmp_path / "record.csv"), "--power-law", "--out", str(tmp_path / "out")]) == 2
    assert "show no transmission ratio" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def lines(n: int = 400) -> list[str]:
    """Rows of a good record: time, run, twist, torque."""
    t = np.arange(n) * 0.01
    twist, torque = 5 * np.sin(t), 150 * np.sin(t) + 10 * np.sign(np.cos(t))
    return [f"{a:.4f},0,{b:.6f},{c:.4f}" for a, b, c in zip(t, twist, torque, strict=True)]


HEAD = "time [s],run,twist [arcmin],output_torque [N.m]"


def with_line(number: int, text: str) -> str:
    rows = lines()
    rows[number] = text
    return "\n".join([HEAD, *rows])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("nan.csv", with_line(7, "0.07,0,nan,3"), "expected finite numbers in column 'twist', got nan in data row 8"),
        ("empty_cell.csv", with_line(7, "0.07,0,,3"), "expected numbers in column 'twist [arcmin]'"),
        ("backwards.csv", with_line(7, "0.01,0,1,3"), "a step back at data row 8"),
        ("unit.csv", "\n".join([HEAD.replace("N.m", "N"), *lines()]), "expected a unit of output_torque such as [N.m]"),
        ("no_unit.csv", "\n".join([HEAD.replace(" [arcmin]", ""), *lines()]), "expected a unit in the header"),
        ("column.csv", "time [s]\n0\n1\n2", "expected a column 'output_torque'"),
        ("unknown.csv", "\n".join([HEAD.replace("twist", "twits"), *lines()]), "did you mean 'twist'"),
        ("short.csv", with_line(7, "0.07,0,1"), "expected 4 values in every row, got 3 in line 9"),
        ("empty.csv", "", "expected a header and at least two rows"),
        ("head.csv", HEAD, "expected a header and at least two rows"),
        ("text.csv", with_line(7, "0.07,0,one,3"), "expected numbers in column"),
        ("half_run.csv", with_line(7, "0.07,0.5,1,3"), "expected whole numbers in column 'run'"),
        ("twice.csv", "\n".join([HEAD.replace("run", "time [s]"), *lines()]), "expected each column once"),
        ("cut.csv.gz", gzip.compress("\n".join([HEAD, *lines()]).encode())[:900], "expected a readable CSV file"),
        ("no.csv.gz", b"\x1f\x8b broken", "expected a readable CSV file"),
        ("damaged.csv.gz", b"\x1f\x8b\x08\x00" + bytes(range(200)), "expected a readable CSV file"),
        ("binary.csv", bytes(range(256)) * 10, "expected a readable CSV file"),
    ],
)
def test_an_invalid_record_gives_one_line_and_no_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | bytes, message: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    assert main(["diagnose", str(path), "--power-law", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 1
    assert name in said.err
    assert message in said.err
    assert said.out == ""
    assert not (tmp_path / "out").exists()


def test_a_twist_of_wrong_sign_is_insufficient(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The file is a valid record, but not of a drive: a verdict with a report, not an error."""
    rows = [",".join([a, b, str(-float(c)), d]) for a, b, c, d in (row.split(",") for row in lines())]
    (tmp_path / "turned.csv").write_text("\n".join([HEAD, *rows]))
    assert main(["diagnose", str(tmp_path / "turned.csv"), "--power-law", "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "insufficient"
    assert "wrong sign" in found["sentence"]
    assert "insufficient" in capsys.readouterr().out
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["diagnosis.json", "report.html"]


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ((1e-300, 1, 1), "the time does not advance within the runs by steps above 1e-09 s"),
        ((1, 1e-300, 1), "the twist never changes by more than 1.5e-09 rad"),
        ((1, 1e-12, 1), "the twist never changes by more than 1.5e-09 rad"),
        ((1, 1e6, 1), "that of a gear no more than 1"),
        ((1, 1, 1e-300), "the torque never changes by more than 1e-09 N.m"),
        ((1, 1, 0), "the torque never changes by more than 1e-09 N.m"),
        ((1, 0, 0), "the twist never changes"),
    ],
)
@pytest.mark.parametrize(
    "options", [["--power-law"], ["--power-law", "--exponent", "shared"], ["--curve", "curve.csv"]]
)
def test_a_record_without_information_is_insufficient(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    factors: tuple[float, float, float],
    words: str,
    options: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = [[float(x) for x in row.split(",")] for row in lines()]
    Path("record.csv").write_text(
        "\n".join([HEAD, *(f"{t * factors[0]},0,{w * factors[1]},{y * factors[2]}" for t, _, w, y in rows)])
    )
    Path("curve.csv").write_text("twist [arcmin],torque [N.m]\n0,0\n1,20\n3,90\n6,200\n")
    assert main(["diagnose", "record.csv", *options, "--out", "out"]) == 0
    found = json.loads(Path("out/diagnosis.json").read_text())
    assert found["verdict"] == "insufficient"
    assert words in found["sentence"]
    assert capsys.readouterr().err == ""


def test_rounding_errors_are_no_torque() -> None:
    torque = 1e8 + 1e-8 * (np.arange(400) % 5)
    record = make_record(
        {"time": 0.01 * np.arange(400), "twist": 1e-3 * np.sin(0.1 * np.arange(400)), "output_torque": torque}
    )
    assert np.ptp(torque) > 0
    assert any("the torque never changes" in defect for defect in audit(record, 1.0).defects)


@pytest.mark.parametrize(
    "output", [np.zeros(400), np.full(400, 0.3), 0.3 + 1e-6 * np.random.default_rng(0).standard_normal(400)]
)
def test_a_measured_crank_at_a_locked_output_shows_no_ratio(output: np.ndarray) -> None:
    wave = np.sin(0.1 * np.arange(400))
    record = make_record(
        {"time": 0.01 * np.arange(400), "crank_angle": 0.03 * wave, "output_angle": output, "output_torque": 100 * wave}
    )
    with pytest.raises(InputError, match=r"or a twist \[rad\] in place of the angles"):
        diagnose_record(record)


def test_a_locked_crank_may_show_the_noise_of_its_encoder() -> None:
    wave, noise = np.sin(0.1 * np.arange(400)), np.random.default_rng(1).standard_normal((2, 400))
    columns = {"time": 0.01 * np.arange(400), "output_angle": -5e-3 * wave, "output_torque": 100 * wave + noise[0]}
    steady, noisy = (
        diagnose_record(make_record({**columns, "crank_angle": crank}))
        for crank in (np.full(400, 0.3), 0.3 + 1e-7 * noise[1])
    )
    assert (noisy.verdict, noisy.effects) == (steady.verdict, steady.effects) == ("none", ())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--exponent", "1.5", "--drive", "drive_1"], "--exponent: expected --exponent with --power-law only"),
        (["--exponent", "hertz", "--power-law"], "--exponent: expected a number or 'shared', got 'hertz'"),
        (["--exponent", "9", "--power-law"], "exponent: expected an exponent within 0.3 ... 6"),
        (["--locked", "output", "--power-law"], "expected a record of a twist without a crank angle"),
    ],
)
def test_invalid_options_give_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    angles = HEAD.replace("twist", "output_angle").replace("run", "crank_angle [deg]")
    head = angles if "--locked" in arguments else HEAD
    (tmp_path / "record.csv").write_text("\n".join([head, *lines()]))
    assert main(["diagnose", str(tmp_path / "record.csv"), *arguments, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert message in said[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_locked_output_has_no_friction_of_its_own(tmp_path: Path) -> None:
    """With a locked output only friction inside the drive is possible. The time stamps jitter and repeat, and the
    sampling rates of the runs differ."""
    rng = np.random.default_rng(3)
    n, parts = 300, []
    for run, step in enumerate((0.01, 0.037, 0.01)):
        k = np.arange(n)
        twist = 5e-3 * np.sin(2 * np.pi * k / 100)
        stamps = np.maximum.accumulate(np.round(k * step + rng.normal(0, 0.3 * step, n), 3)) + 100 * run
        parts.append(np.stack([stamps, np.full(n, run), twist], axis=1))
    time, run, twist = np.concatenate(parts).T
    friction = np.sign(np.gradient(twist))
    torque = 2e4 * np.sign(twist) * np.maximum(np.abs(twist) - 1e-3, 0) + 6 * friction + rng.normal(0, 0.5, len(time))
    record = make_record({"time": time, "run": run, "twist": twist, "output_torque": torque})
    found = diagnose_record(record, exponent=1.0, output_locked=True)
    assert "hysteresis" in [e.name for e in found.effects]
    assert PLAY in found.base
    assert {"coulomb_friction", "viscous_friction", "stribeck_friction", "backlash"} <= set(found.not_candidates)
    assert not any("friction" in name for names in found.alternatives for name in names)


def test_progress_shows_stage_and_share() -> None:
    stream = io.StringIO()
    stream.isatty = lambda: True  # type: ignore[method-assign]
    with Progress("diagnosing", 100, stream) as progress:
        for now, share in (("base curve", 0.0), ("sets of 1", 0.4), ("sets of 2", 0.3), ("result", 1.0)):
            progress._shown = -np.inf  # as if time had passed
            progress.advance_to(share, now)
    shown = [line.removesuffix("\033[K") for line in stream.getvalue().split("\r")]
    assert shown[1:5] == [
        "diagnosing: 0 %, base curve",
        "diagnosing: 40 %, sets of 1",
        "diagnosing: 40 %, sets of 2",
        "diagnosing: 100 %, result",
    ]
