"""Drives of every kind as TOML files: in, by the reader of their kind, and out."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any

from ..drawing.drive import Drive
from ..errors import DoesNotFitWarning, InputError
from ..kinds import KINDS, ROLLING_ELEMENT_ECCENTRIC, AnyDrive, Kind, is_drive, kind_of, kind_of_table
from .atomic_files import atomic_file
from .toml_files import packaged_names, read_named

DriveLike = AnyDrive | str | os.PathLike[str]
"""What the public functions take for a drive: the drive itself, the name of a preset or of a packaged gear, or a
drawing's path (`as_any_drive`, `as_drive`)."""


def presets() -> list[str]:
    """Names of the drawings that come with the package.

    >>> presets()
    ['drive_1', 'drive_2', 'drive_3', 'printed_cycloidal', 'workshop']
    """
    return packaged_names("presets")


def load_drive(source: str | os.PathLike[str], **fields: Any) -> Any:
    """A drive of any kind from its drawing; keywords override the drawing's fields.

    source: the name of a preset or of a packaged gear, or a TOML file's path. Keywords take what TOML takes ("41 mm",
    "IT5", "3 sigma") and, for quantities, SI numbers (0.041). Raises `InputError` with the file, the field, what was
    expected and what came; warns (`DoesNotFitWarning`) if bores overlap, with seats, chord, wall and what fits
    (`seats`).

    >>> load_drive("drive_1", lobes=28).ratio
    29
    >>> load_drive("drive_1").ratio
    -29
    """
    table, where = read_table(source)
    drive = drive_from_dict(table, where, **fields)
    if isinstance(drive, Drive) and not drive.seats.fits:
        warnings.warn(f"{where}: {drive.seats.overlap_message()}", DoesNotFitWarning, stacklevel=2)
    return drive


def as_any_drive(drive: DriveLike) -> AnyDrive:
    """The drive itself, or that of a name or a drawing's path: what functions for drives of every kind take.

    Raises `InputError` for anything else.

    >>> as_any_drive("drive_1") == load_drive("drive_1") == as_any_drive(load_drive("drive_1"))
    True
    """
    if isinstance(drive, (str, os.PathLike)):
        return load_drive(drive)
    if not is_drive(drive):
        raise InputError(f"drive: expected a Drive, a preset's name or a drawing's path, got {drive!r}")
    return drive


def as_drive(drive: DriveLike, where: str = "drive") -> Drive:
    """`as_any_drive` for functions that serve rolling element eccentric drives only.

    where: what needs such a drive. Raises `InputError` for a drive of another kind.
    """
    found = as_any_drive(drive)
    if not isinstance(found, Drive):
        expected = KINDS[ROLLING_ELEMENT_ECCENTRIC].noun
        raise InputError(f"{where}: expected {expected}, got {found.name}, {kind_of(found).noun}")
    return found


def read_table(source: str | os.PathLike[str]) -> tuple[dict[str, Any], str]:
    """The tables of a drawing as TOML gives them, for `drive_from_dict`, and what to call it in an error.

    Raises `InputError` where there is no such name or file, or no TOML in it.
    """
    others: list[str] = []
    for kind in KINDS.values():
        if kind.packaged and isinstance(source, str):
            table = kind.call("packaged", source)
            if table is not None:
                return table, source
            others += kind.call("packaged_names")
    table, where, _ = read_named(source, "presets", "drive", "TOML drawing", others)
    return table, where


def drive_from_dict(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> Any:
    """A drive from a drawing's nested tables; keywords override its fields.

    table: as TOML gives it. where: the name of the drawing in messages. Raises `InputError` with the field, what was
    expected and what came.

    >>> drive = load_drive("drive_2")
    >>> drive_from_dict(drive_to_dict(drive)) == drive
    True
    """
    kind = kind_of_table(table, where)
    _refuse_fields_of_another_kind(table, kind, where)
    return kind.call("read", table, where, **fields)


def _refuse_fields_of_another_kind(table: Mapping[str, Any], kind: Kind, where: str) -> None:
    """Raise `InputError` if another kind than the drawing's knows more of its fields."""
    stated = [name for key, value in table.items() for name in (value if isinstance(value, Mapping) else (key,))]
    known = {
        other.name: [name for name in stated if name.lower() in other.fields or name in other.keys_beside_fields]
        for other in KINDS.values()
    }
    likely = KINDS[max(known, key=lambda name: len(known[name]))]
    if len(known[likely.name]) > len(known[kind.name]):
        foreign = next(name for name in known[likely.name] if name not in known[kind.name])
        raise InputError(
            f"{where}: expected the fields of {kind.noun}, got {foreign!r}; for {likely.noun} state "
            f'kind = "{likely.name}" before all tables'
        )


def drive_to_dict(drive: AnyDrive) -> dict[str, Any]:
    """The drawing of `drive` as nested tables, such that `drive_from_dict` gives it back."""
    return kind_of(drive).call("write", drive)


def save_drive(drive: AnyDrive, path: str | os.PathLike[str]) -> None:
    """Write the drawing of `drive` to `path` as TOML, whole or not at all; `load_drive` gives back an equal drive."""
    import tomli_w

    with atomic_file(path) as temporary:
        temporary.write_text(tomli_w.dumps(drive_to_dict(drive)), encoding="utf-8")
