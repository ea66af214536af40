"""The benchmark of what is unnamed: the distance of a torque that the parameters of a fit cannot make."""

from __future__ import annotations

import pytest

from tests.benchmarks.probabilities.bench_unnamed_power import Outcome, report, unnamed_torque
from tests.validation.blind_individuals.catalogue import case


@pytest.mark.parametrize("something", [True, False])
def test_there_is_a_torque_where_something_is_unnamed(something: bool) -> None:
    number = next(n for n in range(90) if bool(case(n, 25).foreign) == something)
    assert unnamed_torque(number, 25).any() == something


def test_the_table_counts_records_by_distance(capsys: pytest.CaptureFixture[str]) -> None:
    near, far = (
        Outcome("1/1", True, "none", 3.0, 0.7, 0.05, False),
        Outcome("1/2", True, "unknown", 90.0, 1.0, 1.0, True),
    )
    report([near, far])
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert rows[0] == ["0", "to", "10", "1", "0.70", "0.05", "0.00"]
    assert rows[-1] == ["0", "to", "inf", "2", "0.85", "0.53", "0.50"]
