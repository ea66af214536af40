"""Files and folders that are written whole or not at all, and temporary folders that are always removed.

All temporary work is in folders of one kind (`_work_folder`). Their owner holds a lock on them (flock) that the system
takes back when the owner dies, however it dies and whoever gets its number next. The first work of a process in a place
clears away the folders there that nobody holds: those of processes that were killed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import tempfile
from collections.abc import Generator, Iterator
from pathlib import Path

from ..errors import InputError

try:
    import fcntl
except ImportError:  # Windows: there nothing is known of an owner, and nothing is cleared away
    fcntl = None

STAGING_PREFIX = ".unfinished-"
"""How the names of temporary folders begin beside results."""
SCRATCH_PREFIX = "stiffness-model-work-"
"""How they begin in the system's folder for temporary files."""

_cleared: set[tuple[Path, int]] = set()
"""Places that were cleared, and the process that did it."""


@contextlib.contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Generator[Path]:
    """A temporary name for `path`, renamed to it when the block ends well and removed when it does not.

    The block makes the file. Raises `InputError` where the folder does not exist or cannot be written.
    """
    target = Path(path)
    with contextlib.ExitStack() as work:
        try:
            folder = work.enter_context(_work_folder(target.parent, STAGING_PREFIX))
        except OSError as error:
            raise _not_writable(target, error) from None
        # The same name: some writers choose the format by it, or append to it.
        yield folder / target.name
        try:
            os.replace(folder / target.name, target)
        except IsADirectoryError:
            raise InputError(f"{target}: expected the name of a file, got that of a folder") from None


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
def scratch_folder() -> Generator[Path]:
    """A folder for what nobody keeps, in the system's place for temporary files; gone when the block ends."""
    with _work_folder(Path(tempfile.gettempdir()), SCRATCH_PREFIX) as folder:
        yield folder


@contextlib.contextmanager
def _work_folder(place: Path, start: str) -> Generator[Path]:
    """A new folder in `place` for the owner alone; removed with all that is in it. Raises `OSError`."""
    if (place, os.getpid()) not in _cleared:
        remove_abandoned(place, start)
        _cleared.add((place, os.getpid()))
    folder, lock = _make_held(place, start)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _make_held(place: Path, start: str) -> tuple[Path, int | None]:
    """A new folder and the descriptor that holds it; None where there are no locks."""
    while True:
        folder = Path(tempfile.mkdtemp(dir=place, prefix=start))
        try:
            lock = _hold(folder)
        except OSError:
            return folder, None  # a file system without locks: then nobody can clear it away either
        # Another process may have cleared it away before it was held.
        if lock is not None and folder.exists():
            return folder, lock
        if lock is not None:
            os.close(lock)
        if fcntl is None:
            return folder, None


def remove_abandoned(place: Path, start: str = STAGING_PREFIX) -> None:
    """Remove the folders in `place` whose names begin with `start` and whose owners are gone. Never raises for one
    that cannot be read or removed: it is somebody else's."""
    for folder in _named(place, start):
        try:
            lock = _hold(folder)
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


def _hold(folder: Path) -> int | None:
    """A descriptor that holds the folder until it is closed; None if somebody else holds it. Raises `OSError`."""
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
