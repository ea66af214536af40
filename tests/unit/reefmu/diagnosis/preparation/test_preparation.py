"""The problem of an individual's record: how its torque is read late, and an effect that moves its elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.parameter_layout import DELAY
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.random_effects.element_motion import element_motion
from reefmu.diagnosis.random_effects.scatter import Scatter
from reefmu.diagnosis.report.assemble import notes_on_measurement
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.record import Record
from reefmu.simulate import simulate_record
from tests import diagnosis_rig as rig
from tests.channel_filter import with_filtered_channels
from tests.individual_records import mean_lookup, record_at_held_torque, record_of_individual, seated_drive

AMPLITUDE = 3e-4
"""rad, of the kinematic error: its torque is 9 to 12 times the scatter."""


@pytest.mark.slow
@pytest.mark.parametrize("made", [record_of_individual, record_at_held_torque])
def test_a_late_torque_is_known_whether_the_rig_holds_twist_or_torque(made: Callable[..., Record]) -> None:
    """While the crank turns by several elements between two samples, of which one steps on within the delay: what the
    passing elements make is scatter, at any time."""
    drive, late = seated_drive(24), 0.004
    record = made(drive, late=late)
    problem = prepare_problem(record, make_trace(record, drive.ratio), drawing_base(drive, mean_lookup(drive)))
    fit = base_fit(problem)
    assert fit.parameters[DELAY] == pytest.approx(late, abs=3e-4)
    assert fit.weighting.size == pytest.approx(1.0, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("made", [record_of_individual, record_at_held_torque])
def test_what_passing_elements_add_to_a_late_torque_is_scatter(made: Callable[..., Record]) -> None:
    drive = seated_drive(24)
    record = made(drive, late=0.004)
    problem = prepare_problem(record, make_trace(record, drive.ratio), drawing_base(drive, mean_lookup(drive)))
    base = base_fit(problem)
    assert base.chi_square < 1.3 * problem.expected_chi_square(base.weighting)


@pytest.mark.slow
@pytest.mark.parametrize("per_row", [24, 29])
def test_a_large_kinematic_error_does_not_hide_in_the_scatter(per_row: int) -> None:
    """What twists the output beside the contacts moves none of the elements, also between the samples of a block."""
    drive = seated_drive(per_row)
    record = record_of_individual(drive, noise=0.1)
    twisted = record.output_angle - AMPLITUDE * np.sin(2 * record.crank_angle + 0.7)
    record = replace(record, output_angle=twisted)
    found = analyse(record, BaseCurveSource(drive, make=lambda trace: drawing_base(drive, mean_lookup(drive))))
    assert isinstance(found, Analysis)
    (fit,) = (fit for fit in found.evidence.search.all_fits if fit.names == ("kinematic_error",))
    assert found.diagnosis.verdict == "named"
    assert [effect.name for effect in found.diagnosis.effects] == ["kinematic_error"]
    layout = found.evidence.problem.layout(fit.names)
    amplitude = layout.by_effect(fit.parameters)["kinematic_error"]["amplitude_2"]
    assert amplitude == pytest.approx(AMPLITUDE, rel=0.04)
    assert fit.weighting.size <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("time_constant", "damping", "friction"),
    [(0.0, 0.0, 0.0), (3e-4, 0.0, 0.0), (5e-4, 0.0, 0.0), (5e-4, 500.0, 0.0), (5e-4, 0.0, 20.0)],
)
def test_the_filter_of_all_channels_is_found_where_elements_pass_at_several_speeds(
    time_constant: float, damping: float, friction: float
) -> None:
    """Within 0.05 ms, of a record ten times as fast as the usual one, whatever is missing: by where the elements were
    at the first part of each block before the filter. damping: N.m.s/rad, of the twist; friction: N.m, of the
    output."""
    drive = seated_drive(29)
    usual = record_of_individual(drive, noise=0.1)
    usual = replace(usual, time=usual.time / 10)
    trace = make_trace(usual, drive.ratio)
    missing = damping * trace.twist_rate + friction * np.sign(trace.output_speed)
    record = replace(usual, output_torque=usual.output_torque + missing)
    record = with_filtered_channels(record, time_constant or 1e-9)
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, drawing_base(drive, mean_lookup(drive)))
    scatter = problem.scatter
    assert isinstance(scatter, Scatter)
    expected = element_motion(drive, problem.trace, problem.blocks, time_constant)
    turning = problem.blocks.mean(np.abs(trace.crank_speed)) > 30
    found = scatter.motion
    ahead = (found.rotation[found.first] - expected.rotation[expected.first])[turning]
    assert np.abs(ahead).max() < 60 * 5e-5
    assert scatter.time_constant == pytest.approx(time_constant, abs=5e-5)
    told = [note for note in notes_on_measurement(problem) if "filter" in note]
    assert len(told) == (time_constant > 0)
    assert all(f"time constant of {1e3 * scatter.time_constant:.2g} ms" in note for note in told)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_mean_drive_shows_no_filter(seed: int) -> None:
    """No single element passes there, and noise makes one time constant likelier than another."""
    usual = rig.measured({}, noise=0.5, seed=seed)
    record = replace(usual, time=usual.time / 10)
    trace = make_trace(record, rig.drive().ratio)
    scatter = prepare_problem(record, trace, drawing_base(rig.drive(), cached_lookup(rig.drive()))).scatter
    assert isinstance(scatter, Scatter)
    assert scatter.time_constant == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "parameters"),
    [("damping", {"coefficient": 2000.0}), ("hysteresis", {"torque": 5.0, "presliding": 1e-4})],
)
def test_damping_makes_noise_of_the_noise_of_the_rate(effect: str, parameters: dict[str, float]) -> None:
    """While the crank turns fast, the twist swings with it: what is left beside the damper is as large as expected.
    Friction, which resembles a damper in slow loops, adds nothing."""
    usual = rig.protocol()
    swinging = usual.output_angle + 1e-4 * np.sin(4 * usual.crank_angle)
    true = replace(usual, time=usual.time / 10, output_angle=swinging)
    model = build_model(rig.drive(), {effect: parameters}, lookup=cached_lookup(rig.drive()))
    torque = simulate_record(model, true)["measured.tau"] + rig.noise_of(len(true), 0.3, 0.5, 0)
    angle = swinging + 5e-6 * np.random.default_rng(0).standard_normal(len(true))
    record = replace(true, output_angle=angle, output_torque=torque)
    trace = make_trace(record, rig.drive().ratio)
    problem = prepare_problem(record, trace, drawing_base(rig.drive(), cached_lookup(rig.drive())))
    fast = problem.blocks.mean(np.abs(trace.crank_speed)) > 30
    more = np.median(problem.variance[fast]) / np.median(problem.variance[~fast])
    assert more > 10 if effect == "damping" else more < 2
    fit = problem.fit_from((effect,), np.array([*base_fit(problem).parameters, *parameters.values()]))
    assert fit.chi_square < 1.3 * problem.expected_chi_square(fit.weighting)


@pytest.mark.parametrize("torque", [0.0, 12.0])
def test_friction_makes_noise_of_the_noise_of_the_path(torque: float) -> None:
    """After a reversal friction rises over 30 urad of the path, which an encoder shows with a noise of 3 urad: what is
    left there is as large as expected, where the noise of sensor and stiffness alone would be exceeded several times.
    Without friction nothing is added."""
    model = {"hysteresis": {"torque": torque, "presliding": 3e-5}} if torque else {}
    exact = rig.measured(model, noise=0.2, full=False)
    angle = exact.output_angle + 3e-6 * np.random.default_rng(0).standard_normal(len(exact))
    record = replace(exact, output_angle=angle)
    trace = make_trace(record, rig.drive().ratio)
    problem = prepare_problem(record, trace, drawing_base(rig.drive(), cached_lookup(rig.drive())))
    after = problem.variance > 2 * np.median(problem.variance)
    assert after.any() == bool(torque)
    if torque:
        assert after.sum() < 0.2 * len(after)
        start = [*base_fit(problem).parameters, torque, 3e-5]
        fit = problem.fit_from(("hysteresis",), np.array(start))
        squares = (problem.torque - fit.prediction.torque) ** 2
        assert 0.5 < np.mean(squares[after] / problem.block_variance[after]) < 2
        assert np.mean(squares[after]) > 3 * np.median(problem.block_variance)
