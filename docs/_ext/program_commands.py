"""The directive `program-commands`: every command of `reefmu` with its arguments, from the argparse parser."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from reefmu.cli import build_parser


def commands_text(parser: argparse.ArgumentParser) -> str:
    """The commands of a parser in Markdown, one section for each."""
    found = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    summaries = {action.dest: action.help or "" for action in found._choices_actions}
    return "\n".join("\n".join(_section(name, sub, summaries[name])) for name, sub in found.choices.items())


def _section(name: str, parser: argparse.ArgumentParser, summary: str) -> Iterator[str]:
    yield f"({name}-command)=\n## reefmu {name}\n"
    description = parser.description or summary
    yield escaped(description[0].upper() + description[1:].rstrip(".")) + ".\n"
    formatter = argparse.HelpFormatter(parser.prog, width=88)
    formatter.add_usage(parser.usage, parser._actions, parser._mutually_exclusive_groups)
    yield f"```text\n{formatter.format_help().strip()}\n```\n"
    rows = [
        (_call(action), _help(parser, action))
        for action in parser._actions
        if action.help != argparse.SUPPRESS and not isinstance(action, argparse._HelpAction)
    ]
    if rows:
        yield "| argument | meaning |\n|---|---|"
        yield from (f"| {call} | {text} |" for call, text in rows)
    yield ""


def _call(action: argparse.Action) -> str:
    """The argument as one writes it."""
    value = action.metavar if isinstance(action.metavar, str) else None
    if value is None and action.choices is not None:
        value = "\\|".join(str(choice) for choice in action.choices)
    value = value or action.dest.upper()
    if not action.option_strings:
        return f"`{value}`"
    takes_value = "" if action.nargs == 0 else " " + value
    return " ".join(f"`{option}{takes_value}`" for option in action.option_strings)


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    text = parser._get_formatter()._expand_help(action) if action.help else ""
    return escaped(re.sub(r"\s+", " ", text))


def escaped(text: str) -> str:
    """Plain text for a cell of a table in Markdown."""
    return re.sub(r"([\\|*_<>\[\]$`])", r"\\\1", text)


class ProgramCommands(SphinxDirective):
    """Writes the sections of all commands."""

    has_content: ClassVar[bool] = False

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(commands_text(build_parser()), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("program-commands", ProgramCommands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
