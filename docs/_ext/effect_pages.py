"""A page for every effect, and a list of them in place of the repository's page, from the declarations of the effects.

The pages are written to docs/reference/effects before Sphinx looks for its sources. Pictures are those that the example
`effect_signatures` has drawn for the gallery; a site without the gallery has none.
"""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from reefmu.effects import EFFECTS, Effect, Place
from reefmu.effects.base import Requirement
from reefmu.effects.effect_facts import example_call, may_be_named, plan_call

LIST = "reference/effects"
NEEDS = {
    Requirement.TEMPERATURE: "the temperature",
    Requirement.CRANK_ANGLE: "the angle of the crank",
    Requirement.DRAWING: "a drawing of the drive",
}
INTRODUCTION = """\
# The effects

What the contact model leaves out, in the order along the drive. Each effect can be a part of a drive model
({doc}`../tutorials/joint_under_control`), an FMU (`--effect NAME.PARAMETER=VALUE`) and a diagnosis. At the neutral
value of its first parameter an effect changes nothing. `reefmu effects` lists them in a terminal.
"""


def list_text() -> str:
    """The list of all effects by the place where they act, in Markdown."""
    parts = [INTRODUCTION]
    for place in Place:
        effects = [effect for effect in EFFECTS.values() if effect.place is place]
        if effects:
            rows = "\n".join(f"| [{e.name}](effects/{e.name}.md) | {e.title} | {e.excitation} |" for e in effects)
            heading = place.name.capitalize()
            parts.append(f"## {heading}\n\nActs: {place.value}.\n\n| effect | what it is | shown by |\n|---|---|---|")
            parts.append(rows + "\n")
    pages = "\n".join(f"effects/{name}" for name in EFFECTS)
    parts.append(f"```{{toctree}}\n:hidden:\n\n{pages}\n```\n")
    return "\n".join(parts)


def page_text(effect: Effect, has_picture: bool) -> str:
    """The page of one effect in Markdown."""
    return "\n".join(_page(effect, has_picture))


def _page(effect: Effect, has_picture: bool) -> Iterator[str]:
    first = effect.parameters[0]
    # One clause a line; two blanks separate clauses.
    equation = "\n".join(
        textwrap.fill(clause, 88, break_on_hyphens=False, subsequent_indent="    ")
        for clause in effect.equation.split(",  ")
    )
    yield f"# {effect.name}\n\n{effect.meaning}\n\n```text\n{equation}\n```\n"
    yield f"Acts: {effect.place.value}.\n"
    if has_picture:
        yield f"```{{figure}} {effect.name}.png\n:alt: torque with and without {effect.name}, and their difference\n"
        yield "Left: the torque that a rig measures, grey without the effect. Right: what the effect adds, over the"
        yield "coordinate that shows it. Drawn for `drive_1` by {doc}`../../gallery/effect_signatures`.\n```\n"
    yield "## Parameters\n"
    yield "| parameter | unit | neutral | from | to | typical | meaning |\n|---|---|---|---|---|---|---|"
    for p in effect.parameters:
        values = " | ".join(_unbroken(value) for value in (p.neutral, p.minimum, p.maximum, p.nominal))
        yield f"| `{effect.name}.{p.name}` | {p.unit} | {values} | {p.description} |"
    yield "\nIn Python, and in an FMU at its typical size:\n"
    yield "```python\nfrom reefmu import build_model\n"
    yield f'model = build_model("drive_1", {{"{effect.name}": {{"{first.name}": {first.nominal:g}}}}})\n```\n'
    yield f"```sh\n{example_call(effect)}\n```\n"
    yield from _experiment(effect)
    yield f"## Source\n\n{effect.source}"


def _unbroken(value: float) -> str:
    """A number with a hyphen at which browsers break no line."""
    return f"{value:g}".replace("-", "\N{NON-BREAKING HYPHEN}")


def _experiment(effect: Effect) -> Iterator[str]:
    known = effect.identification
    yield f"## The experiment that shows it\n\n{effect.excitation}\n"
    if known.shown_by:
        yield f"Alone it is shown by {known.shown_by}.\n"
    if known.requirements:
        yield f"A diagnosis needs {' and '.join(NEEDS[need] for need in known.requirements)}.\n"
    if known.tolerance_signature:
        yield (
            f"The tolerances of an individual drive cause {known.tolerance_signature.value} as well: where they could "
            "explain it, the effect is not named.\n"
        )
    if known.sign_pair:
        yield f"The same quantity with the opposite sign is [{known.sign_pair}]({known.sign_pair}.md).\n"
    if known.limit_of:
        yield f"It is a limit of [{known.limit_of}]({known.limit_of}.md).\n"
    rivals = _separating_tests(effect)
    if rivals:
        yield "| rival | told from it by |\n|---|---|"
        yield from (f"| [{name}]({name}.md) | {test} |" for name, test in rivals.items())
        yield ""
    # No test is planned for an effect that no record shows.
    if not known.not_a_candidate:
        names = may_be_named([effect.name, *rivals])[:4]
        yield f"The shortest test on your rig: `{plan_call('drive_1', names)}`.\n"


def _separating_tests(effect: Effect) -> dict[str, str]:
    """Tests by the name of the rival, whichever of the two effects declares them."""
    others = {
        other.name: test
        for other in EFFECTS.values()
        for name, test in other.identification.separated_from
        if name == effect.name
    }
    return {**others, **dict(effect.identification.separated_from)}


def write_pages(app: Sphinx) -> None:
    """Write the page and copy the picture of every effect; remove pages of effects that no longer exist."""
    folder = Path(app.srcdir) / LIST
    folder.mkdir(exist_ok=True)
    for page in folder.iterdir():
        if page.stem not in EFFECTS:
            page.unlink()
    for name, effect in EFFECTS.items():
        drawn = Path(app.srcdir) / "gallery/output/effect_signatures" / f"{name}.png"
        picture = folder / drawn.name
        if drawn.exists() and (not picture.exists() or picture.read_bytes() != drawn.read_bytes()):
            shutil.copy(drawn, picture)
        page, text = folder / f"{name}.md", page_text(effect, picture.exists())
        if not page.exists() or page.read_text("utf-8") != text:
            page.write_text(text, "utf-8")


def replace_list(app: Sphinx, docname: str, source: list[str]) -> None:
    """On the site the repository's page of all effects is the list of their pages."""
    if docname == LIST:
        source[0] = list_text()


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages after the gallery has run, before the sources are collected."""
    app.connect("builder-inited", write_pages, priority=900)
    app.connect("source-read", replace_list)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
