"""Commands that list what comes with the package: every entry once, all of it as JSON, and no unknown name."""

from __future__ import annotations

import json
import re
import shlex

import pytest

import stiffness_model as sm
from reefmu.cli import build_parser, main
from reefmu.effects import EFFECTS, Place
from reefmu.effects.effect_facts import effect_to_dict
from stiffness_model.catalog.gears import catalog


def test_effects_are_listed_once_below_their_places(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects"]) == 0
    blocks = capsys.readouterr().out.split("\n\n")[1:]
    listed = {block.split(":")[0]: re.findall(r"(?m)^  (\w+)  ", block) for block in blocks}
    assert listed == {p.name.lower(): [e.name for e in EFFECTS.values() if e.place is p] for p in Place}


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_is_described_in_full(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", name]) == 0
    shown = capsys.readouterr().out
    effect = EFFECTS[name]
    words = " ".join(shown.split())
    for text in (effect.title, effect.meaning, effect.place.value, effect.excitation, effect.source):
        assert text in words, text
    for p in effect.parameters:
        assert re.search(rf"{name}\.{p.name} +{re.escape(p.unit)} +{re.escape(f'{p.neutral:g}')} ", shown)
        assert p.description in words
    call = shown.split("example\n")[1].strip()
    build_parser().parse_args(shlex.split(call)[1:])


def test_effects_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == [effect_to_dict(effect) for effect in EFFECTS.values()]
    assert main(["effects", "creep", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["states"][0]["name"] == "creep.twist"


def test_an_unknown_effect_is_answered_with_the_closest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "hysterisis"]) == 2
    assert capsys.readouterr().err == "reefmu: unknown effect 'hysterisis'; did you mean 'hysteresis'?\n"


def test_gears_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gears", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [(gear["name"], gear["has_curve"]) for gear in listed] == [(gear.name, gear.has_curve) for gear in catalog()]
    assert listed[0]["k1"] == "100 kN.m/rad"


def test_materials_are_listed_with_their_values_and_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["materials"]) == 0
    shown = capsys.readouterr().out
    words = " ".join(shown.split())
    for material in sm.MATERIALS.values():
        assert f"{material.name} {material.youngs_modulus / 1e9:g} {material.poisson_ratio:.2f}" in words
        assert material.source in words
        assert material.description in words
    assert "[material.NAME]" in shown


def test_materials_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["materials", "--json"]) == 0
    listed = {material["name"]: material for material in json.loads(capsys.readouterr().out)}
    assert list(listed) == list(sm.MATERIALS)
    assert listed["EN-GJL-250"]["youngs_modulus [Pa]"] == 110e9
    assert listed["100Cr6"]["allowable_line_pressure [Pa]"] == 4e9
