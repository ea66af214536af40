"""Where the elements were before a filter of all channels, compared with an exact filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.preprocessing.channel_filter import filtered_instants
from reefmu.diagnosis.preprocessing.trace import make_trace
from tests import diagnosis_rig as rig
from tests.channel_filter import with_filtered_channels

PASSING = 87.0
"""Times that elements pass in a turn."""


@pytest.mark.parametrize(("steps", "error"), [(3.0, 0.06), (10.0, 0.005)])
def test_a_filtered_torque_is_the_mean_of_its_instants(steps: float, error: float) -> None:
    """Of elements that pass a fast crank with up to several samples' distance. steps: of a sample over the time
    constant; error: what still earlier samples have in the filter."""
    record = rig.protocol()
    time_constant = rig.STEP / steps
    true = replace(record, output_torque=np.cos(PASSING * record.crank_angle))
    seen = with_filtered_channels(true, time_constant)
    now, before = filtered_instants(make_trace(seen, rig.drive().ratio), time_constant)
    mean = now.share * np.cos(PASSING * now.crank) + before.share * np.cos(PASSING * before.crank)
    # The last ten seconds of the fast run, long after it started to turn.
    (fast,) = np.flatnonzero(np.diff(record.run) > 0)[-2:-1]
    steady = slice(fast - 199, fast)
    late = record.crank_angle - seen.crank_angle
    np.testing.assert_allclose(late[steady], 6.0 * time_constant, rtol=1e-6)
    assert np.abs(mean - seen.output_torque)[steady].max() < error
    assert np.abs(np.cos(PASSING * seen.crank_angle) - seen.output_torque)[steady].max() > 0.3


def test_without_a_filter_all_is_as_recorded() -> None:
    trace = make_trace(rig.protocol(), rig.drive().ratio)
    now, before = filtered_instants(trace, 0.0)
    np.testing.assert_array_equal(now.crank, trace.crank)
    assert np.all(now.share == 1)
    assert np.all(before.share == 0)
