"""Export: a drive model becomes an FMU, by one of two back ends.

native: binaries compiled from generated C, which need nothing else. python: pythonfmu's binaries, behind which the
installed package runs. The same model exported twice with the same versions (and compiler) gives the same bytes. To
that end nothing in the file depends on the clock: the GUID is a hash of the content, and the date is SOURCE_DATE_EPOCH
where that is set, else `metadata.RELEASE_DATE`.
"""

from __future__ import annotations

import functools
import hashlib
import os
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from reefmu.source_date import source_date
from stiffness_model.errors import InputError, expect, install_command, unknown_name
from stiffness_model.io.atomic_files import scratch_folder

from .codegen.compile import compile_binaries, has_compiler, select_platforms
from .codegen.sources import make_sources, with_guid
from .documentation.members import documentation
from .documentation.web_assembly import compile_module
from .export_fmi3 import fmi3_members, fmi3_sources
from .metadata import RELEASE_DATE, export_info, model_identifier
from .model.component import LOOKUP_FILE, METADATA_FILE, Component, drive_component, save_component
from .model.declaration import declare, declare_with_derivatives
from .model.nominals import with_nominals
from .model.presets import Preset, loaded_preset, loaded_presets, presets
from .model.table_encoding import embedded_lookup, lookup_metadata
from .model.variables import FMI_VERSIONS, Interface
from .python_backend.equations_file import EQUATIONS_FILE, write_equations
from .related_files import related_members
from .xml.archive import DESCRIPTION, SCRIPT_NAME, write_archive
from .xml.description import ExportInfo
from .xml.fmi2 import model_description

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses

BACKENDS = ("python", "native")
NO_COMPILER = (
    "no C compiler here: the FMU runs in Python, and its host needs a Python with this package; "
    f"{install_command('native')} brings a compiler, and with it FMUs that need nothing"
)
_SLAVE_SCRIPT = '''"""Runs in the installed package. The class name distinguishes it from other FMUs in the process."""
from reefmu.fmu.python_backend.slave import DriveSlave
from reefmu.fmu.python_backend.workarounds import leak_reference

leak_reference(globals())


class {identifier}(DriveSlave):
    fmu_guid = "{guid}"
'''


def default_backend(platform: str = "host", fmi: str = "2.0") -> str:
    """The back end if none is chosen: "native" where there is a compiler, else "python".

    It is "native" in any case for what only that back end offers: another platform, sources alone, FMI 3.0.
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
    interactive: bool = True,
    load: float | None = None,
) -> Path:
    """Write `model` as an FMU to `path`, and return the path.

    masses: inertias and dampings of motor and load for kind `joint`, with torques as inputs and angles as outputs;
    None for kind `drive`. backend: "native" for co-simulation and model exchange without further requirements, "python"
    for co-simulation in a host that has a Python with this package (pythonfmu's binaries for 64-bit Linux and Windows
    are inside); None for native where there is a compiler, else python, with a warning. platform (native only): a
    name of `codegen.compile.PLATFORMS`, "host", "all", or "none" for sources alone. fmi: version of the standard, "2.0"
    or, with the native back end, "3.0". interactive: whether the page in `documentation` runs the drive, which takes
    the native back end and ziglang. load: N.m on the output, under which a simulation with the parameter set loaded.ssv
    starts in equilibrium; None for half the full torque, where the drive reaches it. An existing file is replaced; a
    failure leaves it as it was.
    Errors: `InputError` for a path that cannot be written, a unit that FMI cannot express, an unknown back end or
    platform, a platform without a compiler, or a load that the drive does not reach.
    """
    content = fmu_content(
        model, backend=backend, platform=platform, masses=masses, fmi=fmi, interactive=interactive, load=load
    )
    return write_archive(path, content.members, source_date(RELEASE_DATE))


class FmuContent(NamedTuple):
    """An FMU before it is written. members: content by name in the archive."""

    members: dict[str, bytes]
    component: Component
    interface: Interface
    export: ExportInfo


def fmu_content(
    model: DriveModel,
    *,
    backend: str | None = None,
    platform: str = "host",
    masses: Masses | None = None,
    fmi: str = "2.0",
    interactive: bool = True,
    load: float | None = None,
) -> FmuContent:
    """The content of an FMU. Arguments and errors as of `export_fmu`."""
    if backend is None:
        backend = default_backend(platform, fmi)
        if backend == "python":
            warnings.warn(NO_COMPILER, stacklevel=2)
    if backend not in BACKENDS:
        raise unknown_name("back end", backend, BACKENDS)
    if fmi not in FMI_VERSIONS:
        raise unknown_name("version of FMI", fmi, FMI_VERSIONS)
    expect(backend == "native" or fmi == "2.0", "FMI 3.0 with the native back end only", backend, "back end")
    make = (
        _python_content
        if backend == "python"
        else functools.partial(_native_content, platform=platform, fmi=fmi, interactive=interactive)
    )
    date = source_date(RELEASE_DATE)
    resources = _resources(model, masses)
    if masses is None:
        component = drive_component(model)
    else:
        from .model.joint_component import joint_component

        component = joint_component(model, masses)
    component = with_nominals(component)
    sets = presets(component)
    # A load out of reach is refused before anything is compiled.
    loaded = loaded_presets(component, sets[0]) if load is None else (loaded_preset(component, sets[0], load),)
    return make(component, resources, date, (*sets, *loaded))


def _python_content(
    component: Component, resources: dict[str, bytes], date: datetime, sets: Sequence[Preset]
) -> FmuContent:
    """The content of an FMU that runs in the installed package."""
    interface = declare(component)
    resources = {**resources, EQUATIONS_FILE: write_equations(component, interface)}
    export = export_info(component, interface, resources, date, "python", _SLAVE_SCRIPT)
    # A process cannot load two scripts of the same name, so the name contains the hash of the content.
    module = f"{export.model_identifier}_{export.guid.strip('{}').replace('-', '')[:12]}"
    script = _SLAVE_SCRIPT.format(identifier=module, guid=export.guid)
    members = {
        DESCRIPTION: model_description(interface, export),
        f"resources/{module}.py": script.encode(),
        SCRIPT_NAME: module.encode(),
        **{f"resources/{name}": data for name, data in resources.items()},
        **_pythonfmu_binaries(export.model_identifier),
        **documentation(component, interface, export, None),
        **related_members(component, interface, export, sets),
    }
    return FmuContent(members, component, interface, export)


def _native_content(
    component: Component,
    resources: dict[str, bytes],
    date: datetime,
    sets: Sequence[Preset],
    *,
    platform: str,
    fmi: str,
    interactive: bool,
) -> FmuContent:
    """The content of an FMU in C. Its resources serve `reefmu check` and readers; no binary uses them."""
    platforms = () if platform == "none" else select_platforms(platform)
    interface = declare_with_derivatives(component)
    # The sources contain the tables, so the lookup file is left out.
    resources = {name: data for name, data in resources.items() if name != LOOKUP_FILE}
    resources[METADATA_FILE] = lookup_metadata(embedded_lookup(component.model)).encode()
    sources = make_sources(component, interface, "", model_identifier(component), FMI_VERSIONS[fmi])
    if fmi != "2.0":
        sources = fmi3_sources(sources)
    digest = hashlib.sha256()  # of the sources without the GUID, which depends on it
    for name, content in sorted(sources.items()):
        digest.update(name.encode() + content)
    export = export_info(component, interface, resources, date, "native", digest.hexdigest())
    sources = with_guid(sources, export.guid)
    with ThreadPoolExecutor(1) as pool:
        page = pool.submit(compile_module, _page_sources(component)) if interactive else None
        binaries = compile_binaries(
            sources, export.model_identifier, platforms, {} if page is None else {page: "page of the FMU"}
        )
    members = {
        DESCRIPTION: model_description(interface, export),
        **{f"resources/{name}": data for name, data in resources.items()},
        **{f"sources/{name}": data for name, data in sources.items()},
        **binaries,
        **documentation(component, interface, export, None if page is None else page.result()),
    }
    members |= related_members(component, interface, export, sets)
    members = members if fmi == "2.0" else fmi3_members(members, interface, export)
    return FmuContent(members, component, interface, export)


def _page_sources(component: Component) -> dict[str, bytes]:
    """The sources of the drive for its page, which also describes the drive inside a joint."""
    drive = drive_component(component.model, start=False)
    return make_sources(drive, declare_with_derivatives(drive), "", "web")


def _resources(model: DriveModel, masses: Masses | None) -> dict[str, bytes]:
    """The component as the package itself saves and loads it."""
    with scratch_folder() as folder:
        save_component(model, masses, folder)
        return {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


def _pythonfmu_binaries(identifier: str) -> dict[str, bytes]:
    """pythonfmu's libraries under the names that a host expects."""
    import pythonfmu

    source = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    files = [file for file in sorted(source.rglob("*")) if file.suffix in (".so", ".dll", ".dylib")]
    if not files:
        raise InputError(f"pythonfmu: expected its binaries in {source}, got none; install it again")
    return {f"binaries/{file.parent.name}/{identifier}{file.suffix}": file.read_bytes() for file in files}
