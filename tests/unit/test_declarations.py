"""What is declared once in the code is what the documentation lists and what FMUs and the command line offer."""

from __future__ import annotations

import ast
import re
import shlex
from collections import Counter
from pathlib import Path

import pytest

from reefmu.cli import build_parser
from reefmu.diagnosis.report.text import MEANING
from reefmu.diagnosis.schema import VERDICTS
from reefmu.effects import EFFECTS
from reefmu.effects.effects_page import markdown
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare
from reefmu.fmu.model.joint_component import joint_component
from reefmu.model import DriveModel, build_model
from reefmu.model.masses import TYPICAL_MASSES
from reefmu.model.signals import INPUT_NAMES, OUTPUTS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")


def names_in_table(text: str, first_cell: str) -> list[list[str]]:
    """Words in backticks of every table row that begins with the cell."""
    rows = re.findall(rf"(?m)^\| `?{re.escape(first_cell)}`? \|(.*)$", text)
    return [re.findall(r"`([^`]+)`", row) for row in rows]


def test_every_file_of_an_effect_declares_one_effect_of_its_name() -> None:
    files = [path for path in (ROOT / "reefmu/effects").glob("*/*.py") if path.name != "__init__.py"]
    declared: Counter[str] = Counter()
    for path in files:
        calls = [node for node in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(node, ast.Call)]
        effects = [call for call in calls if isinstance(call.func, ast.Name) and call.func.id == "Effect"]
        names = [ast.literal_eval(k.value) for call in effects for k in call.keywords if k.arg == "name"]
        assert names == ([path.stem] if effects else []), path
        declared.update(names)
    assert declared == Counter(list(EFFECTS))


def test_the_page_of_the_effects_is_that_of_their_declarations() -> None:
    page = (ROOT / "docs/reference/effects.md").read_text("utf-8")
    assert page == markdown(), "python -m reefmu.effects.effects_page > docs/reference/effects.md"


def test_the_verdicts_are_those_that_code_documentation_and_report_name() -> None:
    page = (ROOT / "docs/explanation/diagnosis.md").read_text("utf-8")
    documented = re.findall(r"(?m)^\| `(\w+)` \|", page.split("| verdict | meaning |")[1].split("\n\n")[0])
    assert documented == list(MEANING)
    assert set(MEANING) == set(VERDICTS)
    conclusions = (ROOT / "reefmu/diagnosis").rglob("*.py")
    given = {word for path in conclusions for word in re.findall(r'verdict ?= ?"(\w+)"', path.read_text("utf-8"))}
    assert given <= set(VERDICTS)


def test_the_variables_of_an_fmu_are_those_of_the_readme_and_the_effects(model: DriveModel) -> None:
    inside = build_model(model.drive, {name: {} for name in EFFECTS}, lookup=model.lookup)
    (drive_inputs, joint_inputs), (drive_outputs, joint_outputs) = (
        names_in_table(README, kind) for kind in ("inputs", "outputs")
    )
    _, joint_parameters = names_in_table(README, "parameters")
    parameters = [f"{effect.name}.{p.name}" for effect in EFFECTS.values() for p in effect.parameters]

    drive = declare(drive_component(inside))
    names = Counter(variable.name for variable in drive.variables)
    assert max(names.values()) == 1
    by_causality = {
        kind: [v.name for v in drive.variables if v.causality == kind] for kind in ("input", "output", "parameter")
    }
    assert by_causality["input"] == drive_inputs == list(INPUT_NAMES)
    assert by_causality["output"] == drive_outputs == [signal.name for signal in OUTPUTS]
    assert set(by_causality["parameter"]) == {"ratio", "band", *parameters}

    joint = declare(joint_component(inside, TYPICAL_MASSES))
    found = {kind: {v.name for v in joint.variables if v.causality == kind} for kind in by_causality}
    assert found["input"] == set(joint_inputs)
    assert found["output"] == set(joint_outputs) | {name for name in drive_outputs if name not in found["input"]}
    starts = {name for name in found["parameter"] if name.startswith("start.")}
    assert found["parameter"] == {*joint_parameters, *starts, "ratio", "band", *parameters} - {"start.*"}


def readme_calls() -> list[str]:
    """The calls of the program in the README's blocks of code, without the remarks beside them."""
    blocks = re.findall(r"```(?:sh)?\n(.*?)```", README, re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line.startswith("reefmu ")]
    return [re.split(r"\s{3,}", line)[0] for line in lines]


@pytest.mark.parametrize("call", readme_calls())
def test_the_calls_of_the_readme_are_understood(call: str) -> None:
    build_parser().parse_args(shlex.split(call)[1:])


def test_the_readme_shows_every_command() -> None:
    commands = re.findall(r"(?m)^    (\w+)", build_parser().format_help().split("COMMAND\n")[1])
    assert len(commands) > 7
    assert [command for command in commands if f"reefmu {command}" not in README] == []
