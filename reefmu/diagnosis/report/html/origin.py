"""Where a report comes from: command, version, date, and the files that were read, each with its hash."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath, PureWindowsPath

from stiffness_model.io.drawing_toml import presets
from stiffness_model.version import __version__

from ....source_date import source_date

HASH_DIGITS = 16
"""Hexadecimal digits of a SHA-256 that are shown: 64 bits, enough to tell files apart by accident; by judgement."""


@dataclass(frozen=True)
class Origin:
    """What the caller knows of a report's origin.

    command: the command line, empty for a call from Python; base: the drawing, preset or curve as it was given, empty
    for none; reading: the options with which records of this rig are read, such as ("--locked", "output"); assumed:
    those of what is known beside a record, such as ("--priors", "priors.toml").
    """

    command: str = ""
    base: str = ""
    reading: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()


def command_text(command: str) -> str:
    """A command line that shows no folder of the machine: absolute paths become file names.

    >>> command_text("reefmu diagnose /home/me/a.csv --drive my/drive.toml")
    'reefmu diagnose a.csv --drive my/drive.toml'
    """
    return shlex.join(_without_folder(word) for word in shlex.split(command))


def _without_folder(word: str) -> str:
    name, equals, path = word.partition("=")
    if equals and "," not in path:
        return f"{name}={_without_folder(path)}"
    if PureWindowsPath(word).drive or PurePosixPath(word).is_absolute():
        return PureWindowsPath(word).name
    return ",".join(map(_without_folder, word.split(","))) if "," in word else word


def with_options(command: str, options: Sequence[str]) -> str:
    """A command line with more options, which show no folder.

    >>> with_options("reefmu diagnose a.csv", ["--column", "TIME=time [s]"])
    "reefmu diagnose a.csv --column 'TIME=time [s]'"
    """
    return f"{command} {command_text(shlex.join(options))}" if options else command


def origin_rows(origin: Origin, records: Iterable[str]) -> list[tuple[str, str]]:
    """Name and text of what a report states of its origin. records: paths of the records, or texts that are none.

    The date is that of SOURCE_DATE_EPOCH where it is set. A file that is not there any more, or never was one, has no
    hash.
    """
    rows = [("date", f"{source_date(datetime.now(UTC)):%Y-%m-%d %H:%M} UTC"), ("version", f"reefmu {__version__}")]
    if origin.command:
        rows.append(("command", command_text(origin.command)))
    rows += [("record", file_text(record)) for record in records if record]
    if origin.base in presets():
        rows.append(("drawing", f"preset {origin.base} of this version"))
    elif origin.base:
        kind = "drawing" if origin.base.endswith(".toml") or not Path(origin.base).is_file() else "curve"
        rows.append((kind, file_text(origin.base)))
    return rows


def file_text(path: str) -> str:
    """The name of a file with the start of its SHA-256."""
    name = PureWindowsPath(path).name
    try:
        digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except (OSError, ValueError):
        return name
    return f"{name}, SHA-256 {digest[:HASH_DIGITS]}"
