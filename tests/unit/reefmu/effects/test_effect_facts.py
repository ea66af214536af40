"""What follows from the declarations: confusions that both effects name, and values that `--effect` reads back."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import pytest

from reefmu.cli.parser import build_parser
from reefmu.commands.fmus.effect_values import effect_values
from reefmu.effects import EFFECTS, Effect, declared_test
from reefmu.effects.effect_facts import confusions, effect_to_dict, example_value
from stiffness_model.errors import InputError

ALL = list(EFFECTS.values())
PAGES = Path(__file__).parents[4] / "docs" / "_ext" / "effect_pages.py"


def test_a_confusion_is_mutual() -> None:
    found = {(effect.name, other.name) for effect in ALL for other in confusions(effect)}
    assert found == {(other, name) for name, other in found}
    assert {("backlash", "preload"), ("creep", "structural_compliance"), ("missing_ball", "kinematic_error")} <= found
    assert ("backlash", "hysteresis") not in found


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_every_effect_that_a_test_separates_is_one_to_confuse_it_with(effect: Effect) -> None:
    tests = {other.name: other.test for other in confusions(effect)}
    for other in ALL:
        if declared_test(effect.name, other.name):
            assert tests[other.name] == declared_test(effect.name, other.name)


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_examples_are_values_that_the_command_line_reads(effect: Effect) -> None:
    words = [f"{effect.name}.{p.name}={example_value(p)}" for p in effect.parameters]
    read = effect_values(words)[effect.name]
    assert read == {p.name: pytest.approx(p.nominal, rel=1e-12) for p in effect.parameters}


@pytest.mark.parametrize("effect", ALL, ids=lambda e: e.name)
def test_the_call_on_the_page_of_an_effect_is_one_that_the_program_reads(effect: Effect) -> None:
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    page = runpy.run_path(str(PAGES))["page_text"](effect, False)
    (call,) = re.findall(r"```sh\n(.*)\n```", page)
    args = build_parser().parse_args(shlex.split(call)[1:])
    first = effect.parameters[0]
    assert effect_values(args.effect)[effect.name] == {first.name: pytest.approx(first.nominal, rel=1e-12)}


def test_a_value_without_its_unit_is_answered_with_the_unit() -> None:
    with pytest.raises(InputError, match=r"expected a text with its unit, such as '1 rad/\(N.m\)', got '1e-6'"):
        effect_values(["creep.compliance=1e-6"])


def test_the_table_holds_every_parameter_and_state() -> None:
    for effect in ALL:
        table = effect_to_dict(effect)
        assert [p["name"] for p in table["parameters"]] == [f"{effect.name}.{p.name}" for p in effect.parameters]
        assert len(table["states"]) == len(effect.states)
        assert effect.parameters[0].name in table["example"]
