"""Rules of FMI 3.0 that importers enforce and FMPy's validation does not check."""

from __future__ import annotations

import zipfile
from xml.etree import ElementTree

from ..xml.archive import DESCRIPTION, FmuFile

_NOT_EXACT = ("approx", "calculated")


def rule_violations(file: FmuFile) -> dict[str, list[str]]:
    """The violations of each rule, as short texts, by the name of the rule; empty for FMI 2.0.

    `references`: the value references count the variables from one in the order of declaration, as OMSimulator expects.
    `unknowns`: the initial unknowns are exactly those outputs, calculated parameters, states and derivatives whose
    `initial` is not exact; in particular, no event indicator is one (FMI 3.0.2, section 2.4.8; rule
    validInitialUnknowns of VDMCheck3).
    """
    if file.fmi_version != "3.0":
        return {}
    with zipfile.ZipFile(file.path) as archive:
        root = ElementTree.fromstring(archive.read(DESCRIPTION))
    variables = root.find("ModelVariables")
    declared = [(v.get("valueReference", ""), v) for v in (() if variables is None else variables)]
    by_reference = dict(declared)

    def listed(tag: str) -> set[str]:
        return {e.get("valueReference", "") for e in root.findall(f"ModelStructure/{tag}")}

    misplaced = [
        f"{v.get('name')} has {reference}, not {position}"
        for position, (reference, v) in enumerate(declared, start=1)
        if reference != str(position)
    ]
    rates = listed("ContinuousStateDerivative")
    candidates = (
        rates
        | listed("Output")
        | {by_reference[r].get("derivative", "") for r in rates & by_reference.keys()}
        | {r for r, v in by_reference.items() if v.get("causality") == "calculatedParameter"}
    )
    expected = {r for r in candidates & by_reference.keys() if _initial(by_reference[r]) in _NOT_EXACT}
    found = listed("InitialUnknown")
    indicators = found & listed("EventIndicator")

    def texts(references: set[str], what: str) -> list[str]:
        return [f"{by_reference[r].get('name') if r in by_reference else r} {what}" for r in sorted(references)]

    return {
        "references": misplaced,
        "unknowns": [
            *texts(indicators, "is also an event indicator"),
            *texts(found - expected - indicators, "is not an initial unknown"),
            *texts(expected - found, "is missing"),
        ],
    }


def _initial(variable: ElementTree.Element) -> str:
    """`initial`, or its default for an output, a state or a derivative (table in section 2.4.7.5)."""
    return variable.get("initial", "calculated")
