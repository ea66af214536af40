"""Export: a drive model becomes an FMU, with either of two back ends.

native: binaries from generated C, which need nothing. python: the installed package runs it through pythonfmu.
The same model exported twice with the same version (and compiler) gives the same bytes. So nothing in
the file comes from the clock: the GUID is a hash of the content, and the date is SOURCE_DATE_EPOCH where that is set,
else `RELEASE_DATE`, a date that stands for this version of the export.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import os
import re
import uuid
import warnings
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from reefmu.source_date import source_date
from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.io.atomic_files import scratch_folder

from .codegen.compile import compile_binaries, has_compiler, select_platforms
from .codegen.sources import MAIN_SOURCE, make_sources, with_guid
from .export_fmi3 import fmi3_members, fmi3_sources
from .model.component import LOOKUP_FILE, METADATA_FILE, Component, drive_component, save_component
from .model.declaration import declare, declare_with_derivatives
from .model.nominals import propose_experiment, with_nominals
from .model.table_encoding import embedded_lookup, lookup_metadata
from .model.variables import FMI_VERSIONS, Interface
from .python_backend.dependencies import external_dependencies
from .python_backend.equations_file import EQUATIONS_FILE, write_equations
from .xml.archive import DESCRIPTION, SCRIPT_NAME, write_archive
from .xml.fmi2 import ExportInfo, model_description

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses

RELEASE_DATE = datetime(2026, 1, 1, tzinfo=UTC)
LICENCE = "BSD-3-Clause"
AUTHOR, COPYRIGHT = "the reefmu authors", "Copyright (c) 2026, the reefmu authors"
"""Of the code inside, as in the licence; the model is whose drawing it is."""
BACKENDS = ("python", "native")
NO_COMPILER = (
    "no C compiler here: the FMU runs in Python, and its host needs a Python with this package; "
    "pip install 'reefmu[native]' brings a compiler, and with it FMUs that need nothing"
)
CAPABILITIES = {
    "needsExecutionTool": True,
    "canHandleVariableCommunicationStepSize": True,
    "canInterpolateInputs": False,
    "canRunAsynchronuously": False,  # so spelt in the schema
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": False,
}
"""What pythonfmu's binary with `slave.DriveSlave` behind it can do (FMI 2.0.4, section 4.3.1)."""
NATIVE_CAPABILITIES = {
    **CAPABILITIES,
    "needsExecutionTool": False,
    "canNotUseMemoryManagementFunctions": False,
    "providesDirectionalDerivative": True,
}
EXCHANGE_CAPABILITIES = {
    "needsExecutionTool": False,
    "completedIntegratorStepNotNeeded": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": True,
}
"""What the generated C can do, for co-simulation and for model exchange (section 3.3.1)."""
_SLAVE_SCRIPT = '''"""Runs in the installed package. Its names keep it apart from other FMUs in the process."""
from reefmu.fmu.python_backend.slave import DriveSlave
from reefmu.fmu.python_backend.workarounds import leak_reference

leak_reference(globals())


class {identifier}(DriveSlave):
    fmu_guid = "{guid}"
'''


def default_backend(platform: str = "host", fmi: str = "2.0") -> str:
    """The back end where none is named: "native", which needs nothing, but where no compiler is there.

    What only the native back end can serve (another platform, sources alone, FMI 3.0) is asked of it in any case.
    """
    return "native" if platform != "host" or fmi != "2.0" or has_compiler() else "python"


def export_fmu(
    model: DriveModel,
    path: str | os.PathLike[str],
    *,
    backend: str | None = None,
    platform: str = "host",
    masses: Masses | None = None,
    fmi: str = "2.0",
) -> Path:
    """Write `model` as an FMU to `path`, and return the path.

    masses: what turns on both sides makes it kind `joint`, torques in and angles out; without, kind `drive`.
    backend: "native" for co-simulation and model exchange without anything else, for `platform`: a name of
    `platforms.PLATFORMS`, "host", "all", or "none" for sources alone; "python" for co-simulation in a host that has a
    Python with this package (the binaries of pythonfmu for 64-bit Linux and Windows are inside). None: native where a
    compiler is there, else python, with a warning. fmi: version of the standard, "2.0" or, with the native back end,
    "3.0". An existing file is replaced; a failure leaves it as it was.
    Errors: `InputError` for a path that cannot be written, a unit FMI cannot express, an unknown back end or
    platform, or no compiler for the platform.
    """
    if backend is None:
        backend = default_backend(platform, fmi)
        if backend == "python":
            warnings.warn(NO_COMPILER, stacklevel=2)
    if backend not in BACKENDS:
        raise unknown_name("back end", backend, BACKENDS)
    if fmi not in FMI_VERSIONS:
        raise unknown_name("version of FMI", fmi, FMI_VERSIONS)
    expect(backend == "native" or fmi == "2.0", "FMI 3.0 with the native back end only", backend, "back end")
    make = _python_members if backend == "python" else functools.partial(_native_members, fmi=fmi)
    date = source_date(RELEASE_DATE)
    resources = _resources(model, masses)
    if masses is None:
        component = drive_component(model)
    else:
        from .model.joint import joint_component

        component = joint_component(model, masses)
    members = make(with_nominals(component), resources, date, platform)
    return write_archive(path, members, date)


def _python_members(
    component: Component, resources: dict[str, bytes], date: datetime, _platform: str
) -> dict[str, bytes]:
    """The archive of an FMU that runs in the installed package."""
    interface = declare(component)
    resources = {**resources, EQUATIONS_FILE: write_equations(component, interface)}
    export = _export(component, interface, resources, date, "python", _SLAVE_SCRIPT)
    # Two scripts of one name cannot both be loaded into a process: this one has the content's hash in its name.
    module = f"{export.model_identifier}_{export.guid.strip('{}').replace('-', '')[:12]}"
    script = _SLAVE_SCRIPT.format(identifier=module, guid=export.guid)
    return {
        DESCRIPTION: model_description(interface, export),
        f"resources/{module}.py": script.encode(),
        SCRIPT_NAME: module.encode(),
        **{f"resources/{name}": data for name, data in resources.items()},
        **_binaries(export.model_identifier),
        **_documentation(interface, export),
    }


def _native_members(
    component: Component, resources: dict[str, bytes], date: datetime, platform: str, fmi: str
) -> dict[str, bytes]:
    """The archive of an FMU in C. Its resources are for `reefmu check` and for people; no binary reads them."""
    platforms = () if platform == "none" else select_platforms(platform)
    interface = declare_with_derivatives(component)
    # The tables, where there are any, stand among the sources.
    resources = {name: data for name, data in resources.items() if name != LOOKUP_FILE}
    resources[METADATA_FILE] = lookup_metadata(embedded_lookup(component.model)).encode()
    identifier = _identifier(component)
    nameless = make_sources(component, interface, "", identifier, FMI_VERSIONS[fmi])
    if fmi != "2.0":
        nameless = fmi3_sources(nameless)
    without_guid = hashlib.sha256()
    for name, content in sorted(nameless.items()):
        without_guid.update(name.encode() + content)
    export = _export(component, interface, resources, date, "native", without_guid.hexdigest())
    files = with_guid(nameless, export.guid)
    members = {
        DESCRIPTION: model_description(interface, export),
        **{f"resources/{name}": data for name, data in resources.items()},
        **{f"sources/{name}": data for name, data in files.items()},
        **compile_binaries(files, export.model_identifier, platforms),
        **_documentation(interface, export),
    }
    return members if fmi == "2.0" else fmi3_members(members, interface, export)


def _export(
    component: Component, interface: Interface, resources: dict[str, bytes], date: datetime, backend: str, code: str
) -> ExportInfo:
    """Names, versions and capabilities. The GUID is a hash of the variables, the resources and the code."""
    version, native = _version("reefmu"), backend == "native"
    content = hashlib.sha256()
    for part in (repr(interface), version, code, date.isoformat()):
        content.update(part.encode())
    for name in sorted(resources):
        content.update(name.encode() + hashlib.sha256(resources[name]).digest())
    guid = uuid.UUID(bytes=content.digest()[:16], version=5)
    tool = f"CasADi {_version('casadi')}" if native else f"pythonfmu {_version('pythonfmu')}"
    return ExportInfo(
        guid=f"{{{guid}}}",
        model_identifier=_identifier(component),
        description=_describe(interface, version, backend),
        generation_tool=f"reefmu {version} with {tool}",
        generated=date.strftime("%Y-%m-%dT%H:%M:%SZ"),
        author=AUTHOR,
        version=version,
        copyright=COPYRIGHT,
        licence=LICENCE,
        backend=backend,
        capabilities=NATIVE_CAPABILITIES if native else CAPABILITIES,
        experiment=propose_experiment(component),
        exchange=EXCHANGE_CAPABILITIES if native else None,
        indicators=component.n_indicators if native else 0,
        sources=(MAIN_SOURCE,) if native else (),
    )


def _resources(model: DriveModel, masses: Masses | None) -> dict[str, bytes]:
    """The component as the package itself saves and loads it."""
    with scratch_folder() as folder:
        save_component(model, masses, folder)
        return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def _binaries(identifier: str) -> dict[str, bytes]:
    """pythonfmu's own libraries under the name the host will look for."""
    import pythonfmu

    source = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    files = [file for file in sorted(source.rglob("*")) if file.suffix in (".so", ".dll", ".dylib")]
    if not files:
        raise InputError(f"pythonfmu: expected its binaries in {source}, got none; install it again")
    return {f"binaries/{file.parent.name}/{identifier}{file.suffix}": file.read_bytes() for file in files}


def _describe(interface: Interface, version: str, backend: str) -> str:
    needs = (
        f"the host needs Python with reefmu {version} installed, and one in C libpython loaded: "
        "documentation/externalDependencies.txt"
        if backend == "python"
        else "directional derivatives and `stiffness` are those with the states held"
    )
    if interface.kind == "joint":
        return (
            f"Rolling element eccentric drive {interface.name} between the inertias of motor and load: torques in, "
            "angles out. Inputs are held constant over a communication step, which may have any length: the "
            f"joint takes as many steps of its own as it needs. Made by reefmu {version} ({LICENCE}); {needs}."
        )
    return (
        f"Rolling element eccentric drive {interface.name}: torque, stiffness and contact load over "
        "twist. Inputs are held constant over a communication step: after it the outputs are "
        "those of the inputs set before it, with the states advanced exactly over the step, so a step "
        f"may have any length. Made by reefmu {version} ({LICENCE}); {needs}."
    )


def _documentation(interface: Interface, export: ExportInfo) -> dict[str, bytes]:
    """A page for people, and the licences of what the archive contains."""
    rows = "".join(
        f"<tr><td>{escape(v.name)}</td><td>{v.causality}</td><td>{escape(v.unit)}</td>"
        f"<td>{escape(v.description)}</td></tr>\n"
        for v in interface.variables
    )
    name = escape(interface.name)
    page = (
        f'<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>{name}</title>\n'
        f"<h1>{name}</h1>\n<p>{escape(export.description)}</p>\n<table>\n"
        f"<tr><th>name</th><th>causality</th><th>unit</th><th>meaning</th></tr>\n{rows}</table>\n</html>\n"
    )
    members = {"documentation/index.html": page.encode()}
    if export.capabilities["needsExecutionTool"]:
        members |= external_dependencies(export.version, _version("casadi"), _version("pythonfmu"))
    # The standard's name for the licence of the whole (FMI 2.0.4, section 2.3; FMI 3.0.2, section 2.5.1).
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


def _identifier(component: Component) -> str:
    """modelIdentifier: the same however often the model is exported. A joint is told from the drive inside."""
    return _c_name(component.name) + ("_joint" if component.kind == "joint" else "")


def _c_name(name: str) -> str:
    """`name` as part of a C and Python identifier; not too long, because hosts build file names with it."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:40] or "drive"
    return plain if plain[0].isalpha() else f"m_{plain}"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:  # run from the source tree
        return "0+unknown"
