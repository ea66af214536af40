"""`reefmu curve`: what it prints and writes."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.cli import main
from stiffness_model.ratings.efficiency import friction_losses
from stiffness_model.ratings.peak_pressure import peak_pressures
from tests.integration.commands.program import preset_text, run_program
from tests.subprocesses import messages

CURVE_FILES = ["curve.csv", "curve.png", "forces.png", "load_share.png"]


def test_curve_prints_a_table_and_writes_its_files(tmp_path: Path) -> None:
    done = run_program("curve", "drive_1", "--drives", "32", folder=tmp_path)
    assert done.returncode == 0
    # One plain warning, as the documents call it: the elements do not fit.
    assert messages(done.stderr) == [f"warning: drive_1: {sm.load_drive('drive_1').seats.overlap_message()}"]
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
    for words in ("play  ", "lost motion", "carry load", "have play", "cut away", "drive_1-curve"):
        assert words in done.stdout


def test_fields_of_a_drawing_can_be_set_on_the_command_line(
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


@pytest.mark.slow
def test_curve_prints_the_effect_of_options_and_ratings(
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
    no_load = friction_losses(soft, [0.0], 16, coefficient=0.05).loss.mean() * 1e3
    assert float(rows[-1]["bearing_load [N]"]) > 2000
    assert float(rows[-1]["bearing_life [Mrev]"]) > 100
    out = capsys.readouterr().out
    for words in (
        "beyond the plain model: bearing_stiffness = 250 N/um",
        "plain model 28",
        "static safety 1.0",
        "stays above 1 up to",
        "efficiency 91",
        f"no-load torque at the crank {no_load:.1f} mN.m",
        "P = 3.",
        "million turns of the crank, ",
        "h (in each turn the rings of a bearing make 1.0",
        "revolutions relative to each other)",
        "no rating life",
    ):
        assert words in out


@pytest.mark.slow
def test_curve_names_contacts_without_a_pressure_limit_and_a_limit_that_is_exceeded(
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
def test_elements_larger_than_their_bores_are_counted_once_and_the_remedy_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def output(offset: str) -> str:
        assert (
            main(["curve", "drive_1", "--drives", "16", "--set", f"cage_offset={offset}", "--out", str(tmp_path)]) == 0
        )
        return capsys.readouterr().out

    # Half of 16 x 87 = 1392 elements, not of the 84 912 cases at 61 twists.
    tight = re.search(r"(\d+) elements \((\d+) %\) are larger than their bores", output("0 um"))
    assert tight is not None
    assert 600 < int(tight[1]) < 800
    assert "1.26 um above nominal (cage_offset, or a fit)" in output("0 um")
    assert "cage_offset, or a fit" not in output("3 sigma")
