"""C sources of a native FMU: the component's functions and tables, generated, beside the wrapper as it stands.

The wrapper in `native/` is the same for every FMU. Generated are `equations.c`, the functions as CasADi writes
them, and `model.h`, sizes and the table of variables. `all.c` includes the rest, so one file is compiled.
"""

from __future__ import annotations

import importlib.resources
import json
import math
import re
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from .component import Component
from .interface import Interface, Variable

UNIT = "all.c"
"""The file to compile."""
MOST_PARTS = 1e7
"""Most parts of one communication step of a component that integrates itself; more are refused."""
_WRAPPER = ("all.c", "calls.c", "cosimulation.c", "derivatives.c", "exchange.c", "fmi2_api.h", "instance.h", "life.c",
            "log.c", "model.c", "saved.c", "values.c", "variable.h")


def sources(component: Component, interface: Interface, guid: str) -> dict[str, bytes]:
    """Every file of `sources` by name. interface: with the derivatives (`declare_exchange`)."""
    wrapper = importlib.resources.files("reefmu.fmu") / "native"
    files = {name: (wrapper / name).read_bytes() for name in _WRAPPER}
    equations, sizes = _equations(component)
    files["equations.c"] = equations.encode()
    files["model.h"] = _header(component, interface, guid, sizes).encode()
    return files


def _equations(component: Component) -> tuple[str, dict[str, int]]:
    """The generated functions, and the work space that the greatest of them needs."""
    import casadi as ca

    functions = {"initial": component.initial, "advance": component.advance, "rate": component.rate,
                 "output": component.output, "tangent": component.tangent}
    if component.pace is not None:
        functions["pace"] = component.pace
    # With integers of the platform's int the table's indices need no wider conversion.
    generator = ca.CodeGenerator("equations.c", {"with_header": False, "main": False, "casadi_int": "int"})
    for name, function in functions.items():
        assert function.name() == name
        generator.add(function)
    with tempfile.TemporaryDirectory(prefix="reefmu-generate-") as folder:
        text = Path(generator.generate(folder + "/")).read_text("utf-8")
    call = list(functions.values())
    sizes = {"ARGUMENTS": max(4, *(f.sz_arg() for f in call)), "RESULTS": max(f.sz_res() for f in call),
             "INTEGERS": 1 + max(f.sz_iw() for f in call), "WORK": 1 + max(f.sz_w() for f in call)}
    return copied_runs(_without_queries(text, functions)), sizes


def _without_queries(text: str, functions: Iterable[str]) -> str:
    """Without the functions by which CasADi's own loader asks for names and sizes: nobody calls them here."""
    kept = "|".join(functions)
    one = rf"^CASADI_SYMBOL_EXPORT (?!int (?:{kept})\()[^\n]*(?:\}}\n|\{{\n.*?^\}}\n)\n?"
    return re.sub(one, "", text, flags=re.MULTILINE | re.DOTALL)


_GATHER = re.compile(
    r"^  for \(i=0, rr=(?P<index>\w+), cr=(?P<offsets>\w+); i<(?P<n>\d+); \+\+i\) \(\*rr\+\+\)  = "
    r"\(\(\*cr\+\+\)\+(?P<start>\w+)\);\n(?P<comment>  /\*[^\n]*\*/\n)"
    r"  for \(rr=(?P<to>\w+), cr=(?P=index); rr!=(?P=to)\+(?P=n); \+\+rr\) \{ i=\(int\) \*cr\+\+; "
    r"\*rr = i>=0 && i<(?P<size>\d+) \? (?P<table>\w+)\[i\] : casadi_nan; \}\n", re.MULTILINE)


def copied_runs(text: str) -> str:
    """Generated C with the look-up of a table's cell as copies of runs, instead of one index at a time.

    CasADi adds the cell's start to a list of offsets, in doubles, and looks every one up: most of the time of a
    step. The offsets are constant and stand in runs. Code of another shape (another version of CasADi) is left
    as it is, and is right as well. The first index is held to the table as each was before.
    """
    def replace(match: re.Match[str]) -> str:
        bound = re.findall(rf"^  {match['offsets']} = (casadi_c\d+);", text[:match.start()], re.MULTILINE)
        values = bound and re.search(rf"^static const casadi_real {bound[-1]}\[\d+\] =\s*\{{(.*?)\}};", text,
                                     re.MULTILINE | re.DOTALL)
        if not values:
            return match[0]
        offsets = [int(float(x)) for x in values[1].split(",")]
        starts = [k for k, x in enumerate(offsets) if k == 0 or x != offsets[k - 1] + 1]
        runs = "".join(f" memcpy({match['to']}+{k}, cr+{offsets[k]}, {end - k}*sizeof(casadi_real));"
                       for k, end in zip(starts, [*starts[1:], len(offsets)], strict=True))
        last = int(match["size"]) - 1 - max(offsets)
        return (f"{match['comment']}  i=(int) casadi_fmin({last}, casadi_fmax(0, {match['start']})); "
                f"cr={match['table']}+i;{runs}\n")

    return _GATHER.sub(replace, text)


def _header(component: Component, interface: Interface, guid: str, sizes: dict[str, int]) -> str:
    n_u, n_y, n_x = len(component.inputs), len(component.outputs), len(component.states)
    numbers = {
        "N_INPUTS": n_u, "N_OUTPUTS": n_y, "N_PARAMETERS": len(component.parameters), "N_STATES": n_x,
        "N_VALUES": len(interface.variables), "N_KNOWNS": n_u + n_x, "N_UNKNOWNS": n_y + n_x,
        "N_INDICATORS": component.switches, "FIRST_INDICATOR": component.first_switch,
        "HAS_PACE": int(component.pace is not None), **{f"N_{name}": size for name, size in sizes.items()},
    }
    rows = "".join(_row(v, component, interface) for v in interface.variables)
    defines = "".join(f"#define {name} {value}\n" for name, value in numbers.items())
    return (f"/* {interface.kind} {json.dumps(_plain(interface.name))}: sizes and variables. Generated. */\n\n"
            "#ifndef MODEL_H\n#define MODEL_H\n\n#include \"variable.h\"\n\n"
            f"#define MODEL_GUID \"{guid}\"\n{defines}#define MOST_PARTS {MOST_PARTS!r}\n\n"
            f"static const Variable VARIABLES[N_VALUES] = {{\n{rows}}};\n\n#endif\n")


def _row(v: Variable, component: Component, interface: Interface) -> str:
    """One line of the table of variables."""
    n_u, n_y = len(component.inputs), len(component.outputs)
    n_x, first_state = len(component.states), n_u + n_y + len(component.parameters)
    known = unknown = -1
    access, stale = "RESULT", "FRESH"
    if v.causality == "input":
        access, known = "INPUT", v.reference
    elif v.causality == "parameter":
        access = v.variability.upper()
    elif v.causality == "output":
        stale, unknown = "STALE_OUTPUTS", v.reference - n_u
    elif v.derivative_of:
        stale, unknown = "STALE_RATES", n_y + v.reference - first_state - n_x
    else:
        stale, known = "STALE_STATES", n_u + v.reference - first_state
    low, high = v.limits if access != "RESULT" else (-sys.float_info.max, sys.float_info.max)
    numbers = ", ".join(repr(float(x)) for x in (v.start or 0.0, low, high, v.nominal or 1.0))
    assert all(math.isfinite(x) for x in (low, high))
    return f"    {{{json.dumps(_plain(v.name))}, {json.dumps(_plain(v.unit))}, {access}, {numbers}, {stale}, " \
           f"{known}, {unknown}}},\n"


def _plain(text: str) -> str:
    """`text` in ASCII, without what a comment or the host's log would read as a sign of its own."""
    return re.sub(r"[^ -~]|[%#\\]|\*/|\?\?", "?", text)
