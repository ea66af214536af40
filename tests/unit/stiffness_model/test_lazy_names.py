"""Names that are imported when they are first used: all that a package lists, and no other."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

PACKAGES = ("stiffness_model", "reefmu", "reefmu.model", "reefmu.joint")


@pytest.mark.parametrize("name", PACKAGES)
def test_every_listed_name_is_found_and_offered_for_completion(name: str) -> None:
    package = import_module(name)
    assert set(package.__all__) <= set(dir(package))
    for listed in package.__all__:
        assert getattr(package, listed) is not None
        assert listed in vars(package), "the second use finds it without looking it up"


@pytest.mark.parametrize("name", PACKAGES)
def test_another_name_is_no_attribute(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{name}' has no attribute 'simulte'"):
        _ = import_module(name).simulte


def test_the_package_alone_loads_neither_numpy_nor_scipy() -> None:
    code = "import sys, stiffness_model; print([m for m in ('numpy', 'scipy', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_published_alias_of_rotation_has_the_same_names() -> None:
    from stiffness_model import rotation, turning

    assert set(turning.__all__) == {*rotation.__all__, "turn"}
    assert turning.turn is rotation.angles_over_turn
    for name in rotation.__all__:
        assert getattr(turning, name) is getattr(rotation, name)
