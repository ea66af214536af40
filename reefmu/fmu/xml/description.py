"""What the model descriptions of FMI 2.0 and FMI 3.0 have in common: header, units, types and attributes."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from stiffness_model.units import DISPLAY_UNITS

from ..model.base_units import base_unit
from ..model.nominals import Experiment
from ..model.variables import Interface, Variable

TOOL = "reefmu"
"""Name of this package in the vendor annotations, by which it recognises its own FMUs."""

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
_DISPLAY_UNITS = {
    **{unit: {name: 1 / size} for unit, (size, name) in DISPLAY_UNITS.items()},
    "rad": {"deg": 180 / math.pi, "arcmin": 10800 / math.pi},
    "rad/s": {"rev/min": 30 / math.pi, "deg/s": 180 / math.pi},
    "m": {"mm": 1e3, "um": 1e6},
}
"""unit -> display unit -> factor; display value = factor * value."""
_LOG_CATEGORIES = {
    "logStatusWarning": "Messages with status {fmi}Warning.",
    "logStatusDiscard": "Messages with status {fmi}Discard.",
    "logStatusError": "Messages with status {fmi}Error.",
    "logStatusFatal": "Messages with status {fmi}Fatal.",
    "logAll": "All messages.",
}


@dataclass(frozen=True)
class ExportInfo:
    """The content of a model description apart from the variables.

    generated: date and time such as "2026-01-01T00:00:00Z"; backend: "python" or "native"; capabilities: attributes
    of the CoSimulation element of FMI 2.0; exchange: attributes of its ModelExchange element, None without one;
    indicators: number of event indicators; sources: files in `sources` to compile.
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


def root_element(fmi_version: str, guid_attribute: str, interface: Interface, export: ExportInfo) -> Element:
    """The element fmiModelDescription with the attributes that both versions have."""
    return Element(
        "fmiModelDescription",
        {
            "fmiVersion": fmi_version,
            "modelName": plain_text(interface.name),
            guid_attribute: export.guid,
            "description": plain_text(export.description),
            "author": export.author,
            "version": export.version,
            "copyright": export.copyright,
            "license": export.licence,
            "generationTool": export.generation_tool,
            "generationDateAndTime": export.generated,
            "variableNamingConvention": "structured",
        },
    )


def add_interface_type(root: Element, tag: str, capabilities: Mapping[str, bool], export: ExportInfo) -> Element:
    """The element ModelExchange or CoSimulation with its capability flags."""
    flags = {name: str(value).lower() for name, value in capabilities.items()}
    return SubElement(root, tag, {"modelIdentifier": export.model_identifier, **flags})


def add_unit_definitions(root: Element, interface: Interface) -> None:
    """UnitDefinitions of the units that occur (FMI 2.0.4, section 2.2.2). Errors: `InputError` for an unknown unit."""
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
        for display, factor in _DISPLAY_UNITS.get(name, {}).items():
            SubElement(unit, "DisplayUnit", {"name": display, "factor": repr(factor)})


def add_type_definitions(
    root: Element, interface: Interface, add_type: Callable[[Element, str, dict[str, str]], object]
) -> None:
    """TypeDefinitions of the units that occur (section 2.2.3). add_type(parent, name, attributes) adds one of them."""
    units = [unit for unit in sorted({v.unit for v in interface.variables}) if unit in TYPES]
    if units:
        types = SubElement(root, "TypeDefinitions")
        for unit in units:
            name, quantity = TYPES[unit]
            add_type(types, name, {**({"quantity": quantity} if quantity else {}), "unit": unit})


def add_log_categories(root: Element, fmi: str) -> None:
    """LogCategories; fmi: prefix of the names of the statuses, "fmi2" or "fmi3"."""
    categories = SubElement(root, "LogCategories")
    for name, meaning in _LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": meaning.format(fmi=fmi)})


def add_default_experiment(root: Element, export: ExportInfo) -> None:
    """DefaultExperiment: from 0 s, with the stop time, step size and tolerance of `export.experiment`."""
    proposed = export.experiment
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0.0",
            "stopTime": repr(proposed.stop_time),
            "tolerance": repr(proposed.tolerance),
            "stepSize": repr(proposed.step_size),
        },
    )


def add_tool_annotation(parent: Element, interface: Interface, export: ExportInfo) -> None:
    """Kind, back end and digest of the interface, by which this package recognises its own FMUs."""
    SubElement(parent, "fmu", {"kind": interface.kind, "backend": export.backend, "interface": interface.digest})


def general_attributes(variable: Variable, value_reference: str) -> dict[str, str]:
    """Attributes of a variable that do not depend on its type."""
    attributes = {
        "name": variable.name,
        "valueReference": value_reference,
        "description": plain_text(variable.description),
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    return attributes


def numeric_attributes(variable: Variable) -> dict[str, str]:
    """min, max, nominal and start, as far as they are given."""
    values = {"min": variable.minimum, "max": variable.maximum, "nominal": variable.nominal, "start": variable.start}
    return {key: repr(value) for key, value in values.items() if value is not None}


def display_unit(variable: Variable) -> dict[str, str]:
    """The attribute displayUnit, where the unit has display units: angles of shafts in deg, of twists in arcmin."""
    if variable.unit == "rad":
        return {"displayUnit": "deg" if variable.name.endswith((".phi", "reference")) else "arcmin"}
    if variable.unit == "rad/s":
        return {"displayUnit": "rev/min" if variable.name.startswith(("crank", "motor")) else "deg/s"}
    return {"displayUnit": DISPLAY_UNITS[variable.unit][1]} if variable.unit in DISPLAY_UNITS else {}


def unit_attributes(unit: str) -> dict[str, str]:
    """The declared type, where `TYPES` has one, and the unit."""
    return {**({"declaredType": TYPES[unit][0]} if unit in TYPES else {}), "unit": unit}


def plain_text(text: str) -> str:
    """`text` with "?" in place of the characters that XML 1.0 does not allow."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)


def to_bytes(root: Element) -> bytes:
    """The document, indented, UTF-8."""
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
