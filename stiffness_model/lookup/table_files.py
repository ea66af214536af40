"""Validation of tables read from files: sizes are checked before memory is allocated, values before they are used.

A lookup is stored in caches and inside FMUs, which other programs may have written. Whatever is read here is of bounded
size, of the expected types and finite; anything else is refused with one `InputError`.
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
"""Limit for one table, 64 MiB; the largest table of the presets takes 0.2 MiB."""
MAX_CELLS = 10_000
"""Limit along one axis; chosen by judgement."""
MAX_ENTRY = 1e12
"""Limit for the entries of a table, N.m or N: a million times the load of a robot's gear."""


def load_tables(path: str | os.PathLike[str], what: str) -> tuple[Mapping[str, Any], dict[str, Array]]:
    """The header and the arrays of doubles by name from a .npz file that holds the header as JSON under "head".

    what: names the expected content in messages ("a saved lookup"). Raises `InputError` for any other file, before an
    array is allocated.
    """
    where = str(path)
    try:
        with zipfile.ZipFile(path) as archive:
            content: dict[str, bytes] = {}
            for info in archive.infolist():
                expect(info.file_size <= MAX_BYTES, f"tables of at most {MAX_BYTES} bytes", info.file_size, where)
                content[info.filename.removesuffix(".npy")] = archive.read(info)
        arrays = {name: _array(data) for name, data in content.items()}
        header = arrays.pop("head")
        expect(header.dtype.kind == "U" and header.shape == (), "a head in JSON", header.dtype, where)
        expect(
            all(a.dtype == np.dtype("<f8") for a in arrays.values()),
            "tables of doubles",
            sorted({str(a.dtype) for a in arrays.values()}),
            where,
        )
        return parse_json(str(header), where), arrays
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
    """An array of floats or characters in the NPY format, whose header must match the number of bytes present."""
    file = io.BytesIO(content)
    version = npy.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"format {version}")
    shape, fortran, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(file)
    n_bytes = len(content) - file.tell()
    if dtype.kind not in "fU" or dtype.itemsize == 0 or math.prod(shape) * dtype.itemsize != n_bytes:
        raise ValueError(f"{n_bytes} bytes for an array {shape} of {dtype}")
    return np.frombuffer(content, dtype, offset=file.tell()).reshape(shape, order="F" if fortran else "C")


def parse_json(text: str | bytes, where: str) -> Mapping[str, Any]:
    """The JSON object that `text` holds. Raises `InputError` for anything else.

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
    """`table` itself. Raises `InputError` unless it is a mapping with these keys."""
    expect(isinstance(table, Mapping), "an object", table, where)
    for name in names:
        expect(name in table, f"a key {name!r}", sorted(map(str, table))[:12], where)
    return table


def parse_axis(value: Any, where: str) -> Axis:
    """The axis of [start, step, cells]. Raises `InputError` for unsuitable values.

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
    """`table` itself. Raises `InputError` unless it has this shape and entries within `MAX_ENTRY`."""
    expect(table.shape == shape, f"a table {shape}, as the header states", table.shape, where)
    expect(
        bool((np.abs(table) <= MAX_ENTRY).all()),
        f"entries within {MAX_ENTRY:g}",
        "larger ones or NaN",
        where,
    )
    return table
