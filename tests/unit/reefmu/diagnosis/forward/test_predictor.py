"""The predictor agrees with the simulated model, and its sensitivities with finite differences."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.elastic import ElasticTorque
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.forward.vectorised import Number
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.effects import EFFECTS, IndependentVariable
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.record import make_record
from reefmu.simulate import simulate_record
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig

SETS = [
    ("backlash", "hysteresis", "torque_sensor_drift", "wear"),
    ("kinematic_error", "structural_compliance", "coulomb_friction", "damping", "hysteresis"),
    ("preload", "thermal_clearance", "load_dependent_hysteresis", "stribeck_friction"),
    ("missing_ball", "modulus_error", "viscous_friction", "torque_sensor_offset"),
    ("creep", "structural_compliance"),
]


@pytest.mark.parametrize("names", SETS, ids="+".join)
def test_torque_and_sensitivities(names: tuple[str, ...]) -> None:
    record, lookup = rig.protocol(), cached_lookup(rig.drive())
    nominal = {n: {p.name: p.nominal for p in EFFECTS[n].parameters} for n in names}
    wanted = simulate_record(build_model(rig.drive(), nominal, lookup=lookup), record)["measured.tau"]
    trace = make_trace(replace(record, output_torque=wanted), rig.drive().ratio)
    predictor = Predictor(trace, drawing_base(rig.drive(), lookup), names)
    p = np.array([0.0, 0.0, *(v for n in names for v in nominal[n].values())])
    found = predictor(p)
    # The simulation integrates creep by another method of the same order.
    assert np.abs(found.torque - wanted).max() < (0.05 if "creep" in names else 1e-9)
    for k in range(len(p)):
        step = 1e-6 * max(abs(p[k]), 1e-6)
        up, down = p.copy(), p.copy()
        up[k], down[k] = p[k] + step, p[k] - step
        slope = (predictor(up).torque - predictor(down).torque) / (2 * step)
        # Finite differences cross the kinks of friction and are less accurate than the sensitivities.
        error = np.sqrt(np.mean((slope - found.sensitivities[:, k]) ** 2))
        assert error <= 1e-2 * np.sqrt(np.mean(slope**2)) + 1e-9, names


@dataclass(frozen=True)
class RaisedTorque:
    """An elastic torque that is larger by `by`, N.m, at every twist, as an individual's may be."""

    inner: ElasticTorque
    by: float

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`."""
        value, *others = self.inner.evaluate(twist, clearance, shape, by_clearance=by_clearance)
        return (value + self.by, *others)


@pytest.mark.parametrize("names", [*SETS[:4], ("modulus_error", "structural_compliance", "load_dependent_hysteresis")])
def test_the_gain_is_what_the_torque_changes_by_with_that_of_the_contacts(names: tuple[str, ...]) -> None:
    record, base = rig.protocol(), drawing_base(rig.drive(), cached_lookup(rig.drive()))
    trace = make_trace(record, rig.drive().ratio)
    p = np.array([0.0, 0.0, *(parameter.nominal for n in names for parameter in EFFECTS[n].parameters)])
    raised = replace(base, elastic=RaisedTorque(base.elastic, 1e-4))
    expected = (Predictor(trace, raised, names)(p).torque - Predictor(trace, base, names)(p).torque) / 1e-4
    found = Predictor(trace, base, names)(p).contacts.gain
    assert np.log(found).mean() == pytest.approx(0.0, abs=1e-12)
    away = np.abs(Predictor(trace, base, names)(p).elastic) > 0.1  # from the kink of friction in proportion to it
    over = expected[away] / found[away]
    np.testing.assert_allclose(over, over.mean(), atol=1e-4)
    assert np.ptp(found) > 1e-3 or not {"structural_compliance", "load_dependent_hysteresis"} & {*names}


@pytest.mark.parametrize("name", ["coulomb_friction", "hysteresis", "damping"])
def test_loops_of_few_samples_among_slow_ones_are_followed(name: str) -> None:
    """As at the sampling rate of a slow rig: two loops of 120 samples in 12 s, and two of ten samples in half a second,
    nearly all of which are at a reversal. Angles without noise are taken as they are."""
    turns = [np.arange(240) * 0.1, np.arange(240) * 0.1, np.arange(22) * 0.05]
    periods = [12.0, 12.0, 0.5]
    twist = [np.arcsin(np.sin(2 * np.pi * t / period)) for t, period in zip(turns, periods, strict=True)]
    record = make_record(
        {
            "time": np.concatenate([t + 100.0 * k for k, t in enumerate(turns)]),
            "run": np.repeat([0.0, 1.0, 2.0], [len(t) for t in turns]),
            "crank_angle": np.full(sum(map(len, turns)), 0.3),
            "output_angle": 0.3 / rig.drive().ratio - 0.5 * rig.drive().max_twist * np.concatenate(twist),
            "output_torque": np.zeros(sum(map(len, turns))),
        }
    )
    lookup, sizes = cached_lookup(rig.drive()), {p.name: p.nominal for p in EFFECTS[name].parameters}
    wanted = simulate_record(build_model(rig.drive(), {name: sizes}, lookup=lookup), record)["measured.tau"]
    predictor = Predictor(make_trace(record, rig.drive().ratio), drawing_base(rig.drive(), lookup), (name,))
    assert np.abs(predictor(np.array([0.0, 0.0, *sizes.values()])).torque - wanted).max() < 1e-9


def test_friction_that_is_built_up_when_a_run_starts_decays_along_its_path() -> None:
    """By exp(-path/presliding) in every run from its own share, since the law is linear in its state."""
    trace, length = make_trace(rig.protocol(), rig.drive().ratio), 2e-4
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    at = np.array([0.0, 0.0, 4.0, length])
    shares = np.linspace(-1, 1, len(trace.run_ranges))
    built_up = replace(trace, friction={IndependentVariable.TWIST: shares})
    plain, found = (Predictor(one, base, ("hysteresis",))(at).torque for one in (trace, built_up))
    for share, (first, last) in zip(shares, trace.run_ranges, strict=True):
        path = np.abs(np.diff(trace.smooth_twist[first:last], prepend=trace.smooth_twist[first])).cumsum()
        np.testing.assert_allclose((found - plain)[first:last], 4.0 * share * np.exp(-path / length), atol=1e-9)
    other = replace(trace, friction={IndependentVariable.OUTPUT: shares})
    assert np.array_equal(Predictor(other, base, ("hysteresis",))(at).torque, plain)
    slope = (Predictor(built_up, base, ("hysteresis",))(at + np.array([0, 0, 0, 1e-9])).torque - found) / 1e-9
    sensitivity = Predictor(built_up, base, ("hysteresis",))(at).sensitivities[:, 3]
    assert np.abs(slope - sensitivity).max() < 1e-3 * np.abs(slope).max()


def test_every_candidate_is_in_a_set() -> None:
    candidates = {name for name, effect in EFFECTS.items() if not effect.identification.not_a_candidate}
    assert {n for names in SETS for n in names} == candidates


@pytest.mark.parametrize("time", [1e-3, 0.1, 10.0, 1e6])
def test_creep_stays_finite_where_the_time_steps_are_too_long(time: float) -> None:
    # With such steps the trajectory would diverge; a fit may pass through these parameters and must be able to return.
    predictor = Predictor(
        make_trace(rig.protocol(), rig.drive().ratio),
        drawing_base(rig.drive(), cached_lookup(rig.drive())),
        ("creep", "damping"),
    )
    found = predictor(np.array([0.0, 0.0, 1e-3, time, 0.0]))
    assert np.isfinite(found.torque).all()
    assert np.isfinite(found.sensitivities).all()


def test_a_delay_shifts_the_torque_in_time() -> None:
    """Against the torque at earlier times: of a smooth motion, to second order in the delay."""
    record, lookup = rig.protocol(oversampling=8), cached_lookup(rig.drive())
    trace = make_trace(replace(record, output_torque=lookup.torque(record.twist(rig.drive().ratio))), rig.drive().ratio)
    predictor = Predictor(trace, drawing_base(rig.drive(), lookup), ())
    prompt, late, later = (predictor(np.array([0.0, delay])).torque for delay in (0.0, 1e-3, 2e-3))
    np.testing.assert_allclose(later - prompt, 2 * (late - prompt), atol=1e-9)
    run = (trace.run == 0) & ~trace.start
    expected = np.interp(trace.time[run] - 1e-3, trace.time[run], prompt[run]) - prompt[run]
    change = (late - prompt)[run]
    # The rate is smoothed at the reversals.
    assert np.sqrt(np.mean((change - expected) ** 2)) < 0.1 * np.sqrt(np.mean(expected**2))
