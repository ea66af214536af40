"""The installed MuJoCo: headers and library that a plugin is compiled against. The package itself is not imported."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path

from stiffness_model.errors import InputError, install_command

REMEDY = install_command("mujoco")
_LIBRARIES = {"linux": "libmujoco.so.*", "darwin": "libmujoco.*.dylib"}


@dataclass(frozen=True)
class MujocoLibrary:
    """version: of the package, for which alone a plugin runs. include: folder of headers. library: the shared one."""

    version: str
    include: Path
    library: Path


def find_mujoco() -> MujocoLibrary:
    """The MuJoCo of this Python. Raises `InputError` without it, and on systems whose wheel no plugin can link with."""
    if sys.platform not in _LIBRARIES:
        # The wheel for Windows has no import library.
        raise InputError(f"mujoco: expected Linux or macOS, whose wheels can be linked with, got {sys.platform}")
    found = importlib.util.find_spec("mujoco")
    folders = list(found.submodule_search_locations or ()) if found else []
    if not folders:
        raise InputError(f"mujoco: expected the package ({REMEDY}), got none")
    folder = Path(folders[0])
    include, libraries = folder / "include", sorted(folder.glob(_LIBRARIES[sys.platform]))
    if not (include / "mujoco" / "mujoco.h").is_file() or not libraries:
        raise InputError(f"mujoco: expected headers and a library in {folder}, got none; {REMEDY} brings them")
    return MujocoLibrary(importlib.metadata.version("mujoco"), include, libraries[0])
