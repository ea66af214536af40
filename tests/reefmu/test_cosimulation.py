"""The FMU in a loop: three ways agree, the lag and the step it allows, the FMU as a python-control block."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import control as ct
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.fmu.build import export_fmu
from reefmu.joint import (
    JointModel,
    Masses,
    Motion,
    Scheme,
    cosimulate,
    fmu_block,
    growth_rate,
    joint_system,
    largest_step,
    masses_block,
    simulate_joint,
    step_warning,
)
from reefmu.model import build_model
from stiffness_model.errors import InputError, UnknownNameError
from stiffness_model.lookup import Lookup

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
FREE = Masses(motor_inertia=1e-4, load_inertia=2.0)
MOTION = ("crank.phi", "crank.w", "output.phi", "output.w")


@pytest.fixture(scope="module")
def joint(drive: sm.Drive, lookup: Lookup) -> JointModel:
    """An elastic drive in a damped joint."""
    return JointModel(build_model(drive, lookup=lookup), MASSES)


@pytest.fixture(scope="module")
def plain(joint: JointModel) -> JointModel:
    """The same without damping."""
    return JointModel(joint.drive, FREE)


@pytest.fixture(scope="module")
def lossy(drive: sm.Drive, lookup: Lookup) -> JointModel:
    effects = {"hysteresis": {"torque": 1.0, "presliding": 2e-4}, "structural_compliance": {"compliance": 2e-6}}
    return JointModel(build_model(drive, effects, lookup=lookup), MASSES)


@pytest.fixture(scope="module")
def plain_fmu(joint: JointModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(joint.drive, tmp_path_factory.mktemp("joint") / "plain.fmu")


@pytest.fixture(scope="module")
def lossy_fmu(lossy: JointModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(lossy.drive, tmp_path_factory.mktemp("joint") / "lossy.fmu")


def released(joint: JointModel) -> tuple[np.ndarray, np.ndarray]:
    """A start beside the equilibrium under 100 N.m, and the torques that hold that."""
    start, held = joint.equilibrium(-100.0)
    start[2] += 1e-4
    return start, held


def controller(held: np.ndarray, time: float, motion: np.ndarray) -> tuple[float, float]:
    """A motor-side PD on top of the holding torque."""
    return float(held[0] - 0.5 * motion[0] - 5e-3 * motion[1] + 0.2 * math.sin(200 * time)), float(held[1])


# -- three ways --------------------------------------------------------------------------------------------


def by_loop(joint: JointModel, fmu: Path, step: float, scheme: Scheme) -> Motion:
    start, held = released(joint)
    return cosimulate(fmu, MASSES, lambda t, m: controller(held, t, m), step=step, duration=0.01, start=start[:4],
                      scheme=scheme)


def by_system(joint: JointModel, step: float) -> Motion:
    start, held = released(joint)
    return simulate_joint(joint, lambda t, m: controller(held, t, m), step=step, duration=0.01, start=start)


def by_block(joint: JointModel, fmu: Path, step: float, scheme: Scheme) -> np.ndarray:
    """(n + 1, 4) from python-control: FMU block, masses and controller, connected by their signals' names."""
    assert scheme != "sequential"
    start, held = released(joint)
    names = [name.replace(".", "_") for name in MOTION]
    law = ct.NonlinearIOSystem(None, lambda t, x, u, _p: controller(held, t, u), inputs=names,
                               outputs=["motor_tau", "load_tau"], dt=step, name="law")
    masses = masses_block(MASSES, step, joint.ratio, scheme=scheme)
    with fmu_block(fmu, step, initial=dict(zip(MOTION, start[:4], strict=True))) as block:
        loop = ct.interconnect([masses, block, law], inputs=[], outputs=names, name="loop", check_unused=False)
        time = step * np.arange(round(0.01 / step) + 1)
        return np.asarray(ct.input_output_response(loop, time, 0, np.append(start[:4], 0.0)).outputs).T


@pytest.mark.parametrize(("scheme", "order", "bound"), [("parallel", 1, 5e-2), ("extrapolated", 2, 2e-5)])
def test_three_ways_agree_and_converge(joint: JointModel, plain_fmu: Path, scheme: Scheme, order: int,
                                       bound: float) -> None:
    """Loop and block are one thing; both come to the system's motion with the order of their coupling.

    bound: of the difference at 50 us, as a share of the output's motion.
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
    """The stiffness output knows nothing of friction: that part of the torque stays one step late."""
    errors = [np.abs(by_loop(lossy, lossy_fmu, step, scheme)["output.phi"] - by_system(lossy, step)["output.phi"]).max()
              for step in (1e-4, 5e-5)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


def test_python_control_integrates_the_closed_loop(joint: JointModel) -> None:
    """The controller connected in python-control is continuous; ours is held, and comes to that as steps shrink."""
    start, held = released(joint)
    law = ct.NonlinearIOSystem(None, lambda t, x, u, _p: controller(held, t, u), outputs=["motor_tau", "load_tau"],
                               inputs=[name.replace(".", "_") for name in MOTION], name="law")
    loop = ct.interconnect([joint_system(joint), law], inputs=[], outputs=["output_phi"], check_unused=False)
    theirs = ct.input_output_response(loop, 1e-3 * np.arange(11), 0, start,
                                      solve_ivp_kwargs={"max_step": 5e-4, "rtol": 1e-7})
    expected = np.asarray(theirs.outputs).ravel()
    errors = [np.abs(by_system(joint, step)["output.phi"][::round(1e-3 / step)] - expected).max()
              for step in (4e-5, 2e-5)]
    assert errors[1] < 5e-3 * np.ptp(expected)
    assert errors[0] / errors[1] == pytest.approx(2, abs=0.1)


# -- the lag and the step it allows ------------------------------------------------------------------------


def free_growth(fmu: Path, joint: JointModel, scheme: Scheme, step: float, cycles: float) -> tuple[float, float]:
    """Growth rate, 1/s, of a small free oscillation about 100 N.m; simulated and derived."""
    start, held = joint.equilibrium(-100.0)
    lookup = joint.drive.lookup
    stiffness, inertia = float(lookup.stiffness(lookup.twist_at(100.0))), FREE.reduced_inertia(joint.ratio)
    omega = math.sqrt(stiffness / inertia)
    rest = -start[2]
    start[2] -= 1e-9
    n = max(round(cycles * 2 * math.pi / omega / step), 12)
    motion = cosimulate(fmu, FREE, lambda _t, _m: (float(held[0]), float(held[1])), step=step, duration=n * step,
                        start=start[:4], scheme=scheme)
    twist = motion["crank.phi"] / joint.ratio - motion["output.phi"] - rest
    amplitude = np.hypot(twist, (motion["crank.w"] / joint.ratio - motion["output.w"]) / omega)
    middle, quarter = n // 2, max(n // 4, 1)
    early, late = amplitude[middle - quarter:middle].max(), amplitude[-quarter:].max()
    return math.log(late / early) / ((n + 1 - middle) * step), growth_rate(step, stiffness, inertia, scheme=scheme)


@pytest.mark.parametrize(("step", "cycles"), [(1e-5, 8), (5e-5, 8), (2e-4, 6)])
def test_parallel_grows_as_derived(plain_fmu: Path, plain: JointModel, step: float, cycles: float) -> None:
    simulated, derived = free_growth(plain_fmu, plain, "parallel", step, cycles)
    assert derived > 5
    assert simulated == pytest.approx(derived, rel=0.05)


@pytest.mark.parametrize(("scheme", "step"), [("sequential", 1e-4), ("sequential", 1e-3), ("extrapolated", 1e-4),
                                              ("extrapolated", 1e-3), ("extrapolated", 5e-3)])
def test_better_schemes_do_not_grow(plain_fmu: Path, plain: JointModel, scheme: Scheme, step: float) -> None:
    simulated, derived = free_growth(plain_fmu, plain, scheme, step, 20)
    assert derived == 0
    assert abs(simulated) < 2


def test_large_swings(plain_fmu: Path, plain: JointModel) -> None:
    """Through the soft zone: `parallel` gains energy, `sequential` keeps it, `extrapolated` loses some."""
    start, _ = plain.equilibrium(-150.0)

    def swing(scheme: Scheme) -> float:
        motion = cosimulate(plain_fmu, FREE, lambda _t, _m: (0.0, 0.0), step=1e-4, duration=0.02, start=start[:4],
                            scheme=scheme)
        twist = motion["crank.phi"] / plain.ratio - motion["output.phi"]
        return float(np.abs(twist[-80:]).max() / abs(twist[0]))

    assert swing("parallel") > 2
    assert swing("sequential") == pytest.approx(1, abs=0.01)
    assert 0.9 < swing("extrapolated") < 1


@pytest.mark.parametrize("stiffness", [2.5e4, 1.3e5])
def test_largest_step_keeps_its_bound(stiffness: float) -> None:
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


# -- the FMU as a block ------------------------------------------------------------------------------------


def test_block_is_a_pure_function(lossy_fmu: Path) -> None:
    """Repeated, branched and restarted calls give what a fresh FMU gives; outputs lag one sample."""
    with fmu_block(lossy_fmu, 1e-3) as block:
        assert block.dt == 1e-3
        zero = np.zeros(1)
        load, unload = np.array([0.0, 0, -1e-3, 0, 20]), np.array([0.0, 0, -2e-4, 0, 20])
        one = block.dynamics(0, zero, load)
        assert abs(block.output(0, zero, load)[0]) < 1e-9, "the torque of an input is seen a sample later"
        torque = block.output(0, one, load)[0]
        down = block.dynamics(0, one, unload)
        straight = block.dynamics(0, zero, unload)
        assert (block.dynamics(0, one, unload) == down).all()
        assert (block.dynamics(0, zero, load) == one).all()
        hysteresis = block.output(0, straight, unload)[0] - block.output(0, down, unload)[0]
        assert hysteresis > 0.5, "the same angles reached from below and from above"
        assert block.output(0, block.dynamics(0, down, load), load)[0] == pytest.approx(torque, rel=0.05)
    with fmu_block(lossy_fmu, 1e-3) as fresh:
        assert fresh.output(0, fresh.dynamics(0, zero, unload), zero)[0] == block.output(0, straight, zero)[0]


def test_block_refuses_states_it_has_not_been_in(lossy_fmu: Path) -> None:
    u = np.array([0.0, 0, 0, 0, 20])
    with fmu_block(lossy_fmu, 1e-3, remember=3) as block:
        with pytest.raises(InputError, match="drive: expected the state 0 or one that the block returned"):
            ct.linearize(block, np.zeros(1), u)
        x = first = block.dynamics(0, np.zeros(1), u)
        for k in range(3):
            x = block.dynamics(0, x, u + k * 1e-5)
        with pytest.raises(InputError, match="last 3 steps, got 1"):
            block.output(0, first, u)
        assert block.dynamics(0, np.zeros(1), u)[0] == 5, "a forgotten follower is computed again"
    with pytest.raises(InputError, match="closed"):
        block.dynamics(0, x, u)


def test_bad_input(lossy_fmu: Path, tmp_path: Path) -> None:
    foreign = tmp_path / "foreign.fmu"
    foreign.write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"foreign\.fmu"):
        fmu_block(foreign, 1e-3)
    with pytest.raises(UnknownNameError, match="did you mean 'band'"):
        fmu_block(lossy_fmu, 1e-3, parameters={"bnad": 1.0})
    with pytest.raises(UnknownNameError, match=r"crank\.phi"):
        fmu_block(lossy_fmu, 1e-3, initial={"crank_phi": 1.0})
    with pytest.raises(InputError, match="positive sampling time"):
        fmu_block(lossy_fmu, 0.0)
    with pytest.raises(UnknownNameError, match="did you mean 'parallel'"):
        cosimulate(lossy_fmu, MASSES, lambda _t, _m: (0, 0), step=1e-3, duration=1e-2, scheme="paralel")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="scheme"):
        masses_block(MASSES, 1e-3, -29, scheme="sequential")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="without bounds"):
        cosimulate(lossy_fmu, MASSES, lambda _t, m: (1e3 * m[0] + 1e-3, 0.0), step=1e-3, duration=1.0)
