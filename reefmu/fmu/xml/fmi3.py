"""The XML of an FMU for FMI 3.0: modelDescription, terminals and build description (FMI 3.0.2, section 2.4 and 2.5).

From the same declared interface as that for FMI 2.0. Value references count from one in the order of declaration: the
interface's variables, then the event indicators, which are variables of their own, then `time`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..model.variables import FMI3, INDICATOR_PREFIX, Interface, Variable
from . import fmi2 as description
from .fmi2 import LOG_CATEGORIES, TOOL, TYPES, ExportInfo, plain_text, type_names, unit_definitions

EXCHANGE = {
    "needsExecutionTool": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUState": True,
    "canSerializeFMUState": True,
    "providesDirectionalDerivatives": True,
    "needsCompletedIntegratorStep": True,
}
SIMULATION = {
    "needsExecutionTool": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUState": True,
    "canSerializeFMUState": True,
    "providesDirectionalDerivatives": True,
    "canHandleVariableCommunicationStepSize": True,
    "hasEventMode": False,
}
"""What the generated C can do (sections 3.3 and 4.3)."""


class Flange(NamedTuple):
    """A shaft end. members: variable by its name in the flange; torque: whether it flows into the FMU or out."""

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
            "Rotational flange of the motor: angle, speed, and the torque on it from outside",
            {"phi": "crank.phi", "w": "crank.w", "tau": "motor.tau"},
            "inflow",
        ),
        "output": Flange(
            "Rotational flange of the load: angle, speed, and the torque on it from outside",
            {"phi": "output.phi", "w": "output.w", "tau": "load.tau"},
            "inflow",
        ),
    },
}
"""Terminals by the FMU's kind."""


def model_description_fmi3(interface: Interface, export: ExportInfo) -> bytes:
    """modelDescription.xml, UTF-8, in the order the schema prescribes. interface: with the derivatives."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": plain_text(interface.name),
            "instantiationToken": export.guid,
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
    for tag, capabilities in (("ModelExchange", EXCHANGE), ("CoSimulation", SIMULATION)):
        SubElement(
            root,
            tag,
            {
                "modelIdentifier": export.model_identifier,
                **{name: str(value).lower() for name, value in capabilities.items()},
            },
        )
    unit_definitions(root, interface)
    types = SubElement(root, "TypeDefinitions")
    for unit, (name, quantity) in type_names(interface).items():
        SubElement(types, "Float64Type", {"name": name, **({"quantity": quantity} if quantity else {}), "unit": unit})
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", {"name": name, "description": meaning.replace("fmi2", "fmi3")})
    SubElement(root, "DefaultExperiment", description.default_experiment(export))
    variables = SubElement(root, "ModelVariables")
    switches = indicators(interface, export.indicators)
    for variable in (*interface.variables, *switches):
        _variable(variables, variable, interface)
    SubElement(
        variables,
        "Float64",
        {
            "name": "time",
            "valueReference": str(len(interface.variables) + len(switches) + FMI3.first_reference),
            "description": "Simulation time",
            "causality": "independent",
            "variability": "continuous",
            **_unit("s", interface),
        },
    )
    _structure(root, interface, export)
    annotation = SubElement(SubElement(root, "Annotations"), "Annotation", {"type": TOOL})
    SubElement(annotation, "fmu", {"kind": interface.kind, "backend": export.backend, "interface": interface.digest})
    return _written(root)


def terminals(interface: Interface) -> bytes:
    """terminalsAndIcons.xml: a flange at the crank and one at the output (section 2.4.9)."""
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    parent = SubElement(root, "Terminals")
    for name, flange in FLANGES[interface.kind].items():
        terminal = SubElement(
            parent, "Terminal", {"name": name, "matchingRule": "plug", "description": flange.description}
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
    return _written(root)


def build_description(export: ExportInfo) -> bytes:
    """sources/buildDescription.xml (section 2.5.1)."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": export.model_identifier})
    files = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for name in export.sources:
        SubElement(files, "SourceFile", {"name": name})
    return _written(root)


def _variable(parent: Element, variable: Variable, interface: Interface) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": _reference(variable),
        "description": plain_text(variable.description),
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    attributes |= _unit(variable.unit, interface)
    for key, value in (
        ("min", variable.minimum),
        ("max", variable.maximum),
        ("nominal", variable.nominal),
        ("start", variable.start),
    ):
        if value is not None:
            attributes[key] = repr(value)
    if variable.derivative_of:
        attributes["derivative"] = _reference(interface[variable.derivative_of])
    if variable.reinit:
        attributes["reinit"] = "true"
    SubElement(parent, "Float64", attributes)


def _unit(unit: str, interface: Interface) -> dict[str, str]:
    """declaredType and unit, as far as they are defined in the file."""
    if all(v.unit != unit for v in interface.variables):
        return {}
    return {**({"declaredType": TYPES[unit][0]} if unit in TYPES else {}), "unit": unit}


def _structure(root: Element, interface: Interface, export: ExportInfo) -> None:
    """ModelStructure: what outputs, derivatives and initial unknowns depend on, and the event indicators."""
    structure = SubElement(root, "ModelStructure")
    outputs, rates = interface.block("output"), interface.derivatives
    for tag, variables in (("Output", outputs), ("ContinuousStateDerivative", rates)):
        for variable in variables:
            _unknown(structure, tag, variable, variable.dependencies, interface)
    for variable in (*outputs, *interface.block("local"), *rates):
        _unknown(structure, "InitialUnknown", variable, variable.initial_dependencies, interface)
    for variable in indicators(interface, export.indicators):
        _unknown(structure, "EventIndicator", variable, variable.dependencies, interface)


def indicators(interface: Interface, count: int) -> tuple[Variable, ...]:
    """The event indicators: the derivatives of the states that remember a path, `count` of them, under names and
    references of their own. The derivatives themselves are initial unknowns, which an event indicator is not
    (section 2.4.8)."""
    first = [v for v in interface.derivatives if v.derivative_of.startswith("last.")]
    assert len(first) == count
    return tuple(
        replace(
            v,
            reference=len(interface.variables) + k,
            name=v.derivative_of.replace("last.", INDICATOR_PREFIX),
            description=f"Event indicator: where it passes 0, what follows {v.derivative_of} turns round",
            derivative_of="",
        )
        for k, v in enumerate(first)
    )


def _reference(variable: Variable) -> str:
    return str(FMI3.first_reference + variable.reference)


def _unknown(parent: Element, tag: str, variable: Variable, depends_on: tuple[str, ...], interface: Interface) -> None:
    references = " ".join(_reference(interface[name]) for name in depends_on)
    SubElement(parent, tag, {"valueReference": _reference(variable), "dependencies": references})


def _written(root: Element) -> bytes:
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
