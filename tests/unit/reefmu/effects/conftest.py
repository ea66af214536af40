"""A trajectory that changes all inputs, and models with effects on the small lookup."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.numerics.arrays import Array

Build = Callable[..., DriveModel]


class Trajectory(NamedTuple):
    """time: (n,) s; inputs: (n, 5); angles (n,), rad, computed from them."""

    time: Array
    inputs: Array
    crank: Array
    output: Array
    twist: Array


@pytest.fixture(scope="session")
def trajectory(drive: sm.Drive) -> Trajectory:
    """400 samples at uneven times: the crank turns both ways, torque changes sign, temperature rises."""
    rng = np.random.default_rng(7)
    n = 400
    time = 3.0 + np.cumsum(rng.uniform(1e-3, 0.4, n))
    crank = 2.0 * np.sin(0.11 * time) + np.cumsum(rng.normal(0, 0.02, n))
    twist = 1.1 * drive.max_twist * np.sin(0.37 * time) + rng.normal(0, 2e-5, n)
    output = crank / drive.ratio - twist
    warm = 20 + 15 * np.sin(0.05 * time)
    speed = rng.normal(0, 1, (2, n)) * [[2.0], [0.05]]
    return Trajectory(
        time, np.stack([crank, speed[0], output, speed[1], warm], axis=1), crank, output, crank / drive.ratio - output
    )


@pytest.fixture(scope="session")
def build(drive: sm.Drive, lookup: Lookup) -> Build:
    """(effects) -> model with the small lookup."""

    def make(effects: Mapping[str, Mapping[str, float]] | None = None, **named: Mapping[str, float]) -> DriveModel:
        return build_model(drive, {**(effects or {}), **named}, lookup=lookup)

    return make


@pytest.fixture(scope="session")
def typical() -> dict[str, dict[str, float]]:
    """Every effect at its nominal size."""
    return {e.name: {p.name: p.nominal for p in e.parameters} for e in EFFECTS.values()}
