"""Draws the power of naming over the separation of records, from outcomes of `bench_naming_power.py`.

Run as `python tests/benchmarks/probabilities/naming_power_picture.py power.json -o docs/pictures/naming_power.png`
after `bench_naming_power.py --second 90 --seed 21 --out power.json`.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.calibrated_odds import NAMED  # noqa: E402
from tests.benchmarks.probabilities.bench_naming_power import EDGES, SURE, Outcome  # noqa: E402
from tests.benchmarks.probabilities.rival_sets import bound  # noqa: E402
from tests.validation.blind.scoring import wilson  # noqa: E402


@dataclass(frozen=True)
class Bin:
    """Records of alike separation. count: of them; exact: share that is named, with its Wilson bounds; most, sure: mean
    greatest shares that could be named from `NAMED` and from `SURE`."""

    title: str
    count: int
    exact: tuple[float, float, float]
    most: float
    sure: float


def binned(outcomes: Sequence[Outcome]) -> list[Bin]:
    """The bins that hold any record."""
    found: list[Bin] = []
    for low, high in itertools.pairwise(EDGES):
        some = [o for o in outcomes if low <= o.separation < high]
        if some:
            most, sure = (float(np.mean([bound(o.separation, o.advantage, p) for o in some])) for p in (NAMED, SURE))
            exact = sum(o.exact for o in some)
            title = f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}"
            found.append(Bin(title, len(some), (exact / len(some), *wilson(exact, len(some))), most, sure))
    return found


def draw(bins: Sequence[Bin], path: Path) -> None:
    """Write the picture of some bins."""
    import matplotlib.pyplot as plt

    place = np.arange(len(bins))
    share, low, high = np.array([b.exact for b in bins]).T
    figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
    # The wider line stays visible where both are alike.
    for values, colour, width, least in (
        ([b.most for b in bins], "0.8", 9, NAMED),
        ([b.sure for b in bins], "0.4", 3, SURE),
    ):
        label = f"at most, from a probability of {least}"
        axes.hlines(values, place - 0.4, place + 0.4, color=colour, lw=width, label=label)
    axes.errorbar(place, share, (share - low, high - share), fmt="o", color="C0", capsize=3, label="named, 95 % bounds")
    axes.set_xticks(place, [f"{b.title}\n{b.count} records" for b in bins])
    axes.set(ylim=(-0.03, 1.04), ylabel="share named")
    axes.set_xlabel("separation from the nearest other set, standard deviations")
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("outcomes", type=Path, nargs="+", help="of bench_naming_power.py --out")
    parser.add_argument("-o", "--out", type=Path, required=True, help="picture to write")
    given = parser.parse_args()
    lines = [line for file in given.outcomes for line in file.read_text("utf-8").splitlines()]
    draw(binned([Outcome(**json.loads(line)) for line in lines]), given.out)


if __name__ == "__main__":
    main()
