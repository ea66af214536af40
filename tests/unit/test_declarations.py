"""What is declared once in the code is what the documentation lists and what FMUs and the command line offer."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path

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
DRIVE_INPUTS = ["crank.phi", "crank.w", "output.phi", "output.w", "temperature"]
DRIVE_OUTPUTS = [
    *("output.tau", "crank.tau", "twist", "stiffness", "max_contact_force", "load_share", "in_range", "measured.tau")
]
JOINT_PARAMETERS = ["motor.inertia", "load.inertia", "motor.damping", "load.damping", "temperature"]


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


def test_the_variables_of_an_fmu_are_those_that_hosts_connect(model: DriveModel) -> None:
    """The names are a promise to models that contain an FMU; those of effects follow from their declarations."""
    inside = build_model(model.drive, {name: {} for name in EFFECTS}, lookup=model.lookup)
    parameters = [f"{effect.name}.{p.name}" for effect in EFFECTS.values() for p in effect.parameters]

    drive = declare(drive_component(inside))
    names = Counter(variable.name for variable in drive.variables)
    assert max(names.values()) == 1
    by_causality = {
        kind: [v.name for v in drive.variables if v.causality == kind] for kind in ("input", "output", "parameter")
    }
    assert by_causality["input"] == DRIVE_INPUTS == list(INPUT_NAMES)
    assert by_causality["output"] == DRIVE_OUTPUTS == [signal.name for signal in OUTPUTS]
    starts = {"start.torque", *(f"start.{effect.name}.{s.name}" for effect in EFFECTS.values() for s in effect.states)}
    assert set(by_causality["parameter"]) == {"ratio", "band", *parameters, *starts}

    joint = declare(joint_component(inside, TYPICAL_MASSES))
    found = {kind: {v.name for v in joint.variables if v.causality == kind} for kind in by_causality}
    assert found["input"] == {"motor.tau", "load.tau"}
    motion = {"crank.phi", "crank.w", "output.phi", "output.w"}
    assert found["output"] == motion | {name for name in DRIVE_OUTPUTS if name not in found["input"]}
    starts |= {f"start.{name}" for name in motion}
    assert found["parameter"] == {*JOINT_PARAMETERS, *starts, "ratio", "band", *parameters}
