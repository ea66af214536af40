"""Effort and memory of the Newton iteration: converged elements leave it, and blocks bound its memory."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium import newton
from stiffness_model.equilibrium.closed_form import MAX_PAIRS, Status, solve, solve_chunks
from tests.benchmarks.contacts import bench_newton


@pytest.fixture
def interfering() -> Contacts:
    """Balls that are all larger than their bores."""
    drive = sm.load_drive("drive_1", cage_offset="-20 um")
    deviations = sampling.draw(drive, 0, sampling.BLOCK, 0)
    return usable_elements(drive, deviations).contacts


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, float]]:
    """Number of elements and greatest damping of every Newton step."""
    taken: list[tuple[int, float]] = []

    def counted(step: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
        def wrapped(force: np.ndarray, hessian: np.ndarray, damping: np.ndarray, unit: np.ndarray) -> np.ndarray:
            taken.append((force.shape[1], float(damping.max())))
            return step(force, hessian, damping, unit)

        return wrapped

    monkeypatch.setattr(newton, "_damped_step", counted(newton._damped_step))  # pyright: ignore[reportPrivateUsage]
    return taken


def test_element_without_equilibrium_does_not_slow_down_the_others(
    interfering: Contacts, steps: list[tuple[int, float]]
) -> None:
    crank = np.linspace(0.0, 0.06, 5)
    solve(interfering, crank)
    usual = sum(n for n, _ in steps)
    steps.clear()
    bad = dataclasses.replace(
        interfering, stiffness_gear=np.where(np.arange(len(interfering)) == 4, np.nan, interfering.stiffness_gear)
    )
    result = solve(bad, crank)
    assert (result.status[:, 4] == Status.NOT_CONVERGED).all()
    assert (np.delete(result.status, 4, axis=1) != Status.NOT_CONVERGED).all()
    assert sum(n for n, _ in steps) <= usual + 5 * newton.MAX_STEPS
    # The damping starts at 1e-6 and grows by 8 in a step: 200 steps would overflow in the determinant.
    assert max(damping for _, damping in steps) < 1e25


def test_iteration_stops_when_steps_are_below_the_rounding_of_the_position(
    interfering: Contacts, monkeypatch: pytest.MonkeyPatch, steps: list[tuple[int, float]]
) -> None:
    """With an energy that only rises every step is rejected."""
    at = newton._ForceField.at  # pyright: ignore[reportPrivateUsage]
    calls = iter(range(10**6))

    def rising(field: object, x: np.ndarray, foot: np.ndarray) -> object:
        state = at(field, x, foot)  # type: ignore[arg-type]
        return dataclasses.replace(state, energy=np.full_like(state.energy, float(next(calls))))

    monkeypatch.setattr(newton._ForceField, "at", rising)  # pyright: ignore[reportPrivateUsage]
    n = len(interfering)
    with np.errstate(over="raise"):
        _, _, _, converged = newton.minimise_energy(
            interfering, np.full(n, 0.05), np.zeros((2, n)), np.full((2, n), 1e-4)
        )
    assert not converged.any()
    assert len(steps) < 40
    assert max(damping for _, damping in steps) < 1e25


def test_blocks_are_bounded_and_do_not_change_the_solution(
    interfering: Contacts, steps: list[tuple[int, float]]
) -> None:
    crank = np.linspace(-0.05, 0.06, 90)
    assert len(crank) * len(interfering) > 3 * newton.MAX_ELEMENTS
    result = solve(interfering, crank)
    assert max(n for n, _ in steps) <= newton.MAX_ELEMENTS
    size = max(float(result.cage_plus.max()), float(result.cage_minus.max()))
    for part in (slice(0, 1), slice(40, 47), slice(89, 90)):
        alone = solve(interfering, crank[part])
        for name in ("gear", "crank", "cage_plus", "cage_minus"):
            np.testing.assert_allclose(getattr(alone, name), getattr(result, name)[part], atol=1e-12 * size)


def test_chunks_cover_the_twists_in_order(interfering: Contacts, monkeypatch: pytest.MonkeyPatch) -> None:
    from stiffness_model.equilibrium import closed_form as equilibrium

    monkeypatch.setattr(equilibrium, "MAX_PAIRS", 4 * len(interfering))
    crank = np.linspace(0.0, 0.06, 10)
    chunks = list(solve_chunks(interfering, crank))
    assert [len(result.gear) for _, result in chunks] == [4, 4, 2]
    np.testing.assert_array_equal(np.concatenate([crank[part] for part, _ in chunks]), crank)
    assert MAX_PAIRS * 65 < 50e6


def test_memory_beside_the_results_does_not_grow_with_the_number_of_twists() -> None:
    """Measured by `tracemalloc`, with small blocks so that few twists fill many of them."""
    drive = sm.load_drive("drive_1", cage_offset="-20 um")
    with pytest.MonkeyPatch.context() as patch:
        from stiffness_model.equilibrium import closed_form as equilibrium

        patch.setattr(equilibrium, "MAX_PAIRS", 2**14)
        patch.setattr(equilibrium, "MAX_ELEMENTS", 2**11)
        few, many = (bench_newton.peak(drive, 4, n) for n in (100, 800))
    assert many < 1.3 * few + 1e6
    assert many < 40e6
