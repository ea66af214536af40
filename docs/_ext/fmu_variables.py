"""The directive `fmu-variables drive` (or `joint`): the variables of an FMU, from the declaration that exports it."""

from __future__ import annotations

from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.variables import Variable
from reefmu.model import build_model
from reefmu.model.masses import TYPICAL_MASSES

CAUSALITIES = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters",
}
DRIVES = 60
"""Virtual drives behind the tables, as in the examples, which have solved them: the variables do not depend on it."""


def variables_text(kind: str) -> str:
    """The variables of an FMU of a kind, "drive" or "joint", in Markdown, a table for each causality."""
    model = build_model("drive_1", n_drives=DRIVES)
    component = drive_component(model) if kind == "drive" else joint_component(model, TYPICAL_MASSES)
    variables = declare(component).variables
    return "\n".join(
        _table(title, [v for v in variables if v.causality == causality]) for causality, title in CAUSALITIES.items()
    )


def _table(title: str, variables: list[Variable]) -> str:
    has_start = any(v.start is not None for v in variables)
    head = ("variable", "unit", *(("start",) if has_start else ()), "meaning")
    rows = [
        (f"`{v.name}`", v.unit, *((f"{v.start:g}" if v.start is not None else "",) if has_start else ()), v.description)
        for v in variables
    ]
    lines = [head, ("---",) * len(head), *rows]
    return f"**{title}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


class FmuVariables(SphinxDirective):
    """Writes the tables of one kind."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(variables_text(self.arguments[0]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("fmu-variables", FmuVariables)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
