"""The lag of a co-simulated spring, and the greatest step that it allows."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from reefmu.joint import JointModel, Scheme, cosimulate, growth_rate, largest_step, step_warning
from stiffness_model.errors import InputError, UnknownNameError
from tests.integration.cosimulation.joints import FREE


def free_growth(fmu: Path, joint: JointModel, scheme: Scheme, step: float, cycles: float) -> tuple[float, float]:
    """Growth rate, 1/s, of a small free oscillation around 100 N.m, from simulation and from theory."""
    start, held = joint.equilibrium(-100.0)
    lookup = joint.drive.lookup
    stiffness, inertia = float(lookup.stiffness(lookup.twist_at(100.0))), FREE.reduced_inertia(joint.ratio)
    omega = math.sqrt(stiffness / inertia)
    rest = -start[2]
    start[2] -= 1e-9
    n = max(round(cycles * 2 * math.pi / omega / step), 12)
    motion = cosimulate(
        fmu,
        FREE,
        lambda _t, _m: (float(held[0]), float(held[1])),
        step=step,
        duration=n * step,
        start=start[:4],
        scheme=scheme,
    )
    twist = motion["crank.phi"] / joint.ratio - motion["output.phi"] - rest
    amplitude = np.hypot(twist, (motion["crank.w"] / joint.ratio - motion["output.w"]) / omega)
    middle, quarter = n // 2, max(n // 4, 1)
    early, late = amplitude[middle - quarter : middle].max(), amplitude[-quarter:].max()
    return math.log(late / early) / ((n + 1 - middle) * step), growth_rate(step, stiffness, inertia, scheme=scheme)


@pytest.mark.parametrize(("step", "cycles"), [(1e-5, 8), (5e-5, 8), (2e-4, 6)])
def test_parallel_stepping_grows_at_the_derived_rate(
    plain_fmu: Path, plain: JointModel, step: float, cycles: float
) -> None:
    simulated, derived = free_growth(plain_fmu, plain, "parallel", step, cycles)
    assert derived > 5
    assert simulated == pytest.approx(derived, rel=0.05)


@pytest.mark.parametrize(
    ("scheme", "step"),
    [
        ("sequential", 1e-4),
        ("sequential", 1e-3),
        ("extrapolated", 1e-4),
        ("extrapolated", 1e-3),
        ("extrapolated", 5e-3),
    ],
)
def test_other_schemes_do_not_grow(plain_fmu: Path, plain: JointModel, scheme: Scheme, step: float) -> None:
    simulated, derived = free_growth(plain_fmu, plain, scheme, step, 20)
    assert derived == 0
    assert abs(simulated) < 2


def test_large_oscillations(plain_fmu: Path, plain: JointModel) -> None:
    """Across the range of low stiffness: `parallel` gains energy, `sequential` conserves it, `extrapolated` loses."""
    start, _ = plain.equilibrium(-150.0)

    def amplitude_ratio(scheme: Scheme) -> float:
        motion = cosimulate(
            plain_fmu, FREE, lambda _t, _m: (0.0, 0.0), step=1e-4, duration=0.02, start=start[:4], scheme=scheme
        )
        twist = motion["crank.phi"] / plain.ratio - motion["output.phi"]
        return float(np.abs(twist[-80:]).max() / abs(twist[0]))

    assert amplitude_ratio("parallel") > 2
    assert amplitude_ratio("sequential") == pytest.approx(1, abs=0.01)
    assert 0.9 < amplitude_ratio("extrapolated") < 1


@pytest.mark.parametrize("stiffness", [2.5e4, 1.3e5])
def test_the_largest_step_has_the_growth_rate_that_was_asked_for(stiffness: float) -> None:
    inertia = FREE.reduced_inertia(-29)
    omega = math.sqrt(stiffness / inertia)
    for growth in (0.1, 1.0, 10.0):
        step = largest_step(stiffness, inertia, growth=growth)
        assert growth_rate(step, stiffness, inertia) == pytest.approx(growth, rel=1e-6)
        assert step == pytest.approx(4 / 3 * growth / omega**2, rel=0.01), "first order: rate = 3/4 omega^2 h"
    assert largest_step(stiffness, inertia, growth=0.0, decay=5.0) == largest_step(stiffness, inertia, growth=5.0)
    assert growth_rate(2.01 / omega, stiffness, inertia, scheme="sequential") > 0
    assert largest_step(stiffness, inertia, scheme="sequential") == pytest.approx(2 / omega)
    assert largest_step(stiffness, inertia, scheme="extrapolated") == math.inf
    fast = largest_step(stiffness, inertia, growth=1e9)
    assert growth_rate(fast, stiffness, inertia) >= growth_rate(0.9 * fast, stiffness, inertia)


def test_warning_at_export() -> None:
    assert step_warning(1e-7, 1e5, 0.08) == ""
    text = step_warning(1e-3, 1e5, 0.08, decay=20.0)
    assert "178 Hz" in text
    assert "\n" not in text
    with pytest.raises(InputError, match="growth"):
        largest_step(1e5, 0.08, growth=-1.0)
    with pytest.raises(UnknownNameError, match="scheme"):
        growth_rate(1e-3, 1e5, 0.08, scheme="jacobi")  # type: ignore[arg-type]
