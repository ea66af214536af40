"""SystemStructure.ssd: the components of a system, their connectors and connections (SSP 1.0, chapter 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, register_namespace

from ..model.nominals import Experiment
from ..model.variables import Variable
from ..xml.description import ExportInfo, plain_text, to_bytes
from ..xml.parameter_values import SSC, add_units, metadata_attributes

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
STRUCTURE = "SystemStructure.ssd"
RESOURCES = "resources"


class FmuComponent(NamedTuple):
    """An FMU in a system. file: its name in the folder `resources`; connectors: its inputs and outputs."""

    name: str
    file: str
    description: str
    connectors: tuple[Variable, ...]


class Connection(NamedTuple):
    """From an output to an input. An element is the name of a component, or "" for the system itself."""

    start_element: str
    start_connector: str
    end_element: str
    end_connector: str


def connect_outside(component: FmuComponent) -> list[Connection]:
    """Every connector of a component connected with the connector of the system that has its name."""
    return [
        Connection("", v.name, component.name, v.name)
        if v.causality == "input"
        else Connection(component.name, v.name, "", v.name)
        for v in component.connectors
    ]


def system_structure(
    name: str,
    components: Sequence[FmuComponent],
    connections: Sequence[Connection],
    experiment: Experiment,
    export: ExportInfo,
    parameters: str = "",
) -> bytes:
    """The description of a system, UTF-8.

    parameters: file of the parameter set in `resources` that the system is bound to. The connectors of the system are
    those that `connections` name. Each component lies beside the next one in the diagram.
    """
    register_namespace("ssd", SSD)
    register_namespace("ssc", SSC)
    attributes = {"name": plain_text(name), "description": plain_text(export.description)}
    root = Element(_tag("SystemStructureDescription"), {"version": "1.0", **attributes, **metadata_attributes(export)})
    system = SubElement(root, _tag("System"), attributes)
    by_end = {(c.name, v.name): v for c in components for v in c.connectors}
    outside = [
        by_end[c.end_element, c.end_connector] if not c.start_element else by_end[c.start_element, c.start_connector]
        for c in connections
        if not (c.start_element and c.end_element)
    ]
    _add_connectors(system, outside)
    if parameters:
        bindings = SubElement(system, _tag("ParameterBindings"))
        SubElement(bindings, _tag("ParameterBinding"), {"source": f"{RESOURCES}/{parameters}"})
    elements = SubElement(system, _tag("Elements"))
    for place, component in enumerate(components):
        element = SubElement(
            elements,
            _tag("Component"),
            {
                "name": component.name,
                "description": plain_text(component.description),
                "type": "application/x-fmu-sharedlibrary",
                "source": f"{RESOURCES}/{component.file}",
                "implementation": "CoSimulation",
            },
        )
        _add_connectors(element, component.connectors)
        corners = {"x1": 30.0 + 60.0 * place, "y1": 10.0, "x2": 70.0 + 60.0 * place, "y2": 50.0}
        SubElement(element, _tag("ElementGeometry"), {key: repr(value) for key, value in corners.items()})
    ends = SubElement(system, _tag("Connections"))
    for c in connections:
        places = {
            "startElement": c.start_element,
            "startConnector": c.start_connector,
            "endElement": c.end_element,
            "endConnector": c.end_connector,
        }
        SubElement(ends, _tag("Connection"), {key: value for key, value in places.items() if value})
    add_units(SubElement(root, _tag("Units")), {v.unit for v in by_end.values()})
    SubElement(root, _tag("DefaultExperiment"), {"startTime": "0.0", "stopTime": repr(float(experiment.stop_time))})
    return to_bytes(root)


def _tag(name: str) -> str:
    return f"{{{SSD}}}{name}"


def _add_connectors(parent: Element, variables: Sequence[Variable]) -> None:
    """Connectors with their units, inputs on the left side of the element and outputs on its right side."""
    if not variables:
        return
    connectors = SubElement(parent, _tag("Connectors"))
    for v in variables:
        side = [w for w in variables if w.causality == v.causality]
        connector = SubElement(connectors, _tag("Connector"), {"name": v.name, "kind": v.causality})
        SubElement(connector, f"{{{SSC}}}Real", {"unit": v.unit})
        height = (side.index(v) + 0.5) / len(side)
        SubElement(
            connector,
            _tag("ConnectorGeometry"),
            {"x": "0.0" if v.causality == "input" else "1.0", "y": repr(round(1 - height, 6))},
        )
