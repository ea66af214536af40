"""modelDescription.xml from the declared interface (FMI 2.0.4, section 2.2). The same for every back end."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .interface import Interface, Variable
from .units import base_unit

TOOL = "reefmu"
"""Name under which this package marks its FMUs (VendorAnnotations)."""

_TYPES = {
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
class Export:
    """What a description says beside the variables.

    generated: "2026-01-01T00:00:00Z"; capabilities: attributes of the CoSimulation element; backend: "python"
    for a slave that runs in the installed package.
    """

    guid: str
    model_identifier: str
    description: str
    generation_tool: str
    generated: str
    version: str
    licence: str
    backend: str
    capabilities: Mapping[str, bool]
    stop_time: float = 1.0
    step_size: float = 1e-3


def model_description(interface: Interface, export: Export) -> bytes:
    """The whole file, UTF-8, in the order the schema prescribes. Errors: `InputError` for an unknown unit."""
    root = Element("fmiModelDescription", {
        "fmiVersion": "2.0",
        "modelName": _text(interface.name),
        "guid": export.guid,
        "description": _text(export.description),
        "version": export.version,
        "license": export.licence,
        "generationTool": export.generation_tool,
        "generationDateAndTime": export.generated,
        "variableNamingConvention": "structured",
        "numberOfEventIndicators": "0",
    })
    SubElement(root, "CoSimulation", {
        "modelIdentifier": export.model_identifier,
        **{name: str(value).lower() for name, value in export.capabilities.items()},
    })
    _units(root, interface)
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": meaning})
    SubElement(root, "DefaultExperiment", {
        "startTime": "0.0", "stopTime": repr(export.stop_time), "stepSize": repr(export.step_size)})
    tool = SubElement(SubElement(root, "VendorAnnotations"), "Tool", {"name": TOOL})
    SubElement(tool, "fmu", {
        "kind": interface.kind, "backend": export.backend, "interface": interface.digest})
    variables = SubElement(root, "ModelVariables")
    for variable in interface.variables:
        _variable(variables, variable)
    _structure(root, interface)
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _units(root: Element, interface: Interface) -> None:
    """UnitDefinitions and TypeDefinitions for the units that occur (sections 2.2.2 and 2.2.3)."""
    used = sorted({v.unit for v in interface.variables})
    definitions = SubElement(root, "UnitDefinitions")
    for name in used:
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
    typed = [name for name in used if name in _TYPES]
    if typed:
        types = SubElement(root, "TypeDefinitions")
        for name in typed:
            type_name, quantity = _TYPES[name]
            simple = SubElement(types, "SimpleType", {"name": type_name})
            SubElement(simple, "Real", {**({"quantity": quantity} if quantity else {}), "unit": name})


def _variable(parent: Element, variable: Variable) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": _text(variable.description),
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    real: dict[str, str] = {}
    if variable.unit in _TYPES:
        real["declaredType"] = _TYPES[variable.unit][0]
    real["unit"] = variable.unit
    for key, value in (("min", variable.minimum), ("max", variable.maximum), ("nominal", variable.nominal),
                       ("start", variable.start)):
        if value is not None:
            real[key] = repr(value)
    SubElement(SubElement(parent, "ScalarVariable", attributes), "Real", real)


def _structure(root: Element, interface: Interface) -> None:
    """ModelStructure: outputs and initial unknowns with what they depend on (section 2.2.8)."""
    def index(name: str) -> str:
        return str(interface[name].reference + 1)  # the schema counts variables from one

    structure = SubElement(root, "ModelStructure")
    for tag in ("Outputs", "InitialUnknowns"):
        unknowns = SubElement(structure, tag)
        for variable in interface.block("output"):
            names = variable.dependencies if tag == "Outputs" else variable.initial_dependencies
            SubElement(unknowns, "Unknown", {
                "index": index(variable.name), "dependencies": " ".join(index(name) for name in names)})


def _text(text: str) -> str:
    """`text` without the characters XML 1.0 has no way to write."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)
