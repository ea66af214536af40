"""The C sources of a native FMU: generated files beside handwritten ones.

The handwritten files in `native/` are the same for every FMU. Generated are `equations.c` (the functions, by CasADi),
`stage_order.c` (their order), `tables.h` (the lookup) and `model.h` (sizes and variables). In an FMU all files are in
one folder, and `all.c` includes the others, so that a single file is compiled.
"""

from __future__ import annotations

import importlib.resources
import json
import math
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from stiffness_model.io.atomic_files import scratch_folder
from stiffness_model.lookup.build_lookup import QUANTITIES

from ..model.component import Component
from ..model.start.start_parameters import REFUSAL
from ..model.start.start_search import HALVINGS
from ..model.table_encoding import TABLES, embedded_lookup, encode_tables
from ..model.variables import FMI2, Causality, FmiVersion, Interface, Variable
from .functions import GeneratedFunctions, make_functions
from .stage_order import STAGE_ORDER, stage_order

MAIN_SOURCE = "all.c"
"""The file to compile."""
FMI2_MAIN, FMI3_MAIN = "fmi2_all.c", "fmi3_all.c"
"""The names of that file in `native/`. The one for FMI 3.0 includes the one for FMI 2.0."""
MAX_SUBSTEPS = 1e7
"""Greatest number of substeps of one communication step of a joint; a step that needs more is refused. Chosen by
judgement, to bound the computing time."""


class _Identity(NamedTuple):
    """What distinguishes the sources of two FMUs of the same model and kind."""

    guid: str
    identifier: str
    standard: FmiVersion


def make_sources(
    component: Component, interface: Interface, guid: str, identifier: str, standard: FmiVersion = FMI2
) -> dict[str, bytes]:
    """The files of an FMU's folder `sources`, by name.

    interface: with derivatives (`declare_with_derivatives`). identifier: the model identifier, with which the names of
    all exported functions begin.
    """
    files = wrapper_files("fmi2", "model", "numerics")
    files[MAIN_SOURCE] = files.pop(FMI2_MAIN)
    functions = make_functions(component)
    equations, sizes = _equations(functions)
    files["equations.c"] = equations.encode()
    files[STAGE_ORDER] = stage_order(functions).encode()
    files["model.h"] = _header(component, functions, interface, _Identity(guid, identifier, standard), sizes).encode()
    files[TABLES] = encode_tables(embedded_lookup(component.model)).encode()
    return files


def wrapper_files(*folders: str) -> dict[str, bytes]:
    """The C files in these folders of `native/`, by name without the folder."""
    native = importlib.resources.files("reefmu.fmu") / "native"
    return {
        file.name: file.read_bytes()
        for folder in folders
        for file in sorted((native / folder).iterdir(), key=lambda file: file.name)
        if file.name.endswith((".c", ".h"))
    }


def with_guid(files: Mapping[str, bytes], guid: str) -> dict[str, bytes]:
    """The same files with another GUID."""
    header, changes = re.subn(
        rb'(?m)^#define MODEL_GUID ".*"$', f'#define MODEL_GUID "{guid}"'.encode(), files["model.h"]
    )
    assert changes == 1
    return {**files, "model.h": header}


def _equations(functions: GeneratedFunctions) -> tuple[str, dict[str, int]]:
    """The generated functions, and the sizes of the working memory that the largest of them needs."""
    import casadi as ca

    generator = ca.CodeGenerator("equations.c", {"with_header": False, "main": False, "casadi_int": "int"})
    for name, function in functions.functions.items():
        assert function.name() == name
        generator.add(function)
    with scratch_folder() as folder:
        text = Path(generator.generate(f"{folder}/")).read_text("utf-8")
    generated = list(functions.functions.values())
    sizes = {
        "INTEGERS": 1 + max(f.sz_iw() for f in generated),
        "WORK": 1 + max(f.sz_w() for f in generated),
        "ARGUMENTS": max(f.sz_arg() for f in generated),
        "RESULTS": max(f.sz_res() for f in generated),
    }
    return _with_static_helpers(_without_introspection(text, functions.functions)), sizes


def _with_static_helpers(text: str) -> str:
    """With CasADi's helper functions static, since several FMUs may be linked into one program."""
    return re.sub(
        r"^(?!static\b|CASADI_SYMBOL_EXPORT\b)(?=[A-Za-z][\w* ]*\bcasadi_\w+\()", "static ", text, flags=re.MULTILINE
    )


def _without_introspection(text: str, functions: Iterable[str]) -> str:
    """Without the functions that only CasADi's own loader calls to read names and sizes."""
    kept = "|".join(functions)
    one = rf"^CASADI_SYMBOL_EXPORT (?!int (?:{kept})\()[^\n]*(?:\}}\n|\{{\n.*?^\}}\n)\n?"
    return re.sub(one, "", text, flags=re.MULTILINE | re.DOTALL)


def function_prefix(identifier: str, standard: FmiVersion) -> str:
    """The function prefix that the standard requires in sources (FMI 2.0.4, section 2.1.1; FMI 3.0.2, section 2.2.1).

    It is left out where the host defines it, and for a shared library built by CMake, which defines the macro
    <identifier>_EXPORTS.
    """
    macro = f"FMI{standard.version[0]}"
    return (
        f"#if !defined({macro}_FUNCTION_PREFIX) && !defined({identifier}_EXPORTS)\n"
        f"#define {macro}_FUNCTION_PREFIX {identifier}_\n#endif\n"
    )


def _header(
    component: Component, functions: GeneratedFunctions, interface: Interface, names: _Identity, sizes: dict[str, int]
) -> str:
    """The file `model.h`: sizes, enumerations and the table of variables."""
    from reefmu.model.contacts.equilibrium import NEWTON_STEPS, NEWTON_TOLERANCE
    from reefmu.model.stages.order import CONTACT_OUTPUTS

    n_u, n_y, n_x = len(component.inputs), len(component.outputs), len(component.states)
    stages = functions.stages
    outputs = [s.name for s in component.outputs]
    numbers = {
        "N_INPUTS": n_u,
        "N_OUTPUTS": n_y,
        "N_PARAMETERS": len(component.parameters),
        "N_STATES": n_x,
        "N_VALUES": len(interface.variables),
        "N_UNKNOWNS": n_y + n_x,
        "N_KNOWNS": n_u + n_x + len(component.parameters),
        "N_INDICATORS": component.n_indicators,
        "FIRST_INDICATOR": component.first_indicator,
        "IS_JOINT": int(component.kind == "joint"),
        "HAS_CONTACT_FUNCTION": int(stages.contact_function is not None),
        "HAS_ANGLE": int("angle" in stages.point_names),
        "HAS_ANGLE_STATES": int(stages.has_angle_states),
        "HAS_SERIES_COMPLIANCE": int(stages.has_series_compliance),
        "N_MOTION": functions.n_motion,
        "DISCRETE_OUTPUT": [s.discrete for s in component.outputs].index(True),
        "TORQUE_OUTPUT": outputs.index("output.tau"),
        "CRANK_TORQUE_OUTPUT": outputs.index("crank.tau"),
        "TWIST_OUTPUT": outputs.index("twist"),
        "STIFFNESS_OUTPUT": outputs.index("stiffness"),
        "HAS_START": int(component.start is not None),
        **_start_macros(component),
        "MAX_SUBSTEPS": MAX_SUBSTEPS,
        "NEWTON_STEPS": NEWTON_STEPS,
        "NEWTON_TOLERANCE": NEWTON_TOLERANCE,
        **{f"N_{name}": size for name, size in sizes.items()},
    }
    orders = {
        "CONTACT_POINT": stages.point_names,
        "COEFFICIENTS": stages.coefficient_names,
        "CONTACT": CONTACT_OUTPUTS,
        "TABLE": [f"table_{name}" for name in QUANTITIES],
    }
    enums = "".join(
        f"enum {{ {', '.join(name.upper() for name in names)}, N_{title} }};\n" for title, names in orders.items()
    )
    counts: dict[Causality, int] = {"input": n_u, "output": n_y, "parameter": len(component.parameters), "local": n_x}
    rows = "".join(variable_row(v, counts) for v in interface.variables)
    numbers["FIRST_REFERENCE"] = names.standard.first_reference
    defines = "".join(f"#define {name} {value}\n" for name, value in numbers.items())
    return (
        f"/* {interface.kind} {json.dumps(_ascii(interface.name))}: sizes and variables. Generated. */\n\n"
        '#ifndef MODEL_H\n#define MODEL_H\n\n#include "variable.h"\n\n'
        f'{function_prefix(names.identifier, names.standard)}#define MODEL_GUID "{names.guid}"\n{defines}\n{enums}\n'
        f"static const Variable VARIABLES[N_VALUES] = {{\n{rows}}};\n\n#endif\n"
    )


def _start_macros(component: Component) -> dict[str, object]:
    """Macros of the search for the states at the start."""
    if component.start is None:
        return {}
    search = component.start.search
    return {
        "START_TORQUE": search.torque,
        "START_SETTLES": int(search.settles),
        "START_REACH": search.reach,
        "START_HALVINGS": HALVINGS,
        "START_STIFFNESS_FLOOR": search.stiffness_floor,
        "START_REFUSAL": json.dumps(REFUSAL),
    }


def variable_row(v: Variable, counts: Mapping[Causality, int]) -> str:
    """One row of the table of variables. counts: number of variables in each block, derivatives excluded."""
    n_u, n_y, n_x = counts["input"], counts["output"], counts["local"]
    first_state = n_u + n_y + counts["parameter"]
    known = unknown = -1
    access, stale = "RESULT", "FRESH"
    if v.causality == "input":
        access, known = "INPUT", v.reference
    elif v.causality == "parameter":
        access, known = v.variability.upper(), n_x + v.reference - n_y  # after inputs and states
    elif v.causality == "output":
        stale, unknown = "STALE_OUTPUTS", v.reference - n_u
    elif v.derivative_of:
        stale, unknown = "STALE_RATES", n_y + v.reference - first_state - n_x
    else:
        access, stale, known = "STATE", "STALE_STATES", n_u + v.reference - first_state
        unknown = n_y + n_x + v.reference - first_state
    low, high = v.limits if access != "RESULT" else (-sys.float_info.max, sys.float_info.max)
    numbers = ", ".join(repr(float(x)) for x in (v.start or 0.0, low, high, v.nominal or 1.0))
    assert all(math.isfinite(x) for x in (low, high))
    return (
        f"    {{{json.dumps(_ascii(v.name))}, {json.dumps(_ascii(v.unit))}, {access}, {numbers}, {stale}, "
        f"{known}, {unknown}}},\n"
    )


def _ascii(text: str) -> str:
    """`text` in ASCII, without characters that have a meaning in a C comment or in the host's log."""
    return re.sub(r"[^ -~]|[%#\\]|\*/|\?\?", "?", text)
