"""What makes a native FMU for FMI 2.0 one for FMI 3.0: a further wrapper, other XML, other names of folders."""

from __future__ import annotations

from collections.abc import Mapping

from .codegen.sources import UNIT, UNIT_FMI2, UNIT_FMI3, wrapper_files
from .model.variables import Interface
from .xml.archive import DESCRIPTION
from .xml.fmi2 import Export
from .xml.fmi3 import build_description, model_description3, terminals

_FOLDERS = {
    "linux64": ("x86_64-linux",),
    "aarch64-linux": ("aarch64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
}
"""Folders of binaries, FMI 2.0 -> FMI 3.0."""


def sources3(sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files of a native FMU with the wrapper for FMI 3.0 around them; still `UNIT` is what is compiled."""
    files = {**sources, **wrapper_files("fmi3"), UNIT_FMI2: sources[UNIT]}
    files[UNIT] = files.pop(UNIT_FMI3)
    return files


def members3(members: Mapping[str, bytes], interface: Interface, export: Export) -> dict[str, bytes]:
    """The archive for FMI 3.0 from that for 2.0, whose sources are already those of `sources3`."""
    moved: dict[str, bytes] = {}
    for name, content in members.items():
        top, _, rest = name.partition("/")
        folder, _, file = rest.partition("/")
        for new in _FOLDERS[folder] if top == "binaries" else ():
            moved[f"binaries/{new}/{file}"] = content
        if top != "binaries":
            moved[name] = content
    return {
        **moved,
        DESCRIPTION: model_description3(interface, export),
        "sources/buildDescription.xml": build_description(export),
        "terminalsAndIcons/terminalsAndIcons.xml": terminals(interface),
    }
