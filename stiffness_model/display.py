"""How results show themselves: one line of text, a table in a notebook, a pandas DataFrame.

pandas is optional. What draws a result lies in a layer above the result's own; `view` finds it by name when `plot` or a
notebook asks for it, so that no module imports from above.
"""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError, install_command

MAX_LENGTH = 80
"""Characters of one field in `one_line`; chosen by judgement. A longer field shows its type only."""


def view(name: str) -> Any:
    """The function that shows a result, "module:function", imported when it is first asked for.

    >>> view("stiffness_model.plotting.drive_tables:main_sizes").__name__
    'main_sizes'
    """
    module, function = name.split(":")
    return getattr(import_module(module), function)


def one_line(result: Any) -> str:
    """A dataclass in one line, its arrays by their shapes; for `__repr__`.

    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Pressures:
    ...     twist: np.ndarray
    ...     name: str
    >>> one_line(Pressures(np.zeros((3, 2)), "drive_1"))
    "Pressures(twist: 3 x 2, name='drive_1')"
    """
    texts = [_field(field.name, getattr(result, field.name)) for field in dataclasses.fields(result) if field.repr]
    return f"{type(result).__name__}({', '.join(texts)})"


def _field(name: str, value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{name}: {' x '.join(str(n) for n in value.shape) or value}"
    text = f"{value:.6g}" if isinstance(value, float) else repr(value)
    if len(text) > MAX_LENGTH or "\n" in text:
        text = f"<{type(value).__name__}>"
    return f"{name}={text}"


def html_table(title: str, rows: Mapping[str, object]) -> str:
    """A table of two columns under a title, for `_repr_html_`; texts are escaped.

    >>> html_table("drive_1", {"lobes": 30})
    '<table><caption>drive_1</caption><tr><th>lobes</th><td>30</td></tr></table>'
    """
    body = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(str(row))}</td></tr>" for name, row in rows.items()
    )
    return f"<table><caption>{html.escape(title)}</caption>{body}</table>"


def dataframe(columns: Mapping[str, ArrayLike]) -> Any:
    """A `pandas.DataFrame` of columns (n,) by their headers, "name [unit]". Raises `InputError` without pandas."""
    try:
        pandas = import_module("pandas")
    except ImportError:
        raise InputError(
            f"to_dataframe: expected the library pandas, got none; {install_command('dataframe')}"
        ) from None
    return pandas.DataFrame(dict(columns))
