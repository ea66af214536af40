"""The folder `documentation` of an FMU: a page about its variables, its dependencies, the licences."""

from __future__ import annotations

import importlib.metadata
from html import escape
from pathlib import Path

from .metadata import package_version
from .model.variables import Interface
from .python_backend.dependencies import external_dependencies
from .xml.description import ExportInfo


def documentation(interface: Interface, export: ExportInfo) -> dict[str, bytes]:
    """The members of the archive by name."""
    members = {"documentation/index.html": _page(interface, export).encode()}
    if export.capabilities["needsExecutionTool"]:
        members |= external_dependencies(export.version, package_version("casadi"), package_version("pythonfmu"))
    # "license" is the name that the standard gives to the licence of the whole FMU (FMI 2.0.4, section 2.3; FMI 3.0.2,
    # section 2.5.1).
    names = {"reefmu": "license", "pythonfmu": "pythonfmu"}
    for package in names if export.backend == "python" else ("reefmu",):
        try:
            files = importlib.metadata.files(package) or []
        except importlib.metadata.PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE") and ".dist-info" in str(file):
                members[f"documentation/licenses/{names[package]}.txt"] = Path(str(file.locate())).read_bytes()
    return members


def _page(interface: Interface, export: ExportInfo) -> str:
    rows = "".join(
        f"<tr><td>{escape(v.name)}</td><td>{v.causality}</td><td>{escape(v.unit)}</td>"
        f"<td>{escape(v.description)}</td></tr>\n"
        for v in interface.variables
    )
    name = escape(interface.name)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>{name}</title>\n'
        f"<h1>{name}</h1>\n<p>{escape(export.description)}</p>\n<table>\n"
        f"<tr><th>name</th><th>causality</th><th>unit</th><th>meaning</th></tr>\n{rows}</table>\n</html>\n"
    )
