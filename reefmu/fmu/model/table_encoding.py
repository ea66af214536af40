"""The lookup's tables encoded as C source, and decoded from it.

Floating-point tables hardly compress, and both the binary and the sources contain them. They are therefore encoded:

* quantised to integer multiples of a quantum, at most 3e-14 of full torque or 6e-14 of the greatest force, which is
  negligible against the lookup's error bound of 1e-4;
* reduced to twists from zero up, because every quantity is odd or even in the twist;
* replaced by differences, second ones along the twist and first ones along the clearance, which are small because the
  tables are smooth;
* stored with the sign in the lowest bit and with the bytes in planes, the lowest byte of all numbers first, so that
  the upper planes, which are nearly all zero, compress well or are left out.

`native/numerics/table_decoding.c` decodes them. An individual needs no table but that of a missing element; see
`embedded_lookup`.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict, astuple, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import InputError, expect
from stiffness_model.lookup.build_lookup import QUANTITIES, Lookup
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.lookup.table_files import parse_axis, parse_json, require_keys
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import Axis

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel

TABLES = "tables.h"
"""Name of the file among the sources."""
_TORQUE_BITS, _OTHER_BITS = 46, 45
"""Bits of resolution, relative to full torque and to the greatest value of another quantity."""
_SYMMETRY = 1e-9
"""Greatest asymmetry of a table relative to its greatest value; rounding accounts for 1e-15."""


def embedded_lookup(model: DriveModel) -> Lookup:
    """The lookup that the C of a model contains: for an individual without the tables over twist and clearance."""
    if model.individual is None:
        return model.lookup
    return replace(model.lookup, coefficients=np.zeros((len(QUANTITIES), 0, 0)))


def encode_tables(lookup: Lookup) -> str:
    """The file `TABLES`: axes, quanta and encoded numbers as C source."""
    numbers: dict[str, Any] = {}
    arrays = ""
    if lookup.coefficients.size:
        numbers, arrays = _lookup_macros(lookup)
    numbers["HAS_ELEMENT"] = int(lookup.element is not None)
    if (element := lookup.element) is not None:
        quantum = _quantum(lookup.full_torque, _TORQUE_BITS)
        shape = element.coefficients.shape
        planes, words = _encode(element.coefficients[None], [quantum])
        numbers |= {
            "ELEMENT_ROWS": shape[0],
            "ELEMENT_COLUMNS": shape[1],
            "ELEMENT_LAYERS": shape[2],
            **_axis("ELEMENT_TWIST", element.twist),
            **_axis("ELEMENT_CLEARANCE", element.clearance),
            **_axis("ELEMENT_POSITION", element.position),
            "ELEMENT_LIMIT": float(element.limit),
            "ELEMENT_EDGE": FADE_HALF_WIDTH,
            "ELEMENT_QUANTUM": quantum,
            "ELEMENT_PLANES": planes,
        }
        arrays += _array("ELEMENT_WORDS", words)
    defines = "".join(
        f"#define {name} {value if isinstance(value, str) else repr(value)}\n" for name, value in numbers.items()
    )
    return (
        "/* Generated. The lookup's tables, encoded as described in table_decoding.c. */\n\n"
        "#ifndef TABLES_H\n#define TABLES_H\n\n"
        f"#include <stdint.h>\n\n{defines}\n{arrays}\n#endif\n"
    )


def _lookup_macros(lookup: Lookup) -> tuple[dict[str, Any], str]:
    half = _nonnegative_half(lookup)
    quanta = [_quantum(lookup.full_torque, _TORQUE_BITS)] * 3 + [
        _quantum(float(np.abs(table).max()), _OTHER_BITS) for table in half[3:]
    ]
    planes, words = _encode(half[..., None], quanta)
    n_q, rows, columns = half.shape
    return {
        "LOOKUP_QUANTITIES": n_q,
        "LOOKUP_ROWS": rows,
        "LOOKUP_COLUMNS": columns,
        "LOOKUP_TWIST_STEP": lookup.twist.step,
        "LOOKUP_TWIST_CELLS": rows - 3,
        **_axis("LOOKUP_CLEARANCE", lookup.clearance),
        "LOOKUP_QUANTA": f"{{{', '.join(map(repr, quanta))}}}",
        "LOOKUP_PLANES": planes,
    }, _array("LOOKUP_WORDS", words)


def lookup_metadata(lookup: Lookup) -> str:
    """The file `lookup.json`: everything of a lookup that `encode_tables` leaves out."""
    return json.dumps(
        {
            "full_torque": lookup.full_torque,
            "error": dict(lookup.error),
            "drawing": lookup.drawing,
            "n_drives": lookup.n_drives,
            "seed": lookup.seed,
            "version": lookup.version,
            "twist": astuple(lookup.twist),
            "clearance": astuple(lookup.clearance),
            "modulus": None if lookup.modulus is None else asdict(lookup.modulus),
            "element": None if lookup.element is None else lookup.element.header(),
            **({} if lookup.coefficients.size else {"tables": False}),
        }
    )


def decode_tables(source: str, metadata: str, where: str) -> Lookup:
    """The lookup from the files of `encode_tables` and `lookup_metadata`, exact to half a quantum.

    source, metadata: content of these files; where: their names, for the `InputError` about damaged content.
    """
    values = parse_json(metadata, where)
    require_keys(values, ("twist", "clearance", "element"), where)
    twist, clearance = (parse_axis(values[name], f"{where}: {name}") for name in ("twist", "clearance"))
    coefficients, element = np.zeros((len(QUANTITIES), 0, 0)), None
    try:
        if values.get("tables", True):
            # Twists from 0 up: half of the axis, and one row before it, which the first cell needs.
            shape = (len(QUANTITIES), (twist.size + 3) // 2, clearance.size)
            _expect_size(source, "LOOKUP", ("QUANTITIES", "ROWS", "COLUMNS"), shape)
            quanta = [float(x) for x in _define(source, "LOOKUP_QUANTA").strip("{}").split(",")]
            coefficients = _mirrored_table(_decode(source, "LOOKUP", (*shape, 1), quanta)[..., 0])
        if values["element"] is not None:
            axes = require_keys(values["element"], ("axes",), where)["axes"]
            shape = tuple(parse_axis(axis, where).size for axis in axes)
            _expect_size(source, "ELEMENT", ("ROWS", "COLUMNS", "LAYERS"), shape)
            element = _decode(source, "ELEMENT", (1, *shape), [float(_define(source, "ELEMENT_QUANTUM"))])[0]
    except (ValueError, TypeError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: expected encoded tables, got {error}") from None
    return Lookup.from_header(values, coefficients, element, where)


def _nonnegative_half(lookup: Lookup) -> Array:
    """The rows of twists from 0 up and one before, which the first cell needs: (5, n/2 + 2, n_clearance)."""
    c = lookup.coefficients
    mirrored = np.stack([-c[0], -c[2], -c[1], c[3], c[4]])[:, ::-1]
    scale = np.abs(c).max(axis=(1, 2), keepdims=True)
    expect(
        bool((np.abs(c - mirrored) <= _SYMMETRY * np.maximum(scale, 1e-300)).all()) and c.shape[1] % 2 == 1,
        "a lookup that is odd or even in the twist",
        "one that is not",
        "lookup",
    )
    return ((c + mirrored) / 2)[:, c.shape[1] // 2 - 1 :]


def _mirrored_table(half: Array) -> Array:
    """The full table from its half for twists from 0 up, the inverse of `_nonnegative_half`."""
    mirrored = np.stack([-half[0], -half[2], -half[1], half[3], half[4]])[:, :2:-1]
    return np.concatenate([mirrored, half], axis=1)


def _quantum(size: float, bits: int) -> float:
    return 2.0 ** (math.ceil(math.log2(max(size, 1e-100))) - bits)


def _encode(tables: Array, quanta: list[float]) -> tuple[int, NDArray[np.uint32]]:
    """Number of byte planes, and words, of tables of shape (n, rows, columns, layers)."""
    whole = np.rint(tables / np.reshape(quanta, (-1, 1, 1, 1))).astype(np.int64)
    expect(bool((np.abs(whole) < 2**53).all()), "tables within 500 times the full torque", "greater values", "lookup")
    for axis in (1, 1, 2):
        whole = np.diff(whole, axis=axis, prepend=0)
    codes = np.where(whole < 0, -2 * whole - 1, 2 * whole).astype("<u8").ravel()
    planes = max(1, math.ceil(int(codes.max()).bit_length() / 8))
    content = codes.view(np.uint8).reshape(-1, 8)[:, :planes].T.tobytes()
    return planes, np.frombuffer(content + bytes(-len(content) % 4), "<u4")


def _expect_size(source: str, name: str, sides: tuple[str, ...], shape: tuple[int, ...]) -> None:
    """Raise ValueError unless the C source has the table size that the metadata state."""
    stated = tuple(int(_define(source, f"{name}_{side}")) for side in sides)
    if stated != shape:
        raise ValueError(f"{name} {stated} where the metadata state {shape}")


def _decode(source: str, name: str, shape: tuple[int, ...], quanta: list[float]) -> Array:
    planes = int(_define(source, f"{name}_PLANES"))
    if not 1 <= planes <= 8 or len(quanta) != shape[0] or not all(0 < q < 1 for q in quanta):
        raise ValueError(f"{planes} planes and {len(quanta)} quanta of {name}")
    found = re.search(rf"{name}_WORDS\[\d+\] = \{{([\d,\s]*)\}}", source)
    if found is None:
        raise ValueError(f"no {name}_WORDS")
    words = np.array(found[1].replace("\n", "").rstrip(",").split(","), dtype=np.int64)
    content = words.astype("<u4").tobytes()
    count = math.prod(shape)
    if not 0 <= len(content) - planes * count < 4:
        raise ValueError(f"{len(content)} bytes of {name} for {planes} planes of {count} numbers")
    codes = np.zeros((count, 8), dtype=np.uint8)
    codes[:, :planes] = np.frombuffer(content, np.uint8)[: planes * count].reshape(planes, count).T
    code = codes.view("<u8").ravel().astype(np.int64)
    whole = np.where(code & 1, -(code // 2) - 1, code // 2).reshape(shape)
    for axis in (2, 1, 1):
        whole = np.cumsum(whole, axis=axis)
    return whole * np.reshape(quanta, (-1, 1, 1, 1))


def _define(source: str, name: str) -> str:
    found = re.search(rf"^#define {name} (.*)$", source, re.MULTILINE)
    if found is None:
        raise ValueError(f"no {name}")
    return found[1]


def _axis(name: str, axis: Axis) -> dict[str, Any]:
    return {f"{name}_START": float(axis.start), f"{name}_STEP": float(axis.step), f"{name}_CELLS": axis.cells}


def _array(name: str, words: NDArray[np.uint32]) -> str:
    numbers = words.tolist()
    lines = (",".join(map(str, numbers[k : k + 16])) for k in range(0, len(numbers), 16))
    return f"static const uint32_t {name}[{len(numbers)}] = {{\n" + ",\n".join(lines) + "};\n"
