"""Scatter as random effects of single elements, compared with individual drives from other code."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import weighting_of_covariance
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.preparation import prepare_problem, with_individuals
from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.curve_columns import SCALE, common_deviations
from reefmu.diagnosis.random_effects.element_columns import PairColumns, SeatedElements, average_torque
from reefmu.diagnosis.random_effects.element_motion import element_motion, spread_starts
from reefmu.diagnosis.random_effects.individuals import simulate_individuals
from reefmu.diagnosis.random_effects.part_responses import part_responses
from reefmu.diagnosis.random_effects.profile_steps import profile_steps
from reefmu.diagnosis.random_effects.responses import PLACES, element_responses, place_deviations, term
from reefmu.diagnosis.random_effects.scatter import PAIRS_EVERY, TERMS_EVERY, Scatter
from reefmu.diagnosis.random_effects.tolerance_scatter import Job, Result
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import Record
from stiffness_model import load_drive
from stiffness_model.numerics.arrays import Array
from stiffness_model.rotation import draw_individual
from stiffness_model.rotation.element_torques import element_path
from tests import diagnosis_rig as rig


@pytest.fixture(scope="module")
def scatter() -> Scatter:
    found = _problem(rig.measured({}, noise=0.5, seed=21)).scatter
    assert isinstance(found, Scatter)
    return found


def _problem(record: Record) -> Problem:
    trace = make_trace(record, rig.drive().ratio)
    return with_individuals(prepare_problem(record, trace, drawing_base(rig.drive(), cached_lookup(rig.drive()))))


def test_the_variance_is_that_of_individuals(scatter: Scatter) -> None:
    """Of drives whose torque is not linearised and whose elements stand anywhere; without what all elements share,
    which is beside what the drawing of each part allows."""
    variance = scatter.covariance_of_parts(scatter.twist)[0].diagonal()
    found = simulate_individuals(scatter, 512, seed=3, places=(PLACES, PLACES))
    loaded = np.abs(scatter.twist) > 0.3 * rig.drive().max_twist
    assert float(np.mean(found[:, loaded] ** 2)) == pytest.approx(float(np.mean(variance[loaded])), rel=0.25)


def test_the_covariance_is_that_of_individuals(scatter: Scatter) -> None:
    """Whitened by it, with noise, the deviations of individuals have the variance 1; without the correlation of the
    blocks the variance alone would say as much."""
    variance = scatter.covariance_at(scatter.twist).diagonal()
    found = simulate_individuals(scatter, 64, seed=3, places=(PLACES, PLACES))
    noise = 0.01 * float(variance.mean())
    noisy = found + np.sqrt(noise) * np.random.default_rng(0).standard_normal(found.shape)
    weights = weighting_of_covariance(np.full(len(variance), noise), scatter.covariance_at(scatter.twist))
    assert float(np.mean(weights.whiten(noisy.T) ** 2)) == pytest.approx(1.0, abs=0.1)
    apart = weighting_of_covariance(np.full(len(variance), noise), np.diag(variance))
    gain = [apart.cost(one) - weights.cost(one) for one in noisy]
    assert min(gain) > 1000


def test_the_covariance_is_the_mean_product_of_the_columns_of_all_starts(scatter: Scatter) -> None:
    some = np.arange(len(scatter.twist)) % 4 == 0
    scatter = replace(scatter, motion=scatter.motion.of_blocks(some), twist=scatter.twist[some], starts=6)
    parts = scatter.drive, scatter.responses, scatter.motion, scatter.twist, np.zeros(len(scatter.motion.block))
    average = average_torque(*parts)
    drive, responses, motion, *at = parts
    seen = part_responses(responses, motion, *at)
    seated = [SeatedElements(drive, responses, motion, seen, start) for start in spread_starts(drive, scatter.starts)]
    expected = _mean_product([one.columns() for one in seated])
    for order, every in enumerate(TERMS_EVERY):
        others = [float(k != order) for k in range(len(TERMS_EVERY))]
        few, all_starts = (
            _mean_product([one.columns() for one in some]) - _mean_product([one.columns(others) for one in some])
            for some in (seated[::every], seated)
        )
        # Of this drive, terms of the third order do not count.
        assert few.max() > 1e-4 * expected.max() or order == 2
        expected += few - all_starts
    of_pairs = _mean_product([_of_pairs(one.of_pairs(), len(scatter.twist)) for one in seated[::PAIRS_EVERY]])
    assert of_pairs.max() > 1e-4 * expected.max()
    steps = profile_steps(drive, seen, motion, average)
    expected += of_pairs + steps.T @ steps
    of_parts, _ = replace(scatter, by_clearance=None).covariance_of_parts(scatter.twist)
    np.testing.assert_allclose(of_parts, expected, atol=1e-12 * expected.max())
    # What the mean of all clearances does the base curve knows better than the columns.
    assert scatter.by_clearance is not None
    by_curve = motion.mean(scatter.by_clearance(motion.twist_from(scatter.twist), at[-1]))
    by_columns = _mean_product([one.together[None] / responses.deviation for one in seated])
    expected += scatter.mean_clearance_deviation**2 * (np.outer(by_curve, by_curve) - by_columns)
    of_parts, torque = scatter.covariance_of_parts(scatter.twist)
    np.testing.assert_allclose(of_parts, expected, atol=1e-12 * expected.max())
    np.testing.assert_array_equal(torque, average[0])
    common = common_deviations(torque, expected)
    expected += common.T @ common
    np.testing.assert_allclose(scatter.covariance_at(scatter.twist), expected, atol=1e-12 * expected.max())


def _mean_product(of_starts: Sequence[Array]) -> Array:
    """(n, n) (N.m)^2, mean over some starts of the products of their columns (m, n)."""
    return np.mean([columns.T @ columns for columns in of_starts], axis=0)


def _of_pairs(pairs: PairColumns, blocks: int) -> Array:
    """(m, n) N.m, the columns of pairs with a row for every pair and term."""
    found = np.zeros((len(pairs.values), pairs.number.max() + 1, blocks))
    for of_term, values in zip(found, pairs.values, strict=True):
        np.add.at(of_term, (pairs.number, pairs.block), values)
    return found.reshape(-1, blocks)


def test_elements_may_enter_the_profile_between_two_starts() -> None:
    """In a slow loop that is many blocks beside where they do for the nearest start. Of drives whose parts hardly
    deviate no block then stands out of the noise: the greatest of 600 has 3.2 standard deviations."""
    drive = load_drive("drive_1", gear_tolerance="1 um", cage_tolerance="1 um")
    trace = make_trace(rig.protocol(full=False), drive.ratio)
    blocks = make_blocks(trace, 1)
    motion, twist = element_motion(drive, trace, blocks), blocks.mean(trace.smooth_twist)
    scatter = Scatter(drive, element_responses(drive), motion, twist)
    found = simulate_individuals(scatter, 24, seed=1, places=(0.0, 0.0))
    noise = 0.001 * float(np.abs(scatter.responses.single).max())
    noisy = found + noise * np.random.default_rng(0).standard_normal(found.shape)
    weights = weighting_of_covariance(np.full(len(twist), noise**2), scatter.covariance_at(twist))
    white = weights.whiten(noisy.T)
    assert float(np.mean(white**2)) == pytest.approx(1.0, abs=0.1)
    assert float(np.median(np.abs(white).max(axis=0))) < 4.0


def test_parts_of_the_covariance_that_other_processes_compute_make_the_same_sum(scatter: Scatter) -> None:
    """To the last digit, so that no diagnosis depends on the number of workers."""
    sent: list[Any] = []

    def elsewhere(function: Callable[[Job], Result], jobs: Iterable[Job], /) -> Iterator[Result]:
        for job in jobs:
            sent.append(job)
            yield pickle.loads(pickle.dumps(function))(pickle.loads(pickle.dumps(job)))

    shared = scatter.covariance_at(scatter.twist, spread=elsewhere)
    np.testing.assert_array_equal(shared, scatter.covariance_at(scatter.twist))
    assert len(sent) > 1


def test_the_covariance_is_exact_where_elements_lift_off() -> None:
    """Of individuals with wide tolerances, little noise and deviations of places: the whitened squares are 1.44 in the
    mean under linear terms alone, and 1.06 without the products of elements and lobes."""
    drive = load_drive("drive_1", gear_tolerance="IT8", cage_tolerance="IT8")
    trace = make_trace(rig.protocol(), drive.ratio)
    blocks = make_blocks(trace, 8)
    motion = element_motion(drive, trace, blocks)
    wide = Scatter(drive, element_responses(drive), motion, blocks.mean(trace.smooth_twist))
    covariance = wide.covariance_at(wide.twist)
    noise = 1e-3 * float(covariance.diagonal().mean())
    found = simulate_individuals(wide, 24, seed=3, places=(PLACES, PLACES))
    noisy = found + np.sqrt(noise) * np.random.default_rng(0).standard_normal(found.shape)
    weights = weighting_of_covariance(np.full(len(covariance), noise), covariance)
    assert float(np.mean(weights.whiten(noisy.T) ** 2)) == pytest.approx(1.0, abs=0.035)


@pytest.mark.parametrize("shared", ["element", "eccentric"])
def test_the_mean_clearance_deviates_as_in_individuals(scatter: Scatter, shared: str) -> None:
    """By sizes and places of lobes and balls, and by cranks, one for each element or one for each eccentric."""
    drive = load_drive("drive_1", crank_deviation=shared, crank_tolerance="IT7")
    found = replace(scatter, drive=drive, responses=element_responses(drive))
    shares, rng = found.responses.shares, np.random.default_rng(0)
    cranks = rng.standard_normal((4000, drive.eccentrics if shared == "eccentric" else drive.elements))
    own = np.sqrt(1 - shares["crank"]) * rng.standard_normal((4000, drive.elements))
    clearance = own + np.sqrt(shares["crank"]) * np.tile(cranks, drive.elements // cranks.shape[1])
    expected = found.clearance_deviation * clearance.mean(axis=1).std()
    assert found.mean_clearance_deviation == pytest.approx(expected, rel=0.05)


def test_individuals_average_to_the_mean_drive(scatter: Scatter) -> None:
    """Those of any start without deviations of places."""
    loaded = np.abs(scatter.twist) > 0.3 * rig.drive().max_twist
    found = simulate_individuals(scatter, 64, seed=3, places=(0.0, 0.0))
    error = found.std(axis=0)[loaded] / np.sqrt(len(found))
    assert np.mean(np.abs(found.mean(axis=0)[loaded]) < 3 * error) > 0.95


def _shift(scatter: Scatter) -> Array:
    """(n,) N.m, the first of the random effects, by which places shift the mean, over all starts."""
    clearance = np.zeros(len(scatter.motion.rotation))
    parts = scatter.drive, scatter.responses, scatter.motion, scatter.twist, clearance
    seen = part_responses(*parts[1:])
    starts = spread_starts(scatter.drive, scatter.starts)
    return np.mean([SeatedElements(*parts[:3], seen, start).columns()[0] for start in starts], axis=0)


@pytest.mark.slow
def test_deviations_of_places_shift_the_mean_of_individuals(scatter: Scatter) -> None:
    """The shift is a random effect of its own; it grows with the square of the deviations."""
    loaded = (np.abs(scatter.twist) > 0.3 * rig.drive().max_twist) & (scatter.motion.count == 1)
    wide = 4.0
    # One drive of a seed has the same sizes with and without places.
    plain, placed = (
        np.concatenate([simulate_individuals(scatter, 1, seed, (at, at)) for seed in range(300)])[:, loaded]
        for at in (0.0, wide)
    )
    shift = (placed - plain).mean(axis=0) * (PLACES / wide) ** 2
    expected = _shift(scatter)[loaded]
    assert expected @ shift / np.linalg.norm(expected) / np.linalg.norm(shift) > 0.94
    assert np.linalg.norm(expected) == pytest.approx(np.linalg.norm(shift), rel=0.3)


@pytest.mark.parametrize("of_radii", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_places_twist_elements_and_move_lobes_outwards(scatter: Scatter, of_radii: bool) -> None:
    """What places add to the variance of individuals, against the slopes of one element's torque integrated over its
    positions: a bore and a lobe beside their places twist it; a lobe farther out is larger, unless radii do nothing.
    What bores and lobes move in and out at the edges of the profile adds a seventh where radii do nothing."""
    drive, r = rig.drive(), scatter.responses
    if not of_radii:
        middle = r.single[len(r.single) // 2]
        scatter = replace(scatter, responses=replace(r, single=np.broadcast_to(middle, r.single.shape).copy()))
    loaded = (np.abs(scatter.twist) > 0.3 * drive.max_twist) & (scatter.motion.count == 1)
    places = place_deviations(drive)
    tables = {name: table[0] for name, table in r.at_clearances(np.zeros(1)).items()}
    slope = np.gradient(tables["mean"], r.twist, axis=0)
    each = (places.along * slope) ** 2 + r.shares["place"] * tables[term(1, 0)] ** 2 * of_radii
    along = drive.elements / (2 * np.pi) * np.trapezoid(each, r.position, axis=1)
    expected = float(np.mean(np.interp(scatter.twist, r.twist, along)[loaded]))
    # One drive of a seed has the same radii with and without places.
    plain, placed = (
        np.concatenate([simulate_individuals(scatter, 1, seed, (at, at)) for seed in range(200)])[:, loaded]
        for at in (0.0, PLACES)
    )
    edges = 1.0 if of_radii else 8 / 7
    assert float(np.mean((placed - plain) ** 2)) == pytest.approx(edges * expected, rel=0.1)


def test_the_weights_explain_an_individual_of_the_solver() -> None:
    """Elements placed and solved by `stiffness_model.rotation` at every sample of a record: whitening removes most of
    the deviation. A twist moves them along the profile."""
    drive, plain = rig.drive(), rig.measured({}, noise=0.5, seed=21)
    output = plain.crank_angle / drive.ratio - _twist(plain)
    path = element_path(draw_individual(drive, 1), output, _twist(plain))
    deviation = path.torque.sum(axis=1) - _mean_torque(plain)
    problem = _problem(replace(plain, output_torque=plain.output_torque + deviation))
    gap = problem.blocks.mean(deviation)
    weights = problem.weights.with_likeliest_scatter(gap, 1.0, 1.0)
    raw = float(((gap * weights.scale) ** 2).sum())
    whitened = float((weights.whiten(gap) ** 2).sum())
    assert whitened < 0.02 * raw
    assert whitened < 2 * len(weights.eigenvalues)


def _twist(record: Record) -> Array:
    return record.crank_angle / rig.drive().ratio - record.output_angle


def _mean_torque(record: Record) -> Array:
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    return base.elastic.evaluate(_twist(record), 0.0, base.shape.start)[0]


def test_a_preloaded_drive_scatters_at_zero_torque_too(scatter: Scatter) -> None:
    near = np.abs(scatter.twist) < 0.02 * rig.drive().max_twist
    plain, tight = (np.sqrt(scatter.covariance_at(scatter.twist, c).diagonal())[near].mean() for c in (0.0, -6e-6))
    assert tight > 3 * plain


def test_what_is_between_contacts_and_sensors_moves_no_element(scatter: Scatter) -> None:
    """Elements follow the twist of the contacts: the covariance at another one is that of a record with that twist."""
    record = rig.measured({}, noise=0.5, seed=21)
    trace = make_trace(record, rig.drive().ratio)
    ahead = 6e-4 * np.sin(2 * trace.crank) + 1e-6 * trace.torque
    blocks = make_blocks(trace, 8)
    motion = element_motion(scatter.drive, trace, blocks)
    here = Scatter(scatter.drive, scatter.responses, motion, blocks.mean(trace.smooth_twist))
    moved = replace(trace, smooth_twist=trace.smooth_twist - ahead)
    twist = blocks.mean(moved.smooth_twist)
    there = replace(here, motion=element_motion(scatter.drive, moved, blocks), twist=twist)
    some = np.arange(0, len(twist), 3)

    def covariance(scatter: Scatter, at: Array, beside: Array | None = None) -> Array:
        return scatter.covariance_at(at, 0.0, beside)[np.ix_(some, some)]

    expected = covariance(there, twist)
    found, block_means, unmoved = (
        covariance(here, at, beside) for at, beside in ((twist, -ahead), (twist, None), (here.twist, None))
    )
    size = float(np.abs(expected).max())
    assert np.abs(found - expected).max() < 0.02 * size
    assert np.abs(block_means - expected).max() > 0.03 * size
    assert np.abs(unmoved - expected).max() > 0.1 * size


@pytest.mark.slow
def test_the_covariance_holds_a_scale_that_all_elements_share() -> None:
    """A scale that is off by its standard deviation is one standard deviation of the covariance at most, although it
    makes no ripple; without what all elements share it would be two and more."""
    problem = _problem(rig.measured({}, noise=0.5, seed=21))
    assert isinstance(problem.scatter, Scatter)
    off = SCALE * base_fit(problem).prediction.elastic
    assert float((problem.weights.with_size(1.0).whiten(off) ** 2).sum()) < 1.0
    of_parts, _ = problem.scatter.covariance_of_parts(problem.scatter.twist)
    alone = weighting_of_covariance(problem.variance, of_parts)
    assert float((alone.whiten(off) ** 2).sum()) > 4.0
