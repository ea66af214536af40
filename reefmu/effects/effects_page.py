"""The documentation of the effects, from their declarations: `python -m reefmu.effects.effects_page`.

It prints docs/reference/effects.md.
"""

from __future__ import annotations

import textwrap

from . import EFFECTS, Effect, Parameter
from .effect_facts import confusion_lines, example_call

_INTRODUCTION = """\
# The effects

What the contact model leaves out, in the order along the drive. Each effect can be a part of a drive model, an FMU
(`--effect NAME.PARAMETER=VALUE`) and, unless it says otherwise, a diagnosis; its parameters are `NAME.PARAMETER` there.
While its amplitudes, the parameters in bold, are neutral, an effect changes nothing. `reefmu effects NAME` prints one
of them. This page is generated from the declarations in `reefmu/effects`: `python -m reefmu.effects.effects_page >
docs/reference/effects.md`.
"""


def markdown() -> str:
    """The page docs/reference/effects.md.

    >>> markdown().splitlines()[0]
    '# The effects'
    """
    return "\n".join([_INTRODUCTION, *(_section(effect) for effect in EFFECTS.values())])


def _section(effect: Effect) -> str:
    head = ("parameter", "unit", "neutral", "from", "to", "typical", "meaning")
    rows = [head, ("---",) * len(head), *(_cells(effect, parameter) for parameter in effect.parameters)]
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    reason = effect.identification.not_a_candidate
    items = (
        f"acts: {effect.place.value}",
        f"shown by: {effect.excitation}",
        *(f"may be confused with {line}" for line in confusion_lines(effect)),
        *([f"not diagnosed: {reason}"] if reason else []),
        f"source: {effect.source}",
        f"example: `{example_call(effect)}`",
    )
    facts = "\n".join(
        textwrap.fill(item, 120, initial_indent="* ", subsequent_indent="  ", break_on_hyphens=False) for item in items
    )
    meaning = textwrap.fill(f"{effect.title}. {effect.meaning}", 120, break_on_hyphens=False)
    return f"## {effect.name}\n\n{meaning}\n\n    {effect.equation}\n\n{facts}\n\n{table}\n"


def _cells(effect: Effect, parameter: Parameter) -> tuple[str, ...]:
    values = (parameter.neutral, parameter.minimum, parameter.maximum, parameter.nominal)
    name = f"**`{parameter.name}`**" if parameter.name in effect.amplitudes else f"`{parameter.name}`"
    return (name, parameter.unit, *(f"{value:g}" for value in values), parameter.description)


if __name__ == "__main__":
    print(markdown(), end="")
