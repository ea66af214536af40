"""Cycles of a record that repeat in torque, and which of them are of one kind: the same torques at the same place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...record import Record, TorqueBranch, repeats_branch, torque_branches
from .trace import Blocks


@dataclass(frozen=True)
class Cycles:
    """Cycles that have others of their kind.

    number: (n,) cycle of each block, -1 where it belongs to none; kind: (m,) of each cycle, from 0; amplitude: (m,)
    N.m, half the range of the torque of each cycle.
    """

    number: NDArray[np.intp]
    kind: NDArray[np.intp]
    amplitude: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.kind)


def find_cycles(record: Record, blocks: Blocks) -> Cycles | None:
    """The cycles of a record that repeat in torque, by its blocks; None where none does.

    A cycle is a rise and a fall of the torque, in either order. A run from zero to both amplitudes and back is one
    cycle too: its last rise completes the first.
    """
    kinds: list[list[list[TorqueBranch]]] = []
    for cycle in _joined(torque_branches(record)):
        for kind in kinds:
            if _is_alike(record, kind[0], cycle):
                kind.append(cycle)
                break
        else:
            kinds.append([cycle])
    repeated = [kind for kind in kinds if len(kind) > 1]
    if not repeated:
        return None
    number = np.full(len(blocks.first), -1)
    numbers: list[int] = []
    amplitudes: list[float] = []
    middle = blocks.first + (blocks.count / 2).astype(int)
    for k, kind in enumerate(repeated):
        for cycle in kind:
            number[(middle >= cycle[0].first) & (middle < cycle[-1].past)] = len(numbers)
            numbers.append(k)
            amplitudes.append(float(np.ptp(record.output_torque[cycle[0].first : cycle[-1].past])) / 2)
    return Cycles(number, np.array(numbers), np.array(amplitudes))


def _joined(branches: Sequence[TorqueBranch]) -> list[list[TorqueBranch]]:
    """Branches joined to cycles; a branch that is left at the end of a run belongs to the cycle before."""
    cycles: list[list[TorqueBranch]] = []
    for branch in branches:
        last = cycles[-1] if cycles else []
        if last and last[0].run == branch.run and len(last) == 1:
            last.append(branch)
        else:
            cycles.append([branch])
    found: list[list[TorqueBranch]] = []
    for cycle in cycles:
        if len(cycle) == 1 and found and found[-1][0].run == cycle[0].run:
            found[-1].extend(cycle)
        elif len(cycle) > 1:
            found.append(cycle)
    return found


def _is_alike(record: Record, first: Sequence[TorqueBranch], second: Sequence[TorqueBranch]) -> bool:
    return len(first) == len(second) and all(repeats_branch(record, a, b) for a, b in zip(first, second, strict=True))
