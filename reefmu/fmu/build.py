"""Export: a drive model becomes an FMU that the installed package runs through pythonfmu.

The same model exported twice with the same version gives the same bytes. So nothing in the file comes from
the clock: the GUID is a hash of the content, and the date is SOURCE_DATE_EPOCH where that is set
(reproducible-builds.org), else `RELEASED`, a date that stands for this version of the export.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import re
import tempfile
import uuid
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from stiffness_model.errors import InputError

from .archive import DESCRIPTION, LOOKUP_FILE, MODEL_FILE, SCRIPT_NAME, write_archive
from .description import Export, model_description
from .interface import Interface, declare_drive

if TYPE_CHECKING:
    from reefmu.model import DriveModel

RELEASED = datetime(2026, 1, 1, tzinfo=UTC)
LICENCE = "BSD-3-Clause"
CAPABILITIES = {
    "needsExecutionTool": False,
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
_SCRIPT = '''"""Runs in the installed package. Its names keep it apart from other FMUs in the process."""
from reefmu.fmu.slave import DriveSlave
from reefmu.fmu.workarounds import hold

hold(globals())


class {identifier}(DriveSlave):
    fmu_guid = "{guid}"
    layout = "{layout}"
'''


def export_fmu(model: DriveModel, path: str | os.PathLike[str]) -> Path:
    """Write `model` as an FMI 2.0 co-simulation FMU of kind `drive` to `path`, and return the path.

    The FMU holds the model, its lookup and the binaries of pythonfmu for 64-bit Linux and Windows; its host
    needs a Python with this package. An existing file is replaced; a failure leaves it as it was.
    Errors: `InputError` for a path that cannot be written or a unit FMI cannot express.
    """
    version = _version("reefmu")
    when = _date()
    interface = declare_drive(model)
    resources = _resources(model)
    content = hashlib.sha256()
    for part in (repr(interface), version, _SCRIPT, when.isoformat()):
        content.update(part.encode())
    for name in sorted(resources):
        content.update(name.encode() + hashlib.sha256(resources[name]).digest())
    guid = uuid.UUID(bytes=content.digest()[:16], version=5)
    identifier = f"{_c_name(model.name)}_{guid.hex[:12]}"
    export = Export(
        guid=f"{{{guid}}}",
        model_identifier=identifier,
        description=_describe(interface, version),
        generation_tool=f"reefmu {version} with pythonfmu {_version('pythonfmu')}",
        generated=when.strftime("%Y-%m-%dT%H:%M:%SZ"),
        version=version,
        licence=LICENCE,
        backend="python",
        capabilities=CAPABILITIES,
    )
    script = _SCRIPT.format(identifier=identifier, guid=export.guid, layout=interface.digest)
    members = {
        DESCRIPTION: model_description(interface, export),
        f"resources/{identifier}.py": script.encode(),
        SCRIPT_NAME: identifier.encode(),
        **{f"resources/{name}": data for name, data in resources.items()},
        **_binaries(identifier),
        **_documentation(interface, export),
    }
    return write_archive(path, members, when)


def _resources(model: DriveModel) -> dict[str, bytes]:
    """The model as the package itself saves and loads it."""
    from reefmu.model_file import save_model

    with tempfile.TemporaryDirectory(prefix="reefmu-export-") as folder:
        model_file, lookup_file = Path(folder, MODEL_FILE), Path(folder, LOOKUP_FILE)
        save_model(model, model_file)
        model.lookup.save(lookup_file)
        return {file.name: file.read_bytes() for file in (model_file, lookup_file)}


def _binaries(identifier: str) -> dict[str, bytes]:
    """pythonfmu's own libraries under the name the host will look for."""
    import pythonfmu

    source = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    files = [file for file in sorted(source.rglob("*")) if file.suffix in (".so", ".dll", ".dylib")]
    if not files:
        raise InputError(f"pythonfmu: expected its binaries in {source}, got none; install it again")
    return {f"binaries/{file.parent.name}/{identifier}{file.suffix}": file.read_bytes() for file in files}


def _describe(interface: Interface, version: str) -> str:
    return (f"Rolling element eccentric drive {interface.name}: torque, stiffness and contact load over "
            "twist. Inputs are held constant over a communication step: after fmi2DoStep the outputs are "
            "those of the inputs set before it, with the states advanced exactly over the step, so a step "
            f"may have any length. Made by reefmu {version} ({LICENCE}); the host needs Python with reefmu "
            f"{version} installed.")


def _documentation(interface: Interface, export: Export) -> dict[str, bytes]:
    """A page for people, and the licences of what the archive contains."""
    rows = "".join(
        f"<tr><td>{escape(v.name)}</td><td>{v.causality}</td><td>{escape(v.unit)}</td>"
        f"<td>{escape(v.description)}</td></tr>\n" for v in interface.variables)
    name = escape(interface.name)
    page = (f"<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{name}</title>\n"
            f"<h1>{name}</h1>\n<p>{escape(export.description)}</p>\n<table>\n"
            f"<tr><th>name</th><th>causality</th><th>unit</th><th>meaning</th></tr>\n{rows}</table>\n</html>\n")
    members = {"documentation/index.html": page.encode()}
    for package in ("reefmu", "pythonfmu"):
        try:
            files = importlib.metadata.files(package) or []
        except importlib.metadata.PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE") and ".dist-info" in str(file):
                members[f"documentation/licenses/{package}.txt"] = Path(str(file.locate())).read_bytes()
    return members


def _c_name(name: str) -> str:
    """`name` as part of a C and Python identifier; not too long, because hosts build file names with it."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:40] or "drive"
    return plain if plain[0].isalpha() else f"m_{plain}"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:  # run from the source tree
        return "0+unknown"


def _date() -> datetime:
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch:
        return RELEASED
    try:
        return datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError, OSError):
        raise InputError(f"SOURCE_DATE_EPOCH: expected seconds since 1970, got {epoch!r}") from None
