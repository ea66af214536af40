"""The FMU in a closed loop: co-simulation, the system of python-control and the FMU block agree."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import control as ct
import numpy as np
import pytest

from reefmu.joint import JointModel, Motion, Scheme, cosimulate, fmu_block, joint_system, masses_block, simulate_joint
from tests.integration.cosimulation.joints import MASSES, released

MOTION = ("crank.phi", "crank.w", "output.phi", "output.w")


def controller(held: np.ndarray, time: float, motion: np.ndarray) -> tuple[float, float]:
    """A motor-side PD controller in addition to the holding torque."""
    return float(held[0] - 0.5 * motion[0] - 5e-3 * motion[1] + 0.2 * math.sin(200 * time)), float(held[1])


def by_loop(joint: JointModel, fmu: Path, step: float, scheme: Scheme) -> Motion:
    start, held = released(joint)
    return cosimulate(
        fmu, MASSES, lambda t, m: controller(held, t, m), step=step, duration=0.01, start=start[:4], scheme=scheme
    )


def by_system(joint: JointModel, step: float) -> Motion:
    start, held = released(joint)
    return simulate_joint(joint, lambda t, m: controller(held, t, m), step=step, duration=0.01, start=start)


def by_block(joint: JointModel, fmu: Path, step: float, scheme: Scheme) -> np.ndarray:
    """Motion, shape (n + 1, 4), by python-control: FMU block, inertias and controller, connected by signal names."""
    assert scheme != "sequential"
    start, held = released(joint)
    names = [name.replace(".", "_") for name in MOTION]
    law = ct.NonlinearIOSystem(
        None,
        lambda t, x, u, _p: controller(held, t, u),
        inputs=names,
        outputs=["motor_tau", "load_tau"],
        dt=step,
        name="law",
    )
    masses = masses_block(MASSES, step, joint.ratio, scheme=scheme)
    with fmu_block(fmu, step, initial=dict(zip(MOTION, start[:4], strict=True))) as block:
        loop = ct.interconnect([masses, block, law], inputs=[], outputs=names, name="loop", check_unused=False)
        time = step * np.arange(round(0.01 / step) + 1)
        return np.asarray(ct.input_output_response(loop, time, 0, np.append(start[:4], 0.0)).outputs).T


@pytest.mark.parametrize(("scheme", "order", "bound"), [("parallel", 1, 5e-2), ("extrapolated", 2, 2e-5)])
def test_loop_block_and_system_agree_and_converge(
    joint: JointModel, plain_fmu: Path, scheme: Scheme, order: int, bound: float
) -> None:
    """Loop and block give the same motion, which converges to that of the system with the order of the coupling.

    bound: of the difference at 50 us, relative to the motion of the output.
    """
    errors = []
    for step in (1e-4, 5e-5, 2.5e-5):
        loop, system = by_loop(joint, plain_fmu, step, scheme), by_system(joint, step)
        errors.append(np.abs(loop["output.phi"] - system["output.phi"]).max() / np.ptp(system["output.phi"]))
        if step == 5e-5:
            block = by_block(joint, plain_fmu, step, scheme)
            assert np.abs(block - loop.values[:, :4]).max(axis=0) == pytest.approx(0, abs=1e-12 * np.abs(block).max())
    assert errors[1] < bound
    assert [np.log2(a / b) for a, b in itertools.pairwise(errors)] == pytest.approx([order, order], abs=0.5)


@pytest.mark.parametrize(("scheme", "order"), [("sequential", 2), ("extrapolated", 1)])
def test_order_with_hysteresis(lossy: JointModel, lossy_fmu: Path, scheme: Scheme, order: int) -> None:
    """The output `stiffness` does not include friction, so that part of the torque lags by one step."""
    errors = [
        np.abs(by_loop(lossy, lossy_fmu, step, scheme)["output.phi"] - by_system(lossy, step)["output.phi"]).max()
        for step in (1e-4, 5e-5)
    ]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


def test_python_control_integrates_the_closed_loop(joint: JointModel) -> None:
    """python-control connects the controller continuously; the sampled one converges to it with the step size."""
    start, held = released(joint)
    law = ct.NonlinearIOSystem(
        None,
        lambda t, x, u, _p: controller(held, t, u),
        outputs=["motor_tau", "load_tau"],
        inputs=[name.replace(".", "_") for name in MOTION],
        name="law",
    )
    loop = ct.interconnect([joint_system(joint), law], inputs=[], outputs=["output_phi"], check_unused=False)
    response = ct.input_output_response(
        loop, 1e-3 * np.arange(11), 0, start, solve_ivp_kwargs={"max_step": 5e-4, "rtol": 1e-7}
    )
    expected = np.asarray(response.outputs).ravel()
    errors = [
        np.abs(by_system(joint, step)["output.phi"][:: round(1e-3 / step)] - expected).max() for step in (4e-5, 2e-5)
    ]
    assert errors[1] < 5e-3 * np.ptp(expected)
    assert errors[0] / errors[1] == pytest.approx(2, abs=0.1)


def test_both_back_ends_give_the_same_motion(plain_fmu: Path, native_fmu: Path) -> None:
    """FMI does not allow to read the ratio of a native FMU before initialisation; the master has it nevertheless."""
    first, second = (
        cosimulate(fmu, MASSES, lambda _t, _m: (0.5, -3.0), step=1e-4, duration=0.01) for fmu in (plain_fmu, native_fmu)
    )
    for name in MOTION:
        np.testing.assert_allclose(first[name], second[name], rtol=1e-9, atol=1e-12)
