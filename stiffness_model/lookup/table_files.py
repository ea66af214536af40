"""Tables that come from files: every size is looked at before memory is taken, every value before it is used.

A lookup travels in caches and inside FMUs, which others may have written. What is read here is bounded, of the
right types and finite, or it is refused with one `InputError`.
"""

from __future__ import annotations

import io
import json
import math
import os
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import InputError, expect, expect_number
from ..numerics.arrays import Array
from ..numerics.bspline import Axis

MAX_BYTES = 1 << 26
"""Of one table: 64 MiB. The greatest of the presets takes 0.2."""
MAX_CELLS = 10_000
"""Along one axis."""
MAX_ENTRY = 1e12
"""N.m, N: the greatest entry of a table, a million times what a robot's gear bears."""


def load_tables(path: str | os.PathLike[str], what: str) -> tuple[Mapping[str, Any], dict[str, Array]]:
    """The head, and the arrays of doubles by name, of a .npz file that `np.savez` wrote with head=json.

    what: "a saved lookup", for the message. Errors: `InputError` for anything else, before an array is allocated.
    """
    where = str(path)
    try:
        with zipfile.ZipFile(path) as archive:
            content: dict[str, bytes] = {}
            for info in archive.infolist():
                expect(info.file_size <= MAX_BYTES, f"tables of at most {MAX_BYTES} bytes", info.file_size, where)
                content[info.filename.removesuffix(".npy")] = archive.read(info)
        arrays = {name: _array(data) for name, data in content.items()}
        head = arrays.pop("head")
        expect(head.dtype.kind == "U" and head.shape == (), "a head in JSON", head.dtype, where)
        expect(
            all(a.dtype == np.dtype("<f8") for a in arrays.values()),
            "tables of doubles",
            sorted({str(a.dtype) for a in arrays.values()}),
            where,
        )
        return parse_json(str(head), where), arrays
    except (
        OSError,
        ValueError,
        KeyError,
        EOFError,
        TypeError,
        SyntaxError,
        NotImplementedError,
        RuntimeError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: expected {what} (.npz), got {' '.join(str(error).split())}") from None


def _array(content: bytes) -> NDArray[Any]:
    """An array of plain numbers or characters as the NPY format writes it, whose header states the size that came."""
    file = io.BytesIO(content)
    version = npy.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"format {version}")
    shape, fortran, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(file)
    left = len(content) - file.tell()
    if dtype.kind not in "fU" or dtype.itemsize == 0 or math.prod(shape) * dtype.itemsize != left:
        raise ValueError(f"{left} bytes for an array {shape} of {dtype}")
    return np.frombuffer(content, dtype, offset=file.tell()).reshape(shape, order="F" if fortran else "C")


def parse_json(text: str | bytes, where: str) -> Mapping[str, Any]:
    """A JSON object, or `InputError`.

    >>> parse_json("[" * 10**5, "lookup.json")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: lookup.json: expected an object in JSON, got one nested too deep
    """
    try:
        table = json.loads(text)
    except RecursionError:
        raise InputError(f"{where}: expected an object in JSON, got one nested too deep") from None
    except ValueError as error:
        raise InputError(f"{where}: expected an object in JSON, got {error}") from None
    expect(isinstance(table, Mapping), "an object in JSON", type(table).__name__, where)
    return table


def require_keys(table: Any, names: Iterable[str], where: str) -> Mapping[str, Any]:
    """`table`, if it is one and has these names; else `InputError`."""
    expect(isinstance(table, Mapping), "an object", table, where)
    for name in names:
        expect(name in table, f"a key {name!r}", sorted(map(str, table))[:12], where)
    return table


def parse_axis(value: Any, where: str) -> Axis:
    """The axis of [start, step, cells], or `InputError`.

    >>> parse_axis([-1.0, 0.5, 4], "lookup.json twist").stop
    1.0
    """
    expect(isinstance(value, (list, tuple)) and len(value) == 3, "[start, step, cells]", value, where)
    start, step, cells = value
    expect(
        isinstance(cells, int) and not isinstance(cells, bool) and 1 <= cells <= MAX_CELLS,
        f"a whole number of cells, 1 to {MAX_CELLS}",
        cells,
        where,
    )
    return Axis(
        expect_number(start, "a finite start", where, low=-MAX_ENTRY, high=MAX_ENTRY),
        expect_number(step, "a step above zero", where, low=1e-15, high=MAX_ENTRY),
        cells,
    )


def expect_table(table: Array, shape: tuple[int, ...], where: str) -> Array:
    """`table`, if it has this shape and entries within `MAX_ENTRY`; else `InputError`."""
    expect(table.shape == shape, f"a table {shape}, as the head states", table.shape, where)
    expect(
        bool((np.abs(table) <= MAX_ENTRY).all()),
        f"entries within {MAX_ENTRY:g}",
        "others, or none that are numbers",
        where,
    )
    return table
