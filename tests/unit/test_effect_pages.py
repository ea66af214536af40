"""The pages of the effects, as docs/_ext/effect_pages.py makes them from the declarations."""

from __future__ import annotations

import importlib.util
import re
import shlex
from pathlib import Path

import pytest

from reefmu.cli.parser import build_parser
from reefmu.effects import EFFECTS, Effect
from reefmu.planning.diagnosis_link import excluded_effects

EXTENSION = Path(__file__).parents[2] / "docs/_ext/effect_pages.py"


def page(effect: Effect) -> str:
    pytest.importorskip("sphinx", reason="Sphinx (extra docs) is not installed")
    spec = importlib.util.spec_from_file_location("effect_pages", EXTENSION)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.page_text(effect, has_picture=False)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))
def test_the_proposed_plan_is_for_candidates_only(effect: Effect) -> None:
    """A plan would answer that the others are no candidates."""
    never = excluded_effects(())
    calls = re.findall(r"`(reefmu plan [^`]*)`", page(effect))
    assert len(calls) == (effect.name not in never)
    for call in calls:
        effects = build_parser().parse_args(shlex.split(call)[1:]).effects
        assert effects[0] == effect.name
        assert not set(effects) & set(never)
