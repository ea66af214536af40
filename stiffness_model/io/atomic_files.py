"""Files and folders that are written completely or not at all, and temporary folders that are always removed.

All temporary files are in folders of one kind (`_work_folder`), which the process that made them locks (flock). The
system releases the lock when the process ends, however it ends and even if its number is used again. The first such
folder of a process in a place removes the unlocked folders there: those of processes that were killed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
import tempfile
from collections.abc import Generator, Iterator
from pathlib import Path

from ..errors import InputError

try:
    import fcntl
except ImportError:  # On Windows nothing tells whether the process still runs, and nothing is removed.
    fcntl = None

STAGING_PREFIX = ".unfinished-"
"""Start of the names of temporary folders beside results."""
SCRATCH_PREFIX = "stiffness-model-work-"
"""Start of the names of temporary folders in the system's folder for temporary files."""

_cleaned: set[tuple[Path, int]] = set()
"""Places where abandoned folders were removed, with the number of the process, which a fork does not share."""


@contextlib.contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Generator[Path]:
    """A temporary name for `path`, renamed to it when the block ends well and removed when it does not.

    The block writes the file. Raises `InputError` if the folder does not exist or cannot be written.
    """
    target = Path(path)
    with contextlib.ExitStack() as work:
        try:
            folder = work.enter_context(_work_folder(target.parent, STAGING_PREFIX))
        except OSError as error:
            raise _not_writable(target, error) from None
        # The temporary file has the same name, by which some writers choose the format.
        yield folder / target.name
        try:
            os.replace(folder / target.name, target)
        except IsADirectoryError:
            raise InputError(f"{target}: expected the name of a file, got that of a folder") from None


@contextlib.contextmanager
def staged_folder(folder: str | os.PathLike[str]) -> Generator[Path]:
    """A temporary folder whose files move into `folder` when the block ends well: all of them, or none.

    `folder` is created if it does not exist, and removed again if the block fails. Files of the same names are
    replaced, others stay. Raises `InputError` at the start of the block if the folder cannot be written: entered
    before long computations, it finds a wrong name before them.

    >>> with tempfile.TemporaryDirectory() as place:
    ...     with staged_folder(Path(place) / "new") as stage:
    ...         _ = (stage / "a.txt").write_text("whole")
    ...     sorted(file.name for file in (Path(place) / "new").iterdir())
    ['a.txt']
    """
    target = Path(folder)
    missing = [place for place in (target, *target.parents) if not place.exists()]
    done = False
    try:
        with contextlib.ExitStack() as work:
            with _refuse_unwritable(target):
                target.mkdir(parents=True, exist_ok=True)
                stage = work.enter_context(_work_folder(target, STAGING_PREFIX))
            yield stage
            with _refuse_unwritable(target):
                _move_files(stage, target)
            done = True
    finally:
        for place in [] if done else missing:
            with contextlib.suppress(OSError):
                place.rmdir()


@contextlib.contextmanager
def replaced_folder(folder: str | os.PathLike[str], marker: str) -> Generator[Path]:
    """A temporary folder that becomes `folder` when the block ends well, and is removed when it does not.

    A folder that stands there is replaced as a whole, and only if it is empty or contains the file `marker`, by which
    the writer knows its own results. Raises `InputError` for another one, and if the folder cannot be written.
    """
    target = Path(folder)
    with _refuse_unwritable(target):
        if target.exists() and not (target / marker).is_file() and (not target.is_dir() or any(target.iterdir())):
            raise InputError(f"{target}: expected a new folder, an empty one or one with {marker}, got another")
        target.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.ExitStack() as work:
        with _refuse_unwritable(target):
            place = work.enter_context(_work_folder(target.parent, STAGING_PREFIX))
        new = place / "new"
        new.mkdir()
        yield new
        with _refuse_unwritable(target):
            if target.exists():
                os.replace(target, place / "old")
            os.replace(new, target)


@contextlib.contextmanager
def scratch_folder() -> Generator[Path]:
    """A folder among the system's temporary files, removed when the block ends."""
    with _work_folder(Path(tempfile.gettempdir()), SCRATCH_PREFIX) as folder:
        yield folder


@contextlib.contextmanager
def _work_folder(place: Path, start: str) -> Generator[Path]:
    """A new locked folder in `place`, removed with its content when the block ends. Raises `OSError`."""
    if (place, os.getpid()) not in _cleaned:
        remove_abandoned(place, start)
        _cleaned.add((place, os.getpid()))
    with contextlib.ExitStack() as held:
        yield _make_locked(place, start, held)


def _make_locked(place: Path, start: str, held: contextlib.ExitStack) -> Path:
    """A new folder, locked where there are locks. `held` removes it."""
    while True:
        folder = place / f"{start}{secrets.token_hex(8)}"
        # Before the folder is made: a signal may stop the program between any two statements.
        held.callback(shutil.rmtree, folder, ignore_errors=True)
        folder.mkdir(0o700)
        try:
            lock = _lock(folder)
        except OSError:
            return folder  # A file system without locks: no other process can remove it either.
        if lock is not None:
            held.callback(os.close, lock)
        # Another process may have removed it before it was locked.
        if fcntl is None or (lock is not None and folder.exists()):
            return folder


def remove_abandoned(place: Path, start: str = STAGING_PREFIX) -> None:
    """Remove the folders in `place` whose names begin with `start` and whose processes have ended.

    Folders that cannot be read or removed belong to another user and are left.
    """
    for folder in _named(place, start):
        try:
            lock = _lock(folder)
        except OSError:
            continue
        if lock is not None:
            shutil.rmtree(folder, ignore_errors=True)
            os.close(lock)


def _named(place: Path, start: str) -> Iterator[Path]:
    try:
        with os.scandir(place) as entries:
            found = [entry for entry in entries if entry.name.startswith(start)]
    except OSError:
        return
    for entry in found:
        if entry.is_dir(follow_symlinks=False):
            yield Path(entry.path)


def _lock(folder: Path) -> int | None:
    """A descriptor that locks the folder until it is closed; None if another process locks it. Raises `OSError`."""
    if fcntl is None:
        return None
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return None
    except OSError:
        os.close(lock)
        raise
    return lock


def _move_files(stage: Path, target: Path) -> None:
    files = sorted(stage.iterdir())
    for file in files:
        # Checked before the first move, for a folder in a file's place would leave the others half moved.
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
