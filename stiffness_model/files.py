"""Files and folders of files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import tempfile
from collections.abc import Generator
from pathlib import Path

from .errors import InputError


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Generator[Path]:
    """A temporary name beside `path`, renamed to it when the block ends well and removed when it does not.

    Raises `InputError` where the folder does not exist or cannot be written.
    """
    target = Path(path)
    try:
        # The name keeps the suffix: some writers choose the format by it, or append it.
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=target.suffix)
    except OSError as error:
        raise _not_writable(target, error) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files for the owner alone; a result is for whoever the umask lets read it.
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def staged_folder(folder: str | os.PathLike[str]) -> Generator[Path]:
    """A temporary folder whose files move into `folder` when the block ends well: all of them, or none.

    `folder` is made if it does not exist, and taken away again if the block fails. Files of the same names
    are replaced, others stay. Raises `InputError` at the start of the block if the folder cannot be written:
    use it around long work, so that a wrong name is not found out at its end.

    >>> with tempfile.TemporaryDirectory() as place:
    ...     with staged_folder(Path(place) / "new") as stage:
    ...         _ = (stage / "a.txt").write_text("whole")
    ...     sorted(file.name for file in (Path(place) / "new").iterdir())
    ['a.txt']
    """
    target = Path(folder)
    missing = [place for place in (target, *target.parents) if not place.exists()]
    stage: Path | None = None
    done = False
    try:
        with _refuse_unwritable(target):
            target.mkdir(parents=True, exist_ok=True)
            stage = Path(tempfile.mkdtemp(dir=target, prefix=".unfinished-"))
        yield stage
        with _refuse_unwritable(target):
            _move_files(stage, target)
        done = True
    finally:
        if stage is not None:
            shutil.rmtree(stage, ignore_errors=True)
        for place in [] if done else missing:
            with contextlib.suppress(OSError):
                place.rmdir()


def _move_files(stage: Path, target: Path) -> None:
    files = sorted(stage.iterdir())
    for file in files:
        # Seen before the first move: a folder in a file's place would stop the moves half-way.
        if (target / file.name).is_dir():
            raise IsADirectoryError(errno.EISDIR, f"{file.name} is a folder")
    for file in files:
        os.replace(file, target / file.name)


@contextlib.contextmanager
def _refuse_unwritable(folder: Path) -> Generator[None]:
    try:
        yield
    except OSError as error:
        raise _not_writable(folder, error) from None


def _not_writable(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: expected a folder that can be written, got {error.strerror or error}")
