"""From a native FMU for FMI 2.0 to one for FMI 3.0: a further layer of C, other XML, other names of folders."""

from __future__ import annotations

from collections.abc import Mapping

from .codegen.sources import FMI2_MAIN, FMI3_MAIN, MAIN_SOURCE, wrapper_files
from .documentation.members import ICON
from .model.variables import Interface
from .xml.archive import DESCRIPTION
from .xml.description import ExportInfo
from .xml.fmi3 import build_description, model_description_fmi3, terminals

_FOLDERS = {
    "linux64": ("x86_64-linux",),
    "aarch64-linux": ("aarch64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),
}
"""Folders of binaries, FMI 2.0 -> FMI 3.0."""


def fmi3_sources(sources: Mapping[str, bytes]) -> dict[str, bytes]:
    """The C files for FMI 3.0 from those for FMI 2.0; `MAIN_SOURCE` is again the file to compile."""
    files = {**sources, **wrapper_files("fmi3"), FMI2_MAIN: sources[MAIN_SOURCE]}
    files[MAIN_SOURCE] = files.pop(FMI3_MAIN)
    return files


def fmi3_members(members: Mapping[str, bytes], interface: Interface, export: ExportInfo) -> dict[str, bytes]:
    """The archive for FMI 3.0 from that for FMI 2.0, whose sources are already those of `fmi3_sources`."""
    renamed: dict[str, bytes] = {}
    for name, content in members.items():
        top, _, rest = name.partition("/")
        if top == "binaries":
            folder, _, file = rest.partition("/")
            renamed |= {f"binaries/{new}/{file}": content for new in _FOLDERS[folder]}
        else:
            renamed[name] = content
    renamed["terminalsAndIcons/icon.png"] = renamed.pop(ICON)
    return {
        **renamed,
        DESCRIPTION: model_description_fmi3(interface, export),
        "sources/buildDescription.xml": build_description(export),
        "terminalsAndIcons/terminalsAndIcons.xml": terminals(interface),
    }
