"""What an exported FMU states about itself: names, versions, GUID, capabilities and its description."""

from __future__ import annotations

import hashlib
import importlib.metadata
import re
import uuid
from collections.abc import Mapping
from datetime import UTC, datetime

from stiffness_model.kinds import kind_of_table

from .codegen.sources import MAIN_SOURCE
from .model.component import Component
from .model.nominals import propose_experiment
from .model.variables import Interface
from .xml.description import ExportInfo

RELEASE_DATE = datetime(2026, 1, 1, tzinfo=UTC)
"""Date of an FMU where SOURCE_DATE_EPOCH is not set: fixed for this version, so that exports are reproducible."""
LICENCE = "BSD-3-Clause"
AUTHOR, COPYRIGHT = "the reefmu authors", "Copyright (c) 2026, the reefmu authors"
"""Of the code inside, as in the licence; the model itself belongs to the owner of the drawing."""
CAPABILITIES = {
    "needsExecutionTool": True,
    "canHandleVariableCommunicationStepSize": True,
    "canInterpolateInputs": False,
    "canRunAsynchronuously": False,  # the spelling of the schema
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": False,
}
"""Co-simulation by the Python back end: pythonfmu's binary with `slave.DriveSlave` (FMI 2.0.4, section 4.3.1)."""
NATIVE_CAPABILITIES = {
    **CAPABILITIES,
    "needsExecutionTool": False,
    "canNotUseMemoryManagementFunctions": False,
    "providesDirectionalDerivative": True,
}
"""Co-simulation by the generated C."""
EXCHANGE_CAPABILITIES = {
    "needsExecutionTool": False,
    "completedIntegratorStepNotNeeded": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": True,
}
"""Model exchange by the generated C (FMI 2.0.4, section 3.3.1)."""


def export_info(
    component: Component,
    interface: Interface,
    resources: Mapping[str, bytes],
    date: datetime,
    backend: str,
    code: str,
) -> ExportInfo:
    """Names, versions and capabilities of an export.

    The GUID is a hash of interface, version, date, resources and `code`, a text that identifies the code inside.
    """
    version, native = package_version("reefmu"), backend == "native"
    content = hashlib.sha256()
    for part in (repr(interface), version, code, date.isoformat()):
        content.update(part.encode())
    for name in sorted(resources):
        content.update(name.encode() + hashlib.sha256(resources[name]).digest())
    guid = uuid.UUID(bytes=content.digest()[:16], version=5)
    tool = f"CasADi {package_version('casadi')}" if native else f"pythonfmu {package_version('pythonfmu')}"
    return ExportInfo(
        guid=f"{{{guid}}}",
        model_identifier=model_identifier(component),
        description=_description(component, interface, version, backend),
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


def _description(component: Component, interface: Interface, version: str, backend: str) -> str:
    lookup = component.model.lookup
    kind = "Gear" if lookup.drive_table is None else kind_of_table(lookup.drive_table, component.name).title
    drive = f"{kind} {interface.name}"
    results = "torque, stiffness and contact load" if lookup.has_contacts else "torque and stiffness"
    remark = (
        f"the host needs Python with reefmu {version} installed, and a host in C must have loaded libpython: "
        "documentation/externalDependencies.txt"
        if backend == "python"
        else "directional derivatives and `stiffness` are those at constant states"
    )
    made_by = f"Made by reefmu {version} ({LICENCE}); {remark}."
    if interface.kind == "joint":
        return (
            f"{drive} between the inertias of motor and load: torques in, "
            "angles out. Inputs are held constant over a communication step, which may have any length: the "
            f"joint divides it into as many substeps as it needs. {made_by}"
        )
    return (
        f"{drive}: {results} over twist. Inputs are "
        "held constant over a communication step: after it the outputs are those of the inputs set before it, with "
        "the states advanced exactly over the step. With prescribed inputs a step may have any length; coupled with "
        "masses it must be short, and `reefmu check FILE.fmu --inertia J --step H` says how short. "
        f"{made_by}"
    )


def model_identifier(component: Component) -> str:
    """modelIdentifier: the same for every export of a model; a joint's differs from that of the drive inside."""
    return _c_name(component.name) + ("_joint" if component.kind == "joint" else "")


def _c_name(name: str) -> str:
    """`name` as a C and Python identifier of at most 42 characters, because hosts build file names with it."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:40] or "drive"
    return plain if plain[0].isalpha() else f"m_{plain}"


def package_version(package: str) -> str:
    """Version of an installed package; "0+unknown" for one that runs from its source tree."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "0+unknown"
