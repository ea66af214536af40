"""modelDescription.xml for FMI 2.0 (FMI 2.0.4, section 2.2), the same for both back ends."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from ..model.variables import Interface, Variable
from .description import (
    TOOL,
    ExportInfo,
    add_default_experiment,
    add_interface_type,
    add_log_categories,
    add_tool_annotation,
    add_type_definitions,
    add_unit_definitions,
    display_unit,
    general_attributes,
    numeric_attributes,
    root_element,
    to_bytes,
    unit_attributes,
)


def model_description(interface: Interface, export: ExportInfo) -> bytes:
    """The whole file, UTF-8, in the order the schema prescribes. Errors: `InputError` for an unknown unit."""
    root = root_element("2.0", "guid", interface, export)
    root.set("numberOfEventIndicators", str(export.indicators))
    for tag, capabilities in (("ModelExchange", export.exchange), ("CoSimulation", export.capabilities)):
        if capabilities is not None:
            element = add_interface_type(root, tag, capabilities, export)
            if export.sources:
                files = SubElement(element, "SourceFiles")
                for name in export.sources:
                    SubElement(files, "File", {"name": name})
    add_unit_definitions(root, interface)
    add_type_definitions(root, interface, _add_type)
    add_log_categories(root, "fmi2")
    add_default_experiment(root, export)
    add_tool_annotation(SubElement(SubElement(root, "VendorAnnotations"), "Tool", {"name": TOOL}), interface, export)
    variables = SubElement(root, "ModelVariables")
    for variable in interface.variables:
        _add_variable(variables, variable, interface)
    _add_structure(root, interface)
    return to_bytes(root)


def _add_type(parent: Element, name: str, attributes: dict[str, str]) -> None:
    SubElement(SubElement(parent, "SimpleType", {"name": name}), "Real", attributes)


def _add_variable(parent: Element, variable: Variable, interface: Interface) -> None:
    scalar = SubElement(parent, "ScalarVariable", general_attributes(variable, str(variable.reference)))
    real = {**unit_attributes(variable.unit), **display_unit(variable), **numeric_attributes(variable)}
    if variable.derivative_of:
        real["derivative"] = _index(interface, variable.derivative_of)
    if variable.reinit:
        real["reinit"] = "true"
    SubElement(scalar, "Real", real)


def _add_structure(root: Element, interface: Interface) -> None:
    """ModelStructure: outputs, derivatives and initial unknowns with their dependencies (section 2.2.8)."""
    outputs, rates = interface.block("output"), interface.derivatives
    unknowns = {"Outputs": outputs}
    if rates:
        unknowns["Derivatives"] = rates
    unknowns["InitialUnknowns"] = (*outputs, *interface.block("local"), *rates) if rates else outputs
    structure = SubElement(root, "ModelStructure")
    for tag, variables in unknowns.items():
        element = SubElement(structure, tag)
        for variable in variables:
            names = variable.initial_dependencies if tag == "InitialUnknowns" else variable.dependencies
            dependencies = " ".join(_index(interface, name) for name in names)
            SubElement(element, "Unknown", {"index": _index(interface, variable.name), "dependencies": dependencies})


def _index(interface: Interface, name: str) -> str:
    """Position of a variable among all variables, counted from one as the schema does."""
    return str(interface[name].reference + 1)
