"""A package's names, imported from their modules when they are first used.

Importing a package that offers names of heavy modules (SciPy, CasADi, python-control) would otherwise load all of them,
which takes seconds. Type checkers do not follow this: the package repeats its imports under `TYPE_CHECKING`, and lists
its names in `__all__`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, modules: Mapping[str, Iterable[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package (PEP 562).

    package: its `__name__`. modules: names by the module that defines them, relative to the package (".units").
    `__getattr__` raises `AttributeError` for any other name.

    >>> get, _ = lazy_names("stiffness_model", {".units": ["ARCMIN"]})
    >>> round(get("ARCMIN"), 6)
    0.000291
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def get(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(module_of[name], package), name)
        # From now on the name is found without this function.
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *module_of})

    return get, names
