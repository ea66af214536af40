"""The picture of the power of naming, of outcomes that are made up."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.benchmarks.probabilities.bench_naming_power import Outcome
from tests.benchmarks.probabilities.naming_power_picture import binned, draw


def _outcome(separation: float, exact: bool) -> Outcome:
    missing = ("creep",)
    return Outcome("1", "single", True, missing, separation, 0.0, "creep", "", "named", exact, exact)


def test_bins_have_the_shares_of_their_records(tmp_path: Path) -> None:
    """At three standard deviations and even odds the log odds have a mean of 4.5 and a deviation of 3: they reach 0.6
    in 91 % and 0.95 in 70 % of records."""
    near, far = binned([_outcome(3.0, True), _outcome(3.0, False), _outcome(100.0, True)])
    assert (near.title, near.count, near.exact[0]) == ("2 to 4", 2, 0.5)
    assert near.exact[1] < 0.5 < near.exact[2]
    assert (near.most, near.sure) == (pytest.approx(0.914, abs=0.001), pytest.approx(0.698, abs=0.001))
    assert (far.title, far.count, far.exact[0], far.most) == ("above 32", 1, 1.0, pytest.approx(1.0))
    draw([near, far], tmp_path / "power.png")
    assert (tmp_path / "power.png").stat().st_size > 5000
