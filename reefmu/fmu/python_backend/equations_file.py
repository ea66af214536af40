"""The equations of a component as a file, which an FMU of the Python back end contains and runs.

`equations.json` holds the component's functions as CasADi serialises them, the interface, and a digest of the code
from which they were built. An instance therefore builds nothing: it reads the functions within some hundredths of a
second, and it needs neither the lookup nor its solver, hence no SciPy.

The digest covers the source of every module that the model imports, directly or indirectly. A package with other code
is refused, because an FMU with its own equations would differ from the model that the same package simulates, checks
and diagnoses.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.metadata
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import stiffness_model
from stiffness_model.errors import InputError, expect

from ..model.kernel import substep_count
from ..model.variables import Interface, Variable

if TYPE_CHECKING:
    import casadi

    from ..model.component import Component

EQUATIONS_FILE = "equations.json"
"""Name of the file among the resources."""
_PACKAGES = {"reefmu": Path(__file__).parents[2], "stiffness_model": Path(str(stiffness_model.__file__)).parent}
_ROOTS = ("reefmu.model.drive_model", "reefmu.fmu.model.joint_component", "reefmu.fmu.model.kernel")
"""The modules that assemble the equations of both kinds and compute a step."""


@dataclass(frozen=True)
class StepEquations:
    """The functions of a `Component` that an instance needs; see there. start_limits: `StartFunctions.limits`."""

    initial: casadi.Function
    advance: casadi.Function
    output: casadi.Function
    start_limits: casadi.Function
    max_step: casadi.Function | None = None

    def substeps(self, dt: float, p: Any) -> int:
        """Number of equal substeps of a step of dt seconds."""
        return substep_count(self.max_step, dt, p)


def write_equations(component: Component, interface: Interface) -> bytes:
    """The content of `EQUATIONS_FILE`. The same model and code give the same bytes."""
    import casadi as ca

    assert component.start is not None
    serializer = ca.StringSerializer()
    serializer.pack(
        [
            component.initial,
            component.advance,
            component.output,
            component.start.limits,
            *([] if component.max_step is None else [component.max_step]),
        ]
    )
    modules, text = model_modules(), serializer.encode()
    return json.dumps(
        {
            "casadi": importlib.metadata.version("casadi"),
            "modules": modules,
            "code": code_digest(tuple(modules)),
            "interface": asdict(interface),
            "functions": text,
            "sum": hashlib.sha256(text.encode()).hexdigest(),
        }
    ).encode()


def read_equations(content: bytes, where: str) -> tuple[StepEquations, Interface]:
    """Equations and interface from the content of `EQUATIONS_FILE`.

    where: names the file in errors. Errors: `InputError` for damaged content, for a CasADi that cannot read the
    functions, and for an installed package with other equations.
    """
    try:
        table = json.loads(content)
        modules, code, interface = tuple(map(str, table["modules"])), table["code"], table["interface"]
        expect(
            code_digest(modules) == code,
            "a package with the equations that the FMU was exported with",
            "one with other code; export the FMU again, or install the package it came from",
            where,
        )
        # CasADi's reader does not validate: damaged content would crash the process.
        came = hashlib.sha256(table["functions"].encode()).hexdigest()
        expect(came == table["sum"], "functions as they were written", "damaged ones", where)
        functions = _functions(table["functions"], table["casadi"], where)
        variables = tuple(Variable(**_fields(row)) for row in interface["variables"])
        return StepEquations(*functions), Interface(interface["kind"], interface["name"], variables)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: expected the equations of an FMU, got {type(error).__name__}: {error}") from None


def _fields(row: dict[str, Any]) -> dict[str, Any]:
    """The fields of a `Variable` from JSON, which has lists in place of tuples."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in row.items()}


def _functions(text: str, version: str, where: str) -> list[casadi.Function]:
    import casadi as ca

    try:
        return list(ca.StringDeserializer(text).unpack())
    except RuntimeError as error:  # the only type that CasADi raises
        installed = importlib.metadata.version("casadi")
        came = f"{installed}: {' '.join(str(error).split())[-200:]}"
        raise InputError(f"{where}: expected a CasADi that reads functions of {version}, got {came}") from None


@functools.lru_cache(maxsize=8)
def code_digest(modules: tuple[str, ...]) -> str:
    """Hash of the source of modules such as "reefmu.model"; a module that does not exist counts as empty."""
    digest = hashlib.sha256()
    for name in modules:
        file = _source(name)
        digest.update(name.encode() + hashlib.sha256(b"" if file is None else file.read_bytes()).digest())
    return digest.hexdigest()


def model_modules() -> list[str]:
    """The modules of this project, sorted, that `_ROOTS` import directly or indirectly, also inside functions.

    >>> {"reefmu.effects.contact.backlash", "stiffness_model.numerics.bspline"} <= set(model_modules())
    True
    >>> any(name.startswith("reefmu.diagnosis") for name in model_modules())
    False
    """
    found: set[str] = set()
    waiting = list(_ROOTS)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [other for other in _imported(name) if _source(other) is not None]
    return sorted(found)


def _imported(name: str) -> Iterator[str]:
    """All names that a module imports; a name inside a module may itself be a module."""
    file = _source(name)
    assert file is not None
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parents = package.split(".")
                base = ".".join([*parents[: len(parents) + 1 - node.level], *([base] if base else [])])
            yield from (base, *(f"{base}.{alias.name}" for alias in node.names))


def _source(name: str) -> Path | None:
    """The file of a module of this project, or None."""
    top, *rest = name.split(".")
    if top not in _PACKAGES:
        return None
    place = _PACKAGES[top].joinpath(*rest)
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return file if file.is_file() else None
