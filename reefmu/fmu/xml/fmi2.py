"""modelDescription.xml from the declared interface (FMI 2.0.4, section 2.2). The same for every back end."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..model.base_units import base_unit
from ..model.nominals import Experiment
from ..model.variables import Interface, Variable

TOOL = "reefmu"
"""Name under which this package marks its FMUs (VendorAnnotations)."""

TYPES = {
    "rad": ("Angle", "Angle"),
    "rad/s": ("AngularVelocity", "AngularVelocity"),
    "N.m": ("Torque", "Torque"),
    "N.m/rad": ("RotationalStiffness", "RotationalStiffness"),
    "N": ("Force", "Force"),
    "degC": ("TemperatureCelsius", "ThermodynamicTemperature"),
    "m": ("Length", "Length"),
    "s": ("Time", "Time"),
    "1": ("Dimensionless", ""),
}
"""unit -> (declared type, quantity)."""
_DISPLAY = {
    "rad": {"deg": 180 / math.pi, "arcmin": 10800 / math.pi},
    "rad/s": {"rev/min": 30 / math.pi, "deg/s": 180 / math.pi},
    "N.m/rad": {"N.m/arcmin": math.pi / 10800},
    "m": {"mm": 1e3, "um": 1e6},
}
"""unit -> display unit -> factor; display value = factor * value."""
LOG_CATEGORIES = {
    "logStatusWarning": "Messages with status fmi2Warning.",
    "logStatusDiscard": "Messages with status fmi2Discard.",
    "logStatusError": "Messages with status fmi2Error.",
    "logStatusFatal": "Messages with status fmi2Fatal.",
    "logAll": "All messages.",
}


@dataclass(frozen=True)
class ExportInfo:
    """What a description says beside the variables.

    generated: "2026-01-01T00:00:00Z"; capabilities: attributes of the CoSimulation element; backend: "python"
    for a slave that runs in the installed package, "native" for one in C. exchange: attributes of the
    ModelExchange element, None without one; sources: files in `sources` that make the binary.
    """

    guid: str
    model_identifier: str
    description: str
    generation_tool: str
    generated: str
    author: str
    version: str
    copyright: str
    licence: str
    backend: str
    capabilities: Mapping[str, bool]
    experiment: Experiment
    exchange: Mapping[str, bool] | None = None
    indicators: int = 0
    sources: tuple[str, ...] = ()


def model_description(interface: Interface, export: ExportInfo) -> bytes:
    """The whole file, UTF-8, in the order the schema prescribes. Errors: `InputError` for an unknown unit."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": plain_text(interface.name),
            "guid": export.guid,
            "description": plain_text(export.description),
            "author": export.author,
            "version": export.version,
            "copyright": export.copyright,
            "license": export.licence,
            "generationTool": export.generation_tool,
            "generationDateAndTime": export.generated,
            "variableNamingConvention": "structured",
            "numberOfEventIndicators": str(export.indicators),
        },
    )
    for tag, capabilities in (("ModelExchange", export.exchange), ("CoSimulation", export.capabilities)):
        if capabilities is not None:
            _kind(root, tag, capabilities, export)
    unit_definitions(root, interface)
    _types(root, interface)
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": meaning})
    SubElement(root, "DefaultExperiment", default_experiment(export))
    tool = SubElement(SubElement(root, "VendorAnnotations"), "Tool", {"name": TOOL})
    SubElement(tool, "fmu", {"kind": interface.kind, "backend": export.backend, "interface": interface.digest})
    variables = SubElement(root, "ModelVariables")
    for variable in interface.variables:
        _variable(variables, variable, interface)
    _structure(root, interface)
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def default_experiment(export: ExportInfo) -> dict[str, str]:
    """Attributes of DefaultExperiment, the same in FMI 3.0."""
    proposed = export.experiment
    return {
        "startTime": "0.0",
        "stopTime": repr(proposed.stop_time),
        "tolerance": repr(proposed.tolerance),
        "stepSize": repr(proposed.step_size),
    }


def _kind(root: Element, tag: str, capabilities: Mapping[str, bool], export: ExportInfo) -> None:
    """What the FMU can do as this kind, and the sources to build it from (sections 3.3.1 and 4.3.1)."""
    element = SubElement(
        root,
        tag,
        {
            "modelIdentifier": export.model_identifier,
            **{name: str(value).lower() for name, value in capabilities.items()},
        },
    )
    if export.sources:
        files = SubElement(element, "SourceFiles")
        for name in export.sources:
            SubElement(files, "File", {"name": name})


def unit_definitions(root: Element, interface: Interface) -> None:
    """UnitDefinitions for the units that occur (section 2.2.2; the same in FMI 3.0)."""
    definitions = SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in interface.variables}):
        base = base_unit(name)
        unit = SubElement(definitions, "Unit", {"name": name})
        attributes = {dimension: str(exponent) for dimension, exponent in base.exponents}
        if base.factor != 1.0:
            attributes["factor"] = repr(base.factor)
        if base.offset != 0.0:
            attributes["offset"] = repr(base.offset)
        SubElement(unit, "BaseUnit", attributes)
        for display, factor in _DISPLAY.get(name, {}).items():
            SubElement(unit, "DisplayUnit", {"name": display, "factor": repr(factor)})


def type_names(interface: Interface) -> dict[str, tuple[str, str]]:
    """Declared type and quantity of the units that occur and have one."""
    return {unit: TYPES[unit] for unit in sorted({v.unit for v in interface.variables}) if unit in TYPES}


def _types(root: Element, interface: Interface) -> None:
    """TypeDefinitions (section 2.2.3)."""
    named = type_names(interface)
    if named:
        types = SubElement(root, "TypeDefinitions")
        for unit, (type_name, quantity) in named.items():
            simple = SubElement(types, "SimpleType", {"name": type_name})
            SubElement(simple, "Real", {**({"quantity": quantity} if quantity else {}), "unit": unit})


def _variable(parent: Element, variable: Variable, interface: Interface) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": plain_text(variable.description),
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    real: dict[str, str] = {}
    if variable.unit in TYPES:
        real["declaredType"] = TYPES[variable.unit][0]
    real["unit"] = variable.unit
    for key, value in (
        ("min", variable.minimum),
        ("max", variable.maximum),
        ("nominal", variable.nominal),
        ("start", variable.start),
    ):
        if value is not None:
            real[key] = repr(value)
    if variable.derivative_of:
        real["derivative"] = _index(interface, variable.derivative_of)
    if variable.reinit:
        real["reinit"] = "true"
    SubElement(SubElement(parent, "ScalarVariable", attributes), "Real", real)


def _structure(root: Element, interface: Interface) -> None:
    """ModelStructure: outputs and initial unknowns with what they depend on (section 2.2.8)."""
    unknowns = {"Outputs": interface.block("output")}
    if interface.derivatives:
        unknowns["Derivatives"] = interface.derivatives
    unknowns["InitialUnknowns"] = interface.block("output")
    if interface.derivatives:
        unknowns["InitialUnknowns"] += interface.block("local") + interface.derivatives
    structure = SubElement(root, "ModelStructure")
    for tag, variables in unknowns.items():
        element = SubElement(structure, tag)
        for variable in variables:
            names = variable.initial_dependencies if tag == "InitialUnknowns" else variable.dependencies
            SubElement(
                element,
                "Unknown",
                {
                    "index": _index(interface, variable.name),
                    "dependencies": " ".join(_index(interface, name) for name in names),
                },
            )


def _index(interface: Interface, name: str) -> str:
    """The place of a variable among all; the schema counts from one."""
    return str(interface[name].reference + 1)


def plain_text(text: str) -> str:
    """`text` without the characters XML 1.0 has no way to write."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)
