"""Rules for FMI 3.0 that hosts hold FMUs to and FMPy's validation does not."""

from __future__ import annotations

import zipfile
from xml.etree import ElementTree

from ..xml.archive import DESCRIPTION, FmuFile

_OPEN = ("approx", "calculated")


def rule_violations(file: FmuFile) -> dict[str, list[str]]:
    """What breaks each rule, as short texts, by the rule's name; no rules for FMI 2.0.

    `references`: value references count the variables from one in the order of declaration, for which OMSimulator
    takes them. `unknowns`: the initial unknowns are outputs, calculated parameters, states and derivatives whose
    `initial` leaves them open, all of them and nothing else, above all no event indicator (FMI 3.0.2, section 2.4.8;
    VDMCheck3's rule validInitialUnknowns).
    """
    if file.fmi_version != "3.0":
        return {}
    with zipfile.ZipFile(file.path) as archive:
        root = ElementTree.fromstring(archive.read(DESCRIPTION))
    variables = root.find("ModelVariables")
    declared = [(v.get("valueReference", ""), v) for v in (() if variables is None else variables)]
    names = dict(declared)

    def listed(tag: str) -> set[str]:
        return {e.get("valueReference", "") for e in root.findall(f"ModelStructure/{tag}")}

    misplaced = [
        f"{v.get('name')} has {reference}, not {place}"
        for place, (reference, v) in enumerate(declared, start=1)
        if reference != str(place)
    ]
    rates = listed("ContinuousStateDerivative")
    unknown = (
        rates
        | listed("Output")
        | {names[r].get("derivative", "") for r in rates & names.keys()}
        | {r for r, v in names.items() if v.get("causality") == "calculatedParameter"}
    )
    expected = {r for r in unknown & names.keys() if _initial(names[r]) in _OPEN}
    came = listed("InitialUnknown")

    def texts(references: set[str], what: str) -> list[str]:
        return [f"{names[r].get('name') if r in names else r} {what}" for r in sorted(references)]

    indicators = came & listed("EventIndicator")
    return {
        "references": misplaced,
        "unknowns": [
            *texts(indicators, "is an event indicator too"),
            *texts(came - expected - indicators, "is no initial unknown"),
            *texts(expected - came, "is missing"),
        ],
    }


def _initial(variable: ElementTree.Element) -> str:
    """`initial`, or its default for an output, a state or a derivative (table in section 2.4.7.5)."""
    return variable.get("initial", "calculated")
