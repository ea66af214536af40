"""Changing values inside a saved FMU state, for which FMI has no function between two runs of a record.

FMI 2.0 lets a host set states only through the inputs at initialisation. Both back ends save all values in one
contiguous block ordered by value reference (`reefmu.fmu.python_backend.slave`, `native/fmi2/fmi2_state.c`); the block
is located by its content.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence

from stiffness_model.errors import InputError


def replace_values(saved: bytes, values: Sequence[float], changes: Mapping[int, float]) -> bytes:
    """The saved state `saved` with `changes` (position -> value).

    values: of all variables, in the order of the block. Errors: `InputError` unless the state contains them exactly
    once as one block.

    >>> saved = b"head" + struct.pack("<2d", 1.0, 2.0)
    >>> replace_values(saved, [1.0, 2.0], {1: 3.0}) == b"head" + struct.pack("<2d", 1.0, 3.0)
    True
    """
    new = [changes.get(k, value) for k, value in enumerate(values)]
    try:
        content = json.loads(saved)
        block: list[float] = content["values"]
    except (ValueError, TypeError, KeyError):
        old = struct.pack(f"<{len(values)}d", *values)
        _expect_once(saved.count(old))
        return saved.replace(old, struct.pack(f"<{len(new)}d", *new))
    places = [k for k in range(len(block) - len(new) + 1) if block[k : k + len(new)] == list(values)]
    _expect_once(len(places))
    block[places[0] : places[0] + len(new)] = new
    return json.dumps(content).encode()


def _expect_once(times: int) -> None:
    if times != 1:
        raise InputError(f"saved state of an FMU: expected its values in one block, found them {times} times")
