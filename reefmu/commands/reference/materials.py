"""`reefmu materials`: the materials that come with the package, with their sources."""

from __future__ import annotations

import argparse
import textwrap
from typing import Any

from stiffness_model.drawing.material_library import MATERIALS
from stiffness_model.drawing.materials import Material

from ..terminal.json_output import print_json
from ..terminal.text_table import aligned_table

WIDTH = 100
"""Characters of a line; chosen by judgement."""
_DEFINITION = """\
A drawing defines others, and names them as it does these:

  [material.NAME]
  youngs_modulus = "100 GPa"
  poisson_ratio = 0.3
  density = "7200 kg/m3"          # for forces of inertia alone"""


def run(args: argparse.Namespace) -> int:
    """Print a table of the materials and a list of their sources; or all of it as JSON, in SI units."""
    if args.json:
        print_json([_plain(material) for material in MATERIALS.values()])
        return 0
    print('materials that a drawing names (gear_material = "100Cr6"), values at room temperature:\n')
    print(_table())
    print("\nsources:")
    for material in MATERIALS.values():
        print(_fact(material.name, material.source))
        if material.allowable_source:
            print(_fact("", f"allowable pressure: {material.allowable_source}"))
    print(f"\n{_DEFINITION}")
    return 0


def _table() -> str:
    heads = ["name", "Young's modulus", "Poisson's ratio", "density", "pressure, ball", "pressure, roller"]
    rows = [
        [
            material.name,
            f"{material.youngs_modulus / 1e9:g}",
            f"{material.poisson_ratio:.2f}",
            f"{material.density:g}",
            *("-" if p is None else f"{p / 1e6:g}" for p in map(material.allowable, ("ball", "roller"))),
        ]
        for material in MATERIALS.values()
    ]
    table = aligned_table(heads, ["", "[GPa]", "[1]", "[kg/m3]", "[MPa]", "[MPa]"], rows).splitlines()
    words = ["", "", *(material.description for material in MATERIALS.values())]
    return "\n".join(f"{line}  {text}".rstrip() for line, text in zip(table, words, strict=True))


def _fact(name: str, text: str) -> str:
    width = max(map(len, MATERIALS)) + 4
    return textwrap.fill(text, WIDTH, initial_indent=f"  {name}".ljust(width), subsequent_indent=" " * width)


def _plain(material: Material) -> dict[str, Any]:
    return {
        "name": material.name,
        "description": material.description,
        "youngs_modulus [Pa]": material.youngs_modulus,
        "poisson_ratio [1]": material.poisson_ratio,
        "density [kg/m3]": material.density,
        "allowable_pressure [Pa]": material.allowable_pressure,
        "allowable_line_pressure [Pa]": material.allowable_line_pressure,
        "allowable_source": material.allowable_source,
        "source": material.source,
    }
