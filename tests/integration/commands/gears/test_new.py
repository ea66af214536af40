"""`reefmu new`: a drawing that the other commands take, and no file lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from reefmu.cli import main
from stiffness_model.kinds import KINDS


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_drawing_runs(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my drive.toml", "--kind", kind.replace(" ", "-")]) == 0
    shown = capsys.readouterr().out
    assert "edit it, then: reefmu curve 'my drive.toml'" in shown
    assert main(["curve", "my drive.toml", "--drives", "2"]) == 0
    assert capsys.readouterr().out.startswith("my drive: ")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my drive-curve", "my drive.toml"]


def test_an_existing_file_is_replaced_with_force_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("mine")
    assert main(["new", "mine.toml"]) == 2
    assert "mine.toml: expected the name of a new file, got one that exists; --force" in capsys.readouterr().err
    assert Path("mine.toml").read_text() == "mine"
    assert main(["new", "mine.toml", "--force", "--kind", "catalogue"]) == 0
    assert 'kind = "catalogue"' in Path("mine.toml").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["mine.toml", "--kind", "cycloid"], "--kind: unknown kind 'cycloid'; did you mean 'cycloidal'?"),
        (["mine.txt"], "new: expected a file name that ends in .toml, got 'mine.txt'"),
        (["nowhere/mine.toml"], "nowhere/mine.toml: expected a folder that can be written"),
        ([""], "expected a name, got ''"),
    ],
)
def test_a_wrong_call_writes_nothing(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["new", *words])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    err = capsys.readouterr().err
    assert message in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
