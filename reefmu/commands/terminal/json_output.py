"""Results as JSON on stdout, for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def print_json(value: Any) -> None:
    """Print tables, lists, texts and numbers; numbers that JSON does not have (NaN, infinity) are null.

    >>> print_json({"lives [h]": np.array([1.0, np.inf])})
    {
      "lives [h]": [
        1.0,
        null
      ]
    }
    """
    print(json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(name): _plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(part) for part in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value
