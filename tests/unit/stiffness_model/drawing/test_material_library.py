"""The materials of the package: plausible, each with a source, each found by the words that people use."""

from __future__ import annotations

import pytest

import stiffness_model as sm
from stiffness_model.drawing.material_library import find_material
from stiffness_model.errors import UnknownNameError

GROUPS = {  # name in use: Young's modulus, GPa, and density, kg/m3, of handbooks for the group
    "steel": (190, 220, 7600, 8000),
    "aluminium": (68, 75, 2600, 2900),
    "brass": (90, 115, 8300, 8800),
    "bronze": (95, 120, 8500, 9000),
    "cast iron": (80, 145, 7000, 7400),
    "titanium": (105, 120, 4400, 4600),
    "polyoxymethylene": (2.5, 3.3, 1380, 1440),
    "polyether ether ketone": (3.5, 4.2, 1260, 1330),
    "nylon": (1.0, 3.5, 900, 1160),
    "polylactide": (2.5, 4.0, 1200, 1300),
    "ceramic": (290, 330, 3100, 3400),
}


def test_every_material_states_what_it_is_and_its_source() -> None:
    for material in sm.MATERIALS.values():
        assert material.description
        assert material.source
    groups = [group for m in sm.MATERIALS.values() for group in GROUPS if group in m.description]
    assert len(groups) == len(sm.MATERIALS), "each belongs to one group"


@pytest.mark.parametrize("group", GROUPS)
def test_constants_lie_in_the_range_of_their_group(group: str) -> None:
    low, high, light, heavy = GROUPS[group]
    members = [m for m in sm.MATERIALS.values() if group in m.description]
    assert members
    for material in members:
        assert low <= material.youngs_modulus / 1e9 <= high
        assert light <= material.density <= heavy
        assert 0.2 < material.poisson_ratio < 0.45


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("aluminum", "EN AW-6082"),
        ("peek", "PEEK"),
        ("Bronze", "CuSn11P"),
        ("stainless", "X105CrMo17"),
        ("nylon", "PA66"),
    ],
)
def test_a_word_in_use_is_answered_with_the_material(word: str, name: str) -> None:
    words = rf"unknown material '{word}'; did you mean .*'{name}'.*\[material.NAME\]"
    with pytest.raises(UnknownNameError, match=words):
        find_material(word, {})


def test_a_material_of_the_drawing_takes_precedence() -> None:
    own = sm.Material("POM", 3e9, 0.4, 1400.0)
    assert find_material("POM", {"POM": own}) is own
    with pytest.raises(UnknownNameError, match="did you mean 'mine'"):
        find_material("min", {"mine": own})
