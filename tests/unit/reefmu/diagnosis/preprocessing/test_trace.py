"""Signals of a record that effects depend on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig


def test_the_rate_of_the_torque_is_as_smooth_as_the_torque_shows() -> None:
    """The noise of a torque that is read late is no rate: its part is less than that of slopes over three samples."""
    ratio = rig.drive().ratio
    true = rig.protocol()
    true = replace(true, output_torque=cached_lookup(rig.drive()).torque(true.twist(ratio)))
    noise = rig.noise_of(len(true), 0.3, 0.0, 0)
    noisy = make_trace(replace(true, output_torque=true.output_torque + noise), ratio)
    exact = make_trace(true, ratio)
    error = noisy.torque_rate - exact.torque_rate
    of_three = np.concatenate([np.gradient(noise[a:b], true.time[a:b]) for a, b in exact.run_ranges])
    assert np.std(error) < 0.8 * np.std(of_three)
