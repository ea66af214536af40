"""The materials that come with the package, each with its sources, and materials by their names.

Values at 20 to 23 degC. The moduli of plastics are those of short tests: under a load of hours they are a half to two
thirds of that (creep moduli, ISO 899-1), and they fall with temperature and, of polyamides, with humidity.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

from ..errors import UnknownNameError
from .materials import MATERIAL_TABLE, Material

_MMPDS = "MMPDS (successor of MIL-HDBK-5)"
SIMILARITY = 0.85
"""Least similarity (difflib) of a word and one of a description that is meant by it: "aluminum" is "aluminium". Chosen
by judgement."""
_JUDGED = "Poisson's ratio chosen by judgement"

STEEL_100CR6 = Material(
    "100Cr6",
    208e9,
    0.30,
    7810.0,
    allowable_pressure=4200e6,
    allowable_line_pressure=4000e6,
    allowable_source="ISO 76:2006, static load ratings: 4200 MPa for balls, 4000 MPa for rollers",
    description="bearing steel, hardened",
    source="Schaeffler Technical Pocket Guide, as in section IV of the paper",
)
PLA = Material(
    "PLA",
    3e9,
    0.33,
    1240.0,
    description="plastic, 3D printed polylactide",
    # No standard rates its contacts, and its strength depends on the print, the temperature and the time under load.
    source="section IV of the paper (modulus, Poisson's ratio); NatureWorks, data sheet of Ingeo 4043D (density)",
)

_METALS = (
    Material(
        "16MnCr5",
        206e9,
        0.30,
        7850.0,
        description="case-hardening steel",
        source="ISO 6336-2, elasticity factor of steel (modulus, Poisson's ratio); EN 1991-1-1 (density of steel)",
    ),
    Material(
        "X5CrNi18-10",
        200e9,
        0.30,
        7900.0,
        description="stainless steel, austenitic (1.4301, AISI 304)",
        source="EN 10088-1 (modulus, density); EN 1993-1-4 (modulus, Poisson's ratio)",
    ),
    Material(
        "X105CrMo17",
        215e9,
        0.30,
        7700.0,
        description="stainless bearing steel, martensitic (1.4125, AISI 440C)",
        source=f"EN 10088-1 (modulus, density of martensitic grades); {_JUDGED}, as of other steels",
    ),
    Material(
        "EN AW-6082",
        70e9,
        0.30,
        2700.0,
        description="aluminium, wrought alloy",
        source="EN 1999-1-1, constants of aluminium alloys",
    ),
    Material(
        "EN AW-7075",
        71e9,
        0.33,
        2800.0,
        description="aluminium, wrought alloy of high strength",
        source=f"{_MMPDS}: 10.3e6 psi, 0.33, 0.101 lb/in3",
    ),
    Material(
        "CuZn36Pb3",
        97e9,
        0.31,
        8490.0,
        description="brass, free-cutting (CW603N, UNS C36000)",
        source="Copper Development Association, data of UNS C36000; Poisson's ratio from its shear modulus of 37 GPa",
    ),
    Material(
        "CuSn11P",
        103e9,
        0.34,
        8770.0,
        description="bronze, cast gear bronze (CC481K, UNS C90700)",
        source=f"Copper Development Association, data of UNS C90700 (modulus, density); {_JUDGED}, as of copper",
    ),
    Material(
        "EN-GJL-250",
        110e9,
        0.26,
        7200.0,
        description="grey cast iron, lamellar graphite",
        source="EN 1561, informative annex: 103 to 118 GPa, of which this is the middle",
    ),
    Material(
        "Ti-6Al-4V",
        110e9,
        0.31,
        4430.0,
        description="titanium alloy, annealed",
        source=f"{_MMPDS}: 16.0e6 psi, 0.31, 0.160 lb/in3",
    ),
)
_OTHERS = (
    Material(
        "POM",
        2.85e9,
        0.35,
        1410.0,
        description="plastic, polyoxymethylene (acetal) copolymer",
        source="Celanese, data sheet of Hostaform C 9021 (modulus, density); Delrin design guide (Poisson's ratio)",
    ),
    Material(
        "PEEK",
        4.0e9,
        0.40,
        1300.0,
        description="plastic, polyether ether ketone, unfilled",
        source="Victrex, data sheet of PEEK 450G (modulus, density) and materials properties guide (Poisson's ratio)",
    ),
    Material(
        "PA66",
        1.1e9,
        0.40,
        1130.0,
        description="plastic, polyamide 66 (nylon), conditioned at 50 % relative humidity",
        source=f"BASF, data sheet of Ultramid A3K: 1.1 GPa conditioned, 3.0 GPa dry; {_JUDGED}",
    ),
    Material(
        "PA12",
        1.65e9,
        0.40,
        930.0,
        description="plastic, polyamide 12 (nylon), laser sintered",
        source=f"EOS, data sheet of PA 2200 (modulus, density); {_JUDGED}",
    ),
    PLA,
    Material(
        "Si3N4",
        310e9,
        0.26,
        3200.0,
        description="ceramic, silicon nitride of rolling elements",
        source="SKF, Rolling bearings (modulus, density); ASTM F2094, the middle of 0.23 to 0.29 (Poisson's ratio)",
    ),
)

MATERIALS: Mapping[str, Material] = {m.name: m for m in (STEEL_100CR6, *_METALS, *_OTHERS)}
"""The materials of the package by name."""


def find_material(name: str, own: Mapping[str, Material], where: str = "") -> Material:
    """The material of that name; `own` materials of the drawing take precedence.

    Raises `UnknownNameError` with the closest names, those of materials that are described by that word among them, and
    with how to define a material.

    >>> find_material("brass", {}, "mine.toml: gear_material")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.UnknownNameError: mine.toml: gear_material: unknown material 'brass'; did you mean \
'CuZn36Pb3'? A drawing defines others in a table [material.NAME] with youngs_modulus = "100 GPa" and \
poisson_ratio = 0.3; `reefmu materials` lists those that are built in
    """
    known = {**MATERIALS, **own}
    if name in known:
        return known[name]
    described = [material.name for material in known.values() if _is_described_by(material, name.casefold())]
    meant = list(dict.fromkeys([*described, *get_close_matches(name, known)]))
    hint = f"did you mean {' or '.join(map(repr, meant))}?" if meant else f"expected one of {', '.join(known)}."
    raise UnknownNameError(
        f"{where}{': ' if where else ''}unknown material {name!r}; {hint} "
        f'A drawing defines others in a table [{MATERIAL_TABLE}] with youngs_modulus = "100 GPa" and '
        "poisson_ratio = 0.3; `reefmu materials` lists those that are built in"
    )


def _is_described_by(material: Material, words: str) -> bool:
    """Whether the words, in small letters, are the material's name or, but for a letter, a part of its description."""
    description = material.description.casefold()
    near = bool(get_close_matches(words, re.findall(r"[\w-]+", description), n=1, cutoff=SIMILARITY))
    named = bool(words) and re.search(rf"\b{re.escape(words)}\b", description) is not None
    return words == material.name.casefold() or near or named


def material_labels(materials: Iterable[Material]) -> dict[Material, str]:
    """Label of each material in a drawing: its name, with a number where two materials share one.

    >>> list(material_labels([Material("100Cr6", 104e9, 0.3, 7800.0), STEEL_100CR6]).values())
    ['100Cr6', '100Cr6 2']
    """
    labels: dict[Material, str] = {}
    # Materials of the package come first and keep their names, for no table of the drawing could state another label.
    for material in sorted(dict.fromkeys(materials), key=lambda m: MATERIALS.get(m.name) != m):
        label, number = material.name, 1
        while label in labels.values():
            number += 1
            label = f"{material.name} {number}"
        labels[material] = label
    return labels
