"""What can follow in a call: commands, their options and arguments, and the words or files that these take."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum

from ..argument_types import actions_of


class Files(Enum):
    """Which files an option or argument takes."""

    NONE = "none"
    FILES = "files"
    FOLDERS = "folders"


@dataclass(frozen=True)
class Completed:
    """An option, or a positional argument (without flags). words: that it takes, beside `files`."""

    flags: tuple[str, ...]
    help: str
    takes_value: bool
    words: tuple[str, ...]
    files: Files


@dataclass(frozen=True)
class CompletedCommand:
    """One command, "" for the program itself, with its options and positional arguments."""

    name: str
    help: str
    options: tuple[Completed, ...]
    arguments: tuple[Completed, ...]


def completed_commands(parser: argparse.ArgumentParser) -> list[CompletedCommand]:
    """The program itself, then each of its commands."""
    found = [_command("", "", parser)]
    for action in actions_of(parser):
        if isinstance(action.choices, Mapping):
            helps = {choice.dest: choice.help or "" for choice in _choices(action)}
            found += [_command(name, helps[name], sub) for name, sub in action.choices.items()]
    return found


def _choices(action: argparse.Action) -> Iterable[argparse.Action]:
    """The commands of the subparsers with their lines of help, private to argparse too."""
    return getattr(action, "_choices_actions", ())


def _command(name: str, text: str, parser: argparse.ArgumentParser) -> CompletedCommand:
    actions = [_completed(a) for a in actions_of(parser) if not isinstance(a.choices, Mapping)]
    options = tuple(found for found in actions if found.flags)
    return CompletedCommand(name, text, options, tuple(found for found in actions if not found.flags))


def _completed(action: argparse.Action) -> Completed:
    takes = action.nargs != 0
    words, files = _values(action) if takes else ((), Files.NONE)
    return Completed(tuple(action.option_strings), action.help or "", takes, words, files)


def _values(action: argparse.Action) -> tuple[tuple[str, ...], Files]:
    """The words and files that an option or argument takes, by its choices, its name and its placeholder."""
    if action.choices is not None:
        return tuple(str(choice) for choice in action.choices), Files.NONE
    metavar = str(action.metavar or "")
    words = _WORDS[action.dest]() if action.dest in _WORDS else []
    files = Files.FOLDERS if metavar == "DIR" else Files.FILES if _is_file(metavar) else Files.NONE
    return tuple(words), files


def _is_file(metavar: str) -> bool:
    """Whether a placeholder stands for a file, such as FILE.fmu, RECORD, or DRIVE, which may be one."""
    return metavar in ("DRIVE", "RECORD", "FILE") or ("." in metavar and "=" not in metavar)


def _drives() -> list[str]:
    from stiffness_model.catalog.gears import catalog
    from stiffness_model.io.drawing_toml import presets

    return [*presets(), *(gear.name for gear in catalog() if gear.has_curve)]


def _fields() -> list[str]:
    from stiffness_model.kinds import KINDS

    return list(dict.fromkeys(f"{name}=" for kind in KINDS.values() for name in kind.fields))


def _kinds() -> list[str]:
    from stiffness_model.kinds import KINDS

    return [name.replace(" ", "-") for name in KINDS]


def _effects() -> list[str]:
    from reefmu.effects import EFFECTS

    return list(EFFECTS)


def _effect_values() -> list[str]:
    from reefmu.effects import EFFECTS

    return [f"{effect.name}.{p.name}=" for effect in EFFECTS.values() for p in effect.parameters]


def _platforms() -> list[str]:
    from reefmu.fmu.codegen.compile import PLATFORMS

    return [*PLATFORMS, "all", "none"]


def _studies() -> list[str]:
    from stiffness_model.io.toml_files import packaged_names

    return packaged_names("studies")


_WORDS: Mapping[str, Callable[[], list[str]]] = {
    "drive": _drives,
    "source": _drives,
    "fields": _fields,
    "kind": _kinds,
    "name": _effects,
    "effects": _effects,
    "effect": _effect_values,
    "platform": _platforms,
    "study": _studies,
}
"""The words of options and arguments by their names in the parsed call."""
