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


@pytest.mark.parametrize(("steps", "error", "filtered"), [(2.0, 0.03, 0.15), (3.0, 0.02, 0.3), (10.0, 1e-3, 0.3)])
def test_a_filtered_torque_is_the_mean_of_its_instants(steps: float, error: float, filtered: float) -> None:
    """Of elements that pass a fast crank with up to several samples' distance. steps: of a sample over the time
    constant; error: what samples that are counted together differ by; filtered: by which the filter changes more."""
    record = rig.protocol()
    time_constant = rig.STEP / steps
    true = replace(record, output_torque=np.cos(PASSING * record.crank_angle))
    seen = with_filtered_channels(true, time_constant)
    instants = filtered_instants(make_trace(seen, rig.drive().ratio), time_constant)
    mean = np.sum([at.share * np.cos(PASSING * at.crank) for at in instants], axis=0)
    # The last ten seconds of the fast run, long after it started to turn.
    (fast,) = np.flatnonzero(np.diff(record.run) > 0)[-2:-1]
    steady = slice(fast - 199, fast)
    late = record.crank_angle - seen.crank_angle
    np.testing.assert_allclose(late[steady], 6.0 * time_constant, rtol=1e-6)
    assert np.abs(mean - seen.output_torque)[steady].max() < error
    assert np.abs(np.cos(PASSING * seen.crank_angle) - seen.output_torque)[steady].max() > filtered


@pytest.mark.parametrize("steps", [0.05, 0.4, 1.0, 2.0, 10.0])
def test_a_torque_that_changes_slowly_lags_by_the_time_constant(steps: float) -> None:
    """The mean angle of all instants is the filtered one. steps: of a sample over the time constant."""
    record = rig.protocol()
    seen = with_filtered_channels(record, time_constant := rig.STEP / steps)
    instants = filtered_instants(make_trace(seen, rig.drive().ratio), time_constant)
    (fast,) = np.flatnonzero(np.diff(record.run) > 0)[-2:-1]
    steady = slice(fast - 99, fast)
    np.testing.assert_allclose(np.sum([at.share for at in instants], axis=0), 1.0, rtol=1e-12)
    mean = np.sum([at.share * at.crank for at in instants], axis=0)
    np.testing.assert_allclose(mean[steady], seen.crank_angle[steady], atol=6.0 * 1e-3 * time_constant)


def test_without_a_filter_all_is_as_recorded() -> None:
    trace = make_trace(rig.protocol(), rig.drive().ratio)
    (now,) = filtered_instants(trace, 0.0)
    np.testing.assert_array_equal(now.crank, trace.crank)
    assert np.all(now.share == 1)
