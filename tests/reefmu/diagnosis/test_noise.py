"""Noise is found where cycles repeat, whatever its correlation, and admitted to be a guess where none do."""

import numpy as np
import pytest

from reefmu.diagnosis.noise import estimate_noise
from reefmu.diagnosis.trace import trace_of
from reefmu.tables import cached_lookup
from tests import diagnosis_rig as rig


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_size_and_correlation(correlation: float) -> None:
    record = rig.measured({"hysteresis": {"torque": 4.0}}, noise=0.8, correlation=correlation, seed=3)
    trace = trace_of(record, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    size = float(np.sqrt(np.mean(found.variance(cached_lookup(rig.drive()).stiffness(trace.twist)))))
    assert found.repeated
    assert size == pytest.approx(0.8, rel=0.2)
    assert found.correlation == pytest.approx((1 + correlation) / (1 - correlation), rel=0.45)


def test_without_repeats_it_says_so() -> None:
    record = rig.measured({}, noise=0.8, correlation=0.0, full=False)
    some = slice(0, 150)
    from dataclasses import replace

    short = replace(record, **{name: getattr(record, name)[some] for name in
                               ("time", "run", "crank_angle", "output_angle", "output_torque", "temperature")})
    trace = trace_of(short, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    assert not found.repeated
    assert found.torque < 2.0
