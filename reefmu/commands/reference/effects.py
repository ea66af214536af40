"""`reefmu effects`: the effects that a model can contain and a diagnosis can name, from their declarations."""

from __future__ import annotations

import argparse
import textwrap

from reefmu.effects import EFFECTS, Effect, Place, find_effect
from reefmu.effects.effect_facts import confusion_lines, effect_to_dict, example_call

from ..terminal.json_output import print_json
from ..terminal.text_table import aligned_table

WIDTH = 100
"""Characters of a line; chosen by judgement."""


def run(args: argparse.Namespace) -> int:
    """Print all effects by their place along the drive, or one of them in full; as text or as JSON."""
    chosen = list(EFFECTS.values()) if args.name is None else [find_effect(args.name)]
    if args.json:
        tables = [effect_to_dict(effect) for effect in chosen]
        print_json(tables if args.name is None else tables[0])
    else:
        print(effects_by_place() if args.name is None else effect_text(chosen[0]))
    return 0


def effects_by_place() -> str:
    """One line for each effect, below the place where it acts, in the order along the drive."""
    width = max(map(len, EFFECTS))
    lines = ["effects, in the order along the drive (reefmu effects NAME says more of one):"]
    for place in Place:
        lines += ["", f"{place.name.lower()}: {place.value}"]
        lines += [f"  {e.name:{width}}  {e.title}" for e in EFFECTS.values() if e.place is place]
    return "\n".join(lines)


def effect_text(effect: Effect) -> str:
    """All that is declared of one effect: meaning, equation, parameters, test, confusions, source, example."""
    paragraphs = [
        f"{effect.name}: {effect.title}",
        textwrap.fill(effect.meaning, WIDTH),
        "\n".join(f"  {part.strip()}" for part in effect.equation.split(",  ")),
        _fact("place", f"{effect.place.name.lower()}, {effect.place.value}"),
        _parameters(effect),
        _fact("neutral", f"at the default of {' and '.join(effect.amplitudes)} the effect changes nothing"),
        _fact("shown by", effect.excitation),
    ]
    lines = confusion_lines(effect)
    if lines:
        paragraphs.append("\n".join(["may be confused with", *(_fact("-", line, 4) for line in lines)]))
    if effect.identification.requirements:
        reasons = " or ".join(requirement.value for requirement in effect.identification.requirements)
        paragraphs.append(_fact("not diagnosed if", reasons))
    if effect.identification.not_a_candidate:
        paragraphs.append(_fact("not diagnosed", effect.identification.not_a_candidate))
    return "\n\n".join([*paragraphs, _fact("source", effect.source), f"example\n  {example_call(effect)}"])


def _fact(name: str, text: str, indent: int = 0) -> str:
    """`name  text`, further lines indented below the text."""
    head = f"{name:>{indent - 1}} " if indent else f"{name}: "
    return textwrap.fill(text, WIDTH, initial_indent=head, subsequent_indent=" " * (indent or 2))


def _parameters(effect: Effect) -> str:
    rows = [
        [f"{effect.name}.{p.name}", p.unit, *(f"{x:g}" for x in (p.neutral, p.minimum, p.maximum, p.nominal))]
        for p in effect.parameters
    ]
    heads = ["parameter", "unit", "default", "from", "to", "typical"]
    table = aligned_table(heads, [""] * len(heads), rows).splitlines()
    meanings = ["", "", *(p.description for p in effect.parameters)]
    lines = zip(table, meanings, strict=True)
    # Without the line of units, which is a column here.
    return "\n".join(f"{line}  {meaning}".rstrip() for line, meaning in lines if line.strip())
