"""Parameter sets as SSV files (System Structure and Parameterization 1.0, section 6.3)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, register_namespace

from ..model.base_units import base_unit
from ..model.presets import Preset
from .description import ExportInfo, plain_text, to_bytes

SSV, SSC = (f"http://ssp-standard.org/SSP1/SystemStructure{name}" for name in ("ParameterValues", "Common"))
MIME_TYPE = "application/x-ssp-parameter-set"


def parameter_set(preset: Preset, units: Mapping[str, str], export: ExportInfo, prefix: str = "") -> bytes:
    """The SSV file of a preset, UTF-8.

    units: by name of the parameter. prefix: in front of every name: none for a set that is applied to an FMU,
    "component." for one that is applied to a system.
    """
    register_namespace("ssv", SSV)
    register_namespace("ssc", SSC)
    root = Element(
        f"{{{SSV}}}ParameterSet",
        {
            "version": "1.0",
            "name": preset.name,
            "description": plain_text(preset.description),
            **metadata_attributes(export),
        },
    )
    parameters = SubElement(root, f"{{{SSV}}}Parameters")
    for name, value in preset.values.items():
        parameter = SubElement(parameters, f"{{{SSV}}}Parameter", {"name": prefix + name})
        SubElement(parameter, f"{{{SSV}}}Real", {"value": repr(float(value)), "unit": units[name]})
    add_units(SubElement(root, f"{{{SSV}}}Units"), {units[name] for name in preset.values})
    return to_bytes(root)


def metadata_attributes(export: ExportInfo) -> dict[str, str]:
    """Author, licence and origin, as the files of the standard state them (section 4.3.2)."""
    return {
        "author": export.author,
        "copyright": export.copyright,
        "license": export.licence,
        "generationTool": export.generation_tool,
        "generationDateAndTime": export.generated,
    }


def add_units(parent: Element, units: Iterable[str]) -> None:
    """Definitions of units. Errors: `InputError` for an unknown unit."""
    for name in sorted(units):
        base = base_unit(name)
        attributes = {dimension: str(exponent) for dimension, exponent in base.exponents}
        if base.factor != 1.0:
            attributes["factor"] = repr(base.factor)
        if base.offset != 0.0:
            attributes["offset"] = repr(base.offset)
        SubElement(SubElement(parent, f"{{{SSC}}}Unit", {"name": name}), f"{{{SSC}}}BaseUnit", attributes)
