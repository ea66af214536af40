"""`reefmu gears`: the gears whose data sheets come with the package."""

from __future__ import annotations

import argparse
import textwrap

from stiffness_model.catalog.catalogue_drive import stated_values
from stiffness_model.catalog.catalogue_toml import table_of_row
from stiffness_model.catalog.gears import CatalogGear, catalog
from stiffness_model.errors import InputError
from stiffness_model.io.drawing_toml import drive_from_dict

from ..terminal.json_output import print_json

WIDTH = 100
"""Characters of a line; chosen by judgement."""


def run(args: argparse.Namespace) -> int:
    """Print every gear with what its sheet states, its source and what it lacks to be a drive."""
    gears = catalog()
    if args.json:
        tables = [{**table_of_row(gear), "has_curve": gear.has_curve} for gear in gears]
        print_json(tables)
        return 0
    print("gears that commands take by their names (curve, export, diagnose --drive, ...):\n")
    usable = [gear for gear in gears if gear.has_curve]
    for gear in usable:
        print(_entry(gear))
    print("\nrows without a curve, which no command takes as a drive:\n")
    for gear in gears:
        if gear not in usable:
            print(_entry(gear))
    return 0


def _entry(gear: CatalogGear) -> str:
    """Name and label, then numbers, what is missing, and the source."""
    table = table_of_row(gear)
    lines = [f"  {gear.name:16} {gear.maker}, {gear.kind}"]
    try:
        # A ratio only for reading the other values of a row that states none.
        numbers = stated_values(drive_from_dict({"ratio": 1e9, **table}, gear.name))
        text = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in numbers.items())
        if "ratio" not in table:
            range_ = f" ({gear.ratio})" if gear.ratio else ""
            text = f"needs its ratio{range_}, --set ratio=...; {text}"
    except InputError:
        text = "no curve"
    remarks = "; ".join(part for part in (table["source"], table["note"]) if part)
    for part in (text, remarks):
        lines.append(textwrap.fill(part, WIDTH, initial_indent=" " * 5, subsequent_indent=" " * 5))
    return "\n".join(lines)
