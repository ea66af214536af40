"""A drawing as a key of caches."""

from __future__ import annotations

from typing import Generic, TypeVar

from ..kinds import AnyDrive
from .drawing_toml import drive_to_dict

DriveType = TypeVar("DriveType", bound=AnyDrive)


class DrawingKey(Generic[DriveType]):
    """A drive whose hash and equality are those of its fields."""

    def __init__(self, drive: DriveType) -> None:
        self.drive = drive
        self._text = repr(drive_to_dict(drive))

    def __hash__(self) -> int:
        return hash(self._text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DrawingKey) and self._text == other._text
