"""TOML texts: those that come with the package, found by their names, and files; parsed with one-line errors."""

from __future__ import annotations

import importlib.resources
import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import InputError, unknown_name


def parse_toml(text: str, where: str, what: str = "TOML") -> dict[str, Any]:
    """The table of a text, or `InputError`: for a syntax error as for brackets nested too deep and numbers too long.

    >>> parse_toml("a = " + "[" * 10**5, "deep.toml")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: deep.toml: expected TOML, got one nested too deep
    """
    try:
        return tomllib.loads(text)
    except ValueError as error:
        raise InputError(f"{where}: expected {what}, got a syntax error: {error}") from None
    except RecursionError:
        raise InputError(f"{where}: expected {what}, got one nested too deep") from None


def packaged_names(folder: str) -> list[str]:
    """Names of the TOML files in a folder of this package, sorted.

    >>> packaged_names("studies")
    ['geometry', 'tolerance_field']
    """
    files = (importlib.resources.files("stiffness_model") / folder).iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


def read_packaged(folder: str, name: str) -> str:
    """The text of a TOML file in a folder of this package."""
    return (importlib.resources.files("stiffness_model") / folder / f"{name}.toml").read_text("utf-8")


def read_text(path: Path, what: str) -> str:
    """The text of a file, or `InputError`. what: what was expected, such as "TOML drawing"."""
    try:
        return path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path}: expected a readable {what}, got: {reason}") from None


def read_named(
    source: str | os.PathLike[str], folder: str, kind: str, what: str, others: Iterable[str] = ()
) -> tuple[dict[str, Any], str, Path]:
    """The table of a file, or of one that comes with the package; what messages call it; its folder.

    source: a name in `folder` of this package, or a path; kind: what such a name stands for, such as "drive"; what: as
    for `read_text`; others: further names that an unknown one may have meant. Raises `InputError`.
    """
    if isinstance(source, str) and source in packaged_names(folder):
        return parse_toml(read_packaged(folder, source), source, f"a {what}"), source, Path()
    path = Path(source)
    if not path.is_file():
        if path.suffix == "" and path.parent == Path():
            raise unknown_name(kind, str(source), [*packaged_names(folder), *others])
        raise InputError(f"{path}: expected a {what}, got no such file")
    return parse_toml(read_text(path, what), str(path), f"a {what}"), str(path), path.parent
