"""What the predictor reuses or leaves out does not change its results."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reefmu.diagnosis.forward.base_curve import BaseCurve, drawing_base
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.forward.record_contacts import element_torque
from reefmu.diagnosis.preprocessing.trace import Trace, make_trace
from reefmu.effects import EFFECTS
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import make_record
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig


@functools.cache
def _base() -> BaseCurve:
    return drawing_base(rig.drive(), cached_lookup(rig.drive()))


def _random_trace(rng: np.random.Generator) -> Trace:
    """A record of two runs in which crank and output move at random, smoothly and within the range of the drive."""
    n = 400
    twist = np.convolve(rng.standard_normal(n + 40), np.hanning(41), mode="valid")
    twist *= rng.uniform(0.1, 0.9) * rig.drive().max_twist / np.abs(twist).max()
    crank = rng.uniform(-3, 3) + rng.choice([0.0, 0.01, 0.1]) * np.arange(n)
    columns = {
        "time": np.arange(n) * rng.choice([0.005, 0.05, 0.5]),
        "run": np.repeat([0.0, 1.0], n // 2),
        "crank_angle": crank,
        "output_angle": crank / rig.drive().ratio - twist,
        "output_torque": np.zeros(n),
        "temperature": 20 + 10 * rng.random() * np.arange(n) / n,
    }
    return make_trace(make_record(columns), rig.drive().ratio)


def _random_parameters(rng: np.random.Generator, names: tuple[str, ...]) -> Array:
    declared = [p for name in names for p in EFFECTS[name].parameters]
    values = [np.clip(p.nominal * rng.uniform(0.3, 2), p.minimum, p.maximum) for p in declared]
    return np.array([1e-6 * rng.standard_normal(), 1e-3 * rng.standard_normal(), *values])


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), names=st.lists(st.sampled_from(sorted(EFFECTS)), max_size=2, unique=True))
def test_results_do_not_depend_on_earlier_calls(seed: int, names: list[str]) -> None:
    rng = np.random.default_rng(seed)
    trace, effects = _random_trace(rng), ("creep", "structural_compliance", *names)
    effects = tuple(dict.fromkeys(effects))
    used = Predictor(trace, _base(), effects)
    p = _random_parameters(rng, effects)
    for step in (0.0, 1e-3, 0.3, 0.0):
        q = p * (1 + step * rng.standard_normal(len(p)))
        # Bounds hold in a fit; a time and a length must stay positive here.
        q = np.where(p > 0, np.abs(q), q)
        found, plain = used(q), Predictor(trace, _base(), effects)(q)
        scale = np.abs(plain.torque).max()
        assert np.abs(found.torque - plain.torque).max() <= 1e-9 * scale
        size = np.abs(plain.sensitivities).max(axis=0) + 1e-300
        assert (np.abs(found.sensitivities - plain.sensitivities).max(axis=0) <= 1e-6 * size).all()


def test_the_same_parameters_are_not_evaluated_twice() -> None:
    trace = _random_trace(np.random.default_rng(0))
    predictor = Predictor(trace, _base(), ("hysteresis",))
    p = _random_parameters(np.random.default_rng(0), ("hysteresis",))
    first = predictor(p)
    assert predictor(p.copy()) is first
    assert predictor(1.01 * p) is not first


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_torque_of_one_element(seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = _base().element
    assert table is not None
    twist = rng.uniform(-1.2, 1.2, 200) * rig.drive().max_twist
    position = rng.uniform(-10, 10, 200)
    for clearance in (rng.uniform(-2e-5, 2e-5), rng.uniform(-2e-5, 2e-5, 200)):
        found = element_torque(table, twist, clearance, position)
        for value, wanted in zip(found, table.evaluate(twist, clearance, position), strict=True):
            assert value == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), clearance=st.floats(-1e-4, 1e-4))
def test_one_clearance_for_all_samples(seed: int, clearance: float) -> None:
    twist = np.random.default_rng(seed).uniform(-1.3, 1.3, 300) * rig.drive().max_twist
    elastic, none = _base().elastic, np.zeros(0)
    plain = elastic.evaluate(twist, np.full(300, clearance), none)
    for found in (
        elastic.evaluate(twist, clearance, none),
        elastic.evaluate(twist, clearance, none, by_clearance=False),
    ):
        for value, wanted in zip(found[:2], plain[:2], strict=True):
            assert value == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())
    assert elastic.evaluate(twist, clearance, none)[2] == pytest.approx(
        plain[2], rel=1e-8, abs=1e-8 * np.abs(plain[2]).max()
    )
