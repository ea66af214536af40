"""`reefmu draw`: the files it writes and what it prints."""

from __future__ import annotations

from pathlib import Path

import pytest

import stiffness_model as sm
from reefmu.cli import main


def test_draw_writes_pictures_and_prints_the_forces(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    assert (
        main(["draw", "drive_1", "--twist", "6", "--individual", "5", "--exaggerate", "50", "--out", str(folder)]) == 0
    )
    assert sorted(path.name for path in folder.iterdir()) == ["drive.png", "forces.png"]
    output = capsys.readouterr()
    drive = sm.load_drive("drive_1")
    loads = sm.simulate(drive, [6 * sm.ARCMIN], 1, 5)
    # At the crank angle 0 and not at the angle that the seed draws: similar, but not equal.
    torque = float(output.out.split("at 6 arcmin ")[1].split()[0])
    assert torque == pytest.approx(loads.torque[0, 0], rel=0.1)
    assert "bores overlap by 3.62 mm" in output.out
    assert "do not fit" in output.err


def test_forces_name_the_wall_that_the_twist_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for twist in ("3", "-3"):
        assert main(["draw", "workshop", "--twist", twist, "--out", str(tmp_path)]) == 0
        forces = capsys.readouterr().out.split("greatest forces: ")[1].split(";")[0].split(", ")
        values = {text.rsplit(" ", 2)[0]: float(text.split()[-2]) for text in forces}
        assert list(values) == ["gear", "crank", "loaded cage wall", "other cage wall"]
        assert values["loaded cage wall"] > 0 == values["other cage wall"]


def test_a_drive_that_cannot_be_drawn_is_not_said_to_lack_dimensions(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["draw", "printed_cycloidal"]) == 2
    assert capsys.readouterr().err == (
        "reefmu: draw: printed_cycloidal is a cycloidal drive without pictures to scale and design studies: so far "
        "these are made of rolling element eccentric drives only\n"
    )


def test_angles_are_taken_with_their_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = []
    for words in (["--twist", "3", "--angle", "90"], ["--twist", "0.05 deg", "--angle", "5400 arcmin"]):
        assert main(["draw", "workshop", *words, "--out", str(tmp_path)]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]
    assert "at 3 arcmin" in printed[0]


def test_draw_writes_dxf_and_animation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ezdxf", reason="ezdxf (extra dxf) is not installed")
    from reefmu.commands.drawings import draw

    monkeypatch.setattr(draw, "write_animation", lambda drive, path, twist: path.write_bytes(b"GIF") and 48)
    assert (
        main(["draw", "drive_1", "--set", "lobes=28", "--dxf", "--chord", "1", "--animate", "--out", str(tmp_path)])
        == 0
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drive.png", "forces.png", "profile.dxf", "turn.gif"]
    printed = capsys.readouterr().out
    assert "28 lobes, ratio +29" in printed
    assert "off the profile by at most 0.9" in printed or "off the profile by at most 1 um" in printed


def test_a_note_names_uneven_bores(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["draw", "drive_1", "--set", "elements=60", "--set", "element_radius=4 mm", "--out", str(tmp_path)]) == 0
    )
    output = capsys.readouterr()
    assert output.err.splitlines() == [
        "note: 20 elements occupy 20 of the 29 places that the ratio gives, unevenly; the other commands assume "
        "even spacing (eq. 20), so that their torque differs a little"
    ]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (["--twist", "nan"], "--twist: expected a finite twist"),
        (["--exaggerate", "0"], "--exaggerate: expected a factor of at least 1"),
        (["--chord", "-1", "--dxf"], "--chord: expected a positive chord error"),
        (["--set", "elements=90"], "at most 29 elements on one eccentric"),
        (["--individual", "-1"], "expected a whole number"),
    ],
)
def test_wrong_calls_are_one_line_and_leave_nothing(
    call: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = main(["draw", "drive_1", *call, "--out", str(tmp_path / "new")])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    err = capsys.readouterr().err
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
