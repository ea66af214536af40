"""Files and folders that are written completely or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from stiffness_model.errors import InputError
from stiffness_model.io.atomic_files import (
    SCRATCH_PREFIX,
    STAGING_PREFIX,
    atomic_file,
    remove_abandoned,
    replaced_folder,
    scratch_folder,
    staged_folder,
)


def contents(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def test_all_files_are_moved_and_others_stay(tmp_path: Path) -> None:
    (tmp_path / "old.txt").write_text("old")
    (tmp_path / "kept.txt").write_text("kept")
    with staged_folder(tmp_path) as stage:
        (stage / "old.txt").write_text("new")
        (stage / "b.txt").write_text("b")
        assert (tmp_path / "old.txt").read_text() == "old"
    assert contents(tmp_path) == ["b.txt", "kept.txt", "old.txt"]
    assert (tmp_path / "old.txt").read_text() == "new"


def stage_files(folder: Path, names: tuple[str, ...], fault: BaseException | None = None) -> None:
    """Write `names` through a staged folder, with a fault at the end."""
    with staged_folder(folder) as stage:
        for name in names:
            (stage / name).write_text("half")
        if fault is not None:
            raise fault


@pytest.mark.parametrize("fault", [ValueError("wrong"), KeyboardInterrupt()])
def test_a_fault_leaves_the_folder_as_it_was(tmp_path: Path, fault: BaseException) -> None:
    (tmp_path / "old.txt").write_text("old")
    for folder in (tmp_path, tmp_path / "new" / "deep"):
        with pytest.raises(type(fault)):
            stage_files(folder, ("old.txt", "other.txt"), fault)
        assert contents(tmp_path) == ["old.txt"]
        assert (tmp_path / "old.txt").read_text() == "old"


def test_a_folder_in_a_file_s_place_stops_all_files(tmp_path: Path) -> None:
    (tmp_path / "b.txt").mkdir()
    with pytest.raises(InputError, match=r"b\.txt is a folder"):
        stage_files(tmp_path, ("a.txt", "b.txt", "c.txt"))
    assert contents(tmp_path) == ["b.txt"]


def test_an_unwritable_folder_is_found_at_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="expected a folder that can be written"), staged_folder(folder):
            pytest.fail("the block must not start")
    assert contents(tmp_path) == ["file"]


def test_a_folder_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    # chmod would not do, for root may write everywhere.
    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(InputError, match="Permission denied"), staged_folder(tmp_path / "new"):
        pytest.fail("the block must not start")
    assert contents(tmp_path) == []


def test_files_have_the_permissions_of_the_umask(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    with staged_folder(tmp_path) as stage:
        (stage / "staged").write_text("")
    with atomic_file(tmp_path / "whole") as temporary:
        temporary.write_text("")
    modes = {name: (tmp_path / name).stat().st_mode for name in ("plain", "staged", "whole")}
    assert len(set(modes.values())) == 1


def test_a_file_is_written_completely_or_not_at_all(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")

    def write(text: str, fault: BaseException | None = None) -> None:
        with atomic_file(target) as temporary:
            temporary.write_text(text)
            if fault is not None:
                raise fault

    with pytest.raises(RuntimeError):
        write("half", RuntimeError())
    assert target.read_text() == "old"
    assert contents(tmp_path) == ["a.txt"]
    write("new")
    assert target.read_text() == "new"
    assert contents(tmp_path) == ["a.txt"]


HELD = """
import sys, time
from stiffness_model.io.atomic_files import scratch_folder, staged_folder, atomic_file
with staged_folder(sys.argv[1]) as stage, atomic_file(sys.argv[1] + "/b.txt") as one, scratch_folder() as scratch:
    for folder in (stage, one.parent, scratch):
        (folder / "half.txt").write_text("half")
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="foreign host: locks of Linux")
def test_folders_of_a_killed_process_are_removed_and_those_of_a_running_one_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, scratch = tmp_path / "out", tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    environment = {**os.environ, "TMPDIR": str(scratch), "PYTHONPATH": str(Path(__file__).parents[4])}
    with subprocess.Popen(
        [sys.executable, "-c", HELD, str(out)], env=environment, stdout=subprocess.PIPE, text=True
    ) as owner:
        assert owner.stdout is not None
        assert owner.stdout.readline() == "ready\n"
        theirs = contents(tmp_path)
        for place, start in ((out, STAGING_PREFIX), (scratch, SCRATCH_PREFIX)):
            remove_abandoned(place, start)
        assert contents(tmp_path) == theirs
        assert theirs.count("half.txt") == 3
        owner.kill()
    with staged_folder(out) as stage, scratch_folder() as own:
        (stage / "a.txt").write_text("whole")
        assert contents(scratch) == [own.name]
    assert contents(tmp_path) == ["a.txt", "out", "scratch"]


def test_links_files_and_other_folders_are_not_removed(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / f"{STAGING_PREFIX}link").symlink_to(tmp_path / "mine")
    (tmp_path / f"{STAGING_PREFIX}file").write_text("")
    (tmp_path / f"{STAGING_PREFIX}old").mkdir()
    remove_abandoned(tmp_path)
    assert contents(tmp_path) == [f"{STAGING_PREFIX}file", f"{STAGING_PREFIX}link", "mine"]


def test_a_folder_in_the_file_s_place_is_reported(tmp_path: Path) -> None:
    (tmp_path / "a.txt").mkdir()
    with pytest.raises(InputError, match="expected the name of a file"), atomic_file(tmp_path / "a.txt") as temporary:
        temporary.write_text("")
    assert contents(tmp_path) == ["a.txt"]


def test_a_folder_is_replaced_as_a_whole_or_stays(tmp_path: Path) -> None:
    """Also its old files and folders go; a folder of others and a failure leave everything as it was."""
    target = tmp_path / "results"
    for content in ("first", "second"):
        with replaced_folder(target, "marker") as stage:
            (stage / "marker").write_text(content, "utf-8")
            (stage / content).mkdir()
    assert sorted(file.name for file in target.iterdir()) == ["marker", "second"]
    with contextlib.suppress(KeyboardInterrupt), replaced_folder(target, "marker") as stage:
        (stage / "marker").write_text("third", "utf-8")
        raise KeyboardInterrupt
    assert (target / "marker").read_text("utf-8") == "second"
    with pytest.raises(InputError, match="expected a new folder, an empty one or one with other"):
        replaced_folder(target, "other").__enter__()
    assert [file.name for file in tmp_path.iterdir()] == ["results"]
