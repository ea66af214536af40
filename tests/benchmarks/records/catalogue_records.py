"""The records of a catalogue of the second generator that a benchmark is asked for by its command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Protocol, TypeVar

Found = TypeVar("Found", covariant=True)


class Measure(Protocol[Found]):
    """What is measured of one record, None where it says nothing."""

    def __call__(self, number: int, seed: int) -> Found | None:
        """number: of the record; seed: of its catalogue."""
        ...


def measured(measure: Measure[Found], doc: str | None, seed: int) -> Iterator[Found]:
    """What is measured of each record, in their order, without those that say nothing.

    measure: defined in a module; doc: of the benchmark, whose first line describes it; seed: of the usual catalogue.
    """
    parser = argparse.ArgumentParser(description=(doc or "").split("\n", 1)[0])
    parser.add_argument("--second", type=int, default=90, help="records of the second generator")
    parser.add_argument("--seed", type=int, default=seed, help="of their catalogue")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args()
    with ProcessPoolExecutor(given.workers) as pool:
        for found in pool.map(partial(measure, seed=given.seed), range(given.second)):
            if found is not None:
                yield found
