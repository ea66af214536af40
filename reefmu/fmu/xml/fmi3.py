"""The XML of an FMU for FMI 3.0: modelDescription, terminals and build description (FMI 3.0.2, sections 2.4 and 2.5).

It is made from the same interface as the description for FMI 2.0. Value references count from one in the order of
declaration: the variables of the interface, then the event indicators, which are variables of their own, then `time`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from ..model.variables import FMI3, INDICATOR_PREFIX, Interface, Variable
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

MODEL_EXCHANGE_FLAGS = {
    "needsExecutionTool": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUState": True,
    "canSerializeFMUState": True,
    "providesDirectionalDerivatives": True,
    "needsCompletedIntegratorStep": True,
}
CO_SIMULATION_FLAGS = {
    "needsExecutionTool": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUState": True,
    "canSerializeFMUState": True,
    "providesDirectionalDerivatives": True,
    "canHandleVariableCommunicationStepSize": True,
    "hasEventMode": False,
}
"""Capability flags of the generated C (sections 3.3 and 4.3)."""


TERMINAL_KIND = "reefmu.RotationalFlange"
"""Kind of the terminals: angle phi, speed w and torque tau of a shaft end. Only terminals of one kind can be plugged
together (section 2.4.9.2)."""


class Flange(NamedTuple):
    """A shaft end. members: variable by its name in the flange; torque: the variableKind of its torque."""

    description: str
    members: Mapping[str, str]
    torque: str


FLANGES = {
    "drive": {
        "crank": Flange(
            "Rotational flange of the crank: angle, speed, and the torque that the drive exerts on it",
            {"phi": "crank.phi", "w": "crank.w", "tau": "crank.tau"},
            "outflow",
        ),
        "output": Flange(
            "Rotational flange of the output: angle, speed, and the torque that the drive exerts on it",
            {"phi": "output.phi", "w": "output.w", "tau": "output.tau"},
            "outflow",
        ),
    },
    "joint": {
        "crank": Flange(
            "Rotational flange of the motor: angle, speed, and the external torque on it",
            {"phi": "crank.phi", "w": "crank.w", "tau": "motor.tau"},
            "inflow",
        ),
        "output": Flange(
            "Rotational flange of the load: angle, speed, and the external torque on it",
            {"phi": "output.phi", "w": "output.w", "tau": "load.tau"},
            "inflow",
        ),
    },
}
"""Terminals by kind of FMU."""


def model_description_fmi3(interface: Interface, export: ExportInfo) -> bytes:
    """modelDescription.xml, UTF-8, in the order the schema prescribes. interface: with the derivatives."""
    root = root_element("3.0", "instantiationToken", interface, export)
    add_interface_type(root, "ModelExchange", MODEL_EXCHANGE_FLAGS, export)
    add_interface_type(root, "CoSimulation", CO_SIMULATION_FLAGS, export)
    add_unit_definitions(root, interface)
    add_type_definitions(root, interface, _add_type)
    add_log_categories(root, "fmi3")
    add_default_experiment(root, export)
    variables = SubElement(root, "ModelVariables")
    indicators = event_indicators(interface, export.indicators)
    for variable in (*interface.variables, *indicators):
        _add_variable(variables, variable, interface)
    SubElement(
        variables,
        "Float64",
        {
            "name": "time",
            "valueReference": str(len(interface.variables) + len(indicators) + FMI3.first_reference),
            "description": "Simulation time",
            "causality": "independent",
            "variability": "continuous",
            **_unit("s", interface),
        },
    )
    _add_structure(root, interface, export)
    annotation = SubElement(SubElement(root, "Annotations"), "Annotation", {"type": TOOL})
    add_tool_annotation(annotation, interface, export)
    return to_bytes(root)


def terminals(interface: Interface) -> bytes:
    """terminalsAndIcons.xml: the icon, a flange at the crank and one at the output (section 2.4.9)."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    picture = SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "-100.0", "y1": "-100.0", "x2": "100.0", "y2": "100.0"}
    SubElement(picture, "CoordinateSystem", {**corners, "suggestedScalingFactorTo_mm": "0.1"})
    SubElement(picture, "Icon", corners)
    parent = SubElement(root, "Terminals")
    for name, flange in FLANGES[interface.kind].items():
        terminal = SubElement(
            parent,
            "Terminal",
            {
                "name": name,
                "matchingRule": "plug",
                "terminalKind": TERMINAL_KIND,
                "description": flange.description,
            },
        )
        for member, variable in flange.members.items():
            SubElement(
                terminal,
                "TerminalMemberVariable",
                {
                    "variableName": interface[variable].name,
                    "memberName": member,
                    "variableKind": flange.torque if member == "tau" else "signal",
                },
            )
    return to_bytes(root)


def build_description(export: ExportInfo) -> bytes:
    """sources/buildDescription.xml (section 2.5.1)."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": export.model_identifier})
    files = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for name in export.sources:
        SubElement(files, "SourceFile", {"name": name})
    return to_bytes(root)


def event_indicators(interface: Interface, count: int) -> tuple[Variable, ...]:
    """The event indicators: the derivatives of the `count` states that store an angle.

    They have names and value references of their own, because the derivatives are initial unknowns, which an event
    indicator must not be (section 2.4.8).
    """
    derivatives = [v for v in interface.derivatives if v.derivative_of.startswith("last.")]
    assert len(derivatives) == count
    return tuple(
        replace(
            v,
            reference=len(interface.variables) + k,
            name=v.derivative_of.replace("last.", INDICATOR_PREFIX),
            description=f"Event indicator: crosses 0 where {v.derivative_of} changes its direction",
            derivative_of="",
        )
        for k, v in enumerate(derivatives)
    )


def _add_type(parent: Element, name: str, attributes: dict[str, str]) -> None:
    SubElement(parent, "Float64Type", {"name": name, **attributes})


def _add_variable(parent: Element, variable: Variable, interface: Interface) -> None:
    attributes = {
        **general_attributes(variable, _reference(variable)),
        **_unit(variable.unit, interface),
        **display_unit(variable),
        **numeric_attributes(variable),
    }
    if variable.derivative_of:
        attributes["derivative"] = _reference(interface[variable.derivative_of])
    if variable.reinit:
        attributes["reinit"] = "true"
    SubElement(parent, "Float64", attributes)


def _unit(unit: str, interface: Interface) -> dict[str, str]:
    """Declared type and unit, if the file defines the unit."""
    return unit_attributes(unit) if any(v.unit == unit for v in interface.variables) else {}


def _add_structure(root: Element, interface: Interface, export: ExportInfo) -> None:
    """ModelStructure: outputs, derivatives and initial unknowns with their dependencies, and the event indicators."""
    structure = SubElement(root, "ModelStructure")
    outputs, rates = interface.block("output"), interface.derivatives
    for tag, variables in (("Output", outputs), ("ContinuousStateDerivative", rates)):
        for variable in variables:
            _add_unknown(structure, tag, variable, variable.dependencies, interface)
    for variable in (*outputs, *interface.block("local"), *rates):
        _add_unknown(structure, "InitialUnknown", variable, variable.initial_dependencies, interface)
    for variable in event_indicators(interface, export.indicators):
        _add_unknown(structure, "EventIndicator", variable, variable.dependencies, interface)


def _reference(variable: Variable) -> str:
    return str(FMI3.first_reference + variable.reference)


def _add_unknown(
    parent: Element, tag: str, variable: Variable, dependencies: tuple[str, ...], interface: Interface
) -> None:
    references = " ".join(_reference(interface[name]) for name in dependencies)
    SubElement(parent, tag, {"valueReference": _reference(variable), "dependencies": references})
