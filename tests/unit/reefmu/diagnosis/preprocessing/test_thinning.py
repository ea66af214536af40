"""Block means over a thinned trace: exact for the signals, close for the predicted torque."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.preprocessing.thinning import thin_trace
from reefmu.diagnosis.preprocessing.trace import Blocks, Trace, make_blocks, make_trace
from reefmu.effects import EFFECTS
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import make_record
from tests import diagnosis_rig as rig
from tests.unit.reefmu.diagnosis.forward.test_predictor import SETS

BLOCK_NOISE = 0.1
"""N.m: a tenth of a per cent of full torque in the mean of 48 samples is what good records have."""


@pytest.fixture(scope="module", name="long")
def long_trace() -> tuple[Trace, Blocks]:
    trace = make_trace(rig.protocol(oversampling=27), rig.drive().ratio)
    return trace, make_blocks(trace, 48)


@pytest.mark.parametrize("names", SETS, ids="+".join)
def test_the_torque_of_a_long_record_is_kept(long: tuple[Trace, Blocks], names: tuple[str, ...]) -> None:
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    p = np.array([0.0, 0.0, *(q.nominal for n in names for q in EFFECTS[n].parameters)])
    whole = Predictor(long[0], base, names, long[1])(p)
    thinned = thin_trace(*long)
    found = Predictor(thinned[0], base, names, thinned[1])(p)
    assert len(thinned[0]) < 0.25 * len(long[0])
    effects = whole.torque - Predictor(long[0], base, (), long[1])(np.zeros(2)).torque
    error, size = (np.sqrt(np.mean(v**2)) for v in (found.torque - whole.torque, effects))
    assert error < 0.02 * BLOCK_NOISE + 0.01 * size
    # By the position of a missing ball the derivative has spikes that samples do not resolve in either trace.
    smooth = np.array([True, True, *(q.name not in ("phase", "windup") for n in names for q in EFFECTS[n].parameters)])
    columns = np.linalg.norm(found.sensitivities - whole.sensitivities, axis=0)
    assert (columns <= 0.05 * np.linalg.norm(whole.sensitivities, axis=0) + 1e-12)[smooth].all()


def test_a_short_record_is_not_thinned() -> None:
    trace = make_trace(rig.protocol(), rig.drive().ratio)
    blocks = make_blocks(trace, 2)
    assert thin_trace(trace, blocks) == (trace, blocks)


@settings(max_examples=30, deadline=None)
@example(seed=183573, samples=12, reversals=5)
@given(seed=st.integers(0, 10**6), samples=st.integers(12, 60), reversals=st.integers(0, 6))
def test_block_means_and_reversals_are_kept(seed: int, samples: int, reversals: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(600, 2000))
    knots = np.sort(rng.choice(np.arange(20, n - 20), reversals, replace=False))
    sign = np.where(np.searchsorted(knots, np.arange(n), side="right") % 2, -1.0, 1.0)
    output = np.cumsum(sign * rng.uniform(0.5, 1.0, n)) * 1e-5
    columns = {
        "time": np.arange(n) * 1e-3,
        "run": np.repeat([0.0, 1.0], [n // 2, n - n // 2]),
        "crank_angle": np.zeros(n),
        "output_angle": output,
        "output_torque": rng.standard_normal(n),
        "temperature": 20 + rng.random(n),
    }
    trace = make_trace(make_record(columns), 29.0)
    blocks = make_blocks(trace, samples)
    thinned, parts = thin_trace(trace, blocks)
    for name in ("time", "twist", "smooth_twist", "output_speed", "temperature", "torque"):
        whole = blocks.mean(getattr(trace, name))
        assert parts.mean(getattr(thinned, name)) == pytest.approx(whole, rel=1e-12, abs=1e-12), name
    assert thinned.start.sum() == trace.start.sum() == 2
    # Every extreme value of the path within a run is one of the samples that are left.
    change = np.where(np.diff(trace.run) == 0, np.sign(np.diff(trace.output)), 0.0)
    turns = np.flatnonzero(change[1:] * change[:-1] < 0) + 1
    assert np.isin(trace.output[turns], thinned.output).all()
