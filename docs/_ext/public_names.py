"""The directive `public-names PACKAGE`: what a package offers in `__all__`, documented by autodoc from its docstrings.

Docstrings of the project are plain text with names in single backticks; here they become text that reStructuredText
reads as it is meant. A name that several packages offer is documented where it comes first in `PAGES`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

PAGES = (
    "stiffness_model",
    "stiffness_model.rotation",
    "reefmu.model",
    "reefmu.model_file",
    "reefmu.simulate",
    "reefmu.joint",
    "reefmu.robots",
    "reefmu.record",
    "reefmu.diagnosis",
    "reefmu.comparison",
    "reefmu.planning",
    "reefmu.inspection",
    "reefmu.effects",
    "reefmu.fmu.build",
    "reefmu",
)
LONGEST_VALUE = 100
"""Characters of a constant's value that is shown; chosen by judgement."""


def names_of(module_name: str) -> list[str]:
    """Names of `__all__`; of a module without it, the public functions and classes that it defines."""
    module = import_module(module_name)
    if hasattr(module, "__all__"):
        return list(module.__all__)
    own = (name for name, thing in vars(module).items() if getattr(thing, "__module__", "") == module_name)
    return [name for name in own if not name.startswith("_")]


def first_page_of() -> dict[int, str]:
    """The page on which each object is documented, by its identity."""
    found: dict[int, str] = {}
    for page in PAGES:
        for name in names_of(page):
            found.setdefault(id(getattr(import_module(page), name)), page)
    return found


def markup(module_name: str) -> str:
    """Directives of autodoc for the names of a package, within a block of reStructuredText."""
    module, where = import_module(module_name), first_page_of()
    lines: list[str] = []
    elsewhere: list[str] = []
    for name in sorted(names_of(module_name), key=str.lower):
        thing = getattr(module, name)
        if where[id(thing)] != module_name:
            elsewhere.append(f":py:obj:`~{where[id(thing)]}.{name}`")
            continue
        path = f"{module_name}.{name}"
        if inspect.isclass(thing):
            lines += [f".. autoclass:: {path}", "   :members:", ""]
        elif inspect.isroutine(thing):
            lines += [f".. autofunction:: {path}", ""]
        else:
            lines += [f".. py:data:: {path}", *_value(thing), ""]
    if elsewhere:
        lines = ["Offered here too: " + ", ".join(elsewhere) + ".", "", *lines]
    return "\n".join(lines)


def _value(constant: object) -> list[str]:
    """The value of a constant where it is short; its names where it is a mapping."""
    if isinstance(constant, Mapping):
        names = ", ".join(f"``{name}``" for name in constant)
        return ["", f"   By name: {names}."]
    text = repr(constant)
    return [f"   :value: {text}"] if len(text) < LONGEST_VALUE else []


def as_restructured_text(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Make names in single backticks literal, and escape what reStructuredText would take for markup."""
    lines[:] = converted("\n".join(lines)).split("\n")


def short_aliases(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Names of type aliases within unions as autodoc writes them elsewhere."""
    short = [text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in (signature, returns)]
    return short[0], short[1]


def converted(text: str) -> str:
    """A docstring as reStructuredText; doctests and indented blocks stay.

    >>> converted("The `twist` of x*, |i|.")
    'The ``twist`` of x\\\\*, \\\\|i\\\\|.'
    """
    paragraphs = re.split(r"\n\s*\n", text)
    return "\n\n".join(part if _is_literal(part) else _prose(part) for part in paragraphs)


def _is_literal(paragraph: str) -> bool:
    return paragraph.lstrip().startswith(">>>") or "::" in paragraph


def _prose(paragraph: str) -> str:
    if paragraph.startswith("    "):
        return "::\n\n" + paragraph
    pieces = re.split(r"(`[^`]+`)", paragraph)
    plain = [
        f"`{piece}`" if k % 2 else re.sub(r"(^\* )|([*|]|_(?=\W|$))", _escape, piece, flags=re.M)
        for k, piece in enumerate(pieces)
    ]
    return "".join(plain)


def _escape(found: re.Match[str]) -> str:
    """The mark of an item of a list stays."""
    return found[1] or f"\\{found[2]}"


class PublicNames(SphinxDirective):
    """Documents the public names of one package."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        text = "```{eval-rst}\n" + markup(self.arguments[0]) + "\n```\n"
        return self.parse_text_to_nodes(text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive and the conversion of docstrings."""
    app.add_directive("public-names", PublicNames)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-process-signature", short_aliases)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
