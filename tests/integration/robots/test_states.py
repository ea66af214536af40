"""The states of the effects are part of the simulator's state: resets, copies, rollbacks, rollouts, threads."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stiffness_model.numerics.arrays import Array
from tests.integration.robots.joint_models import joint_text

pytestmark = pytest.mark.slow
STEPS = 300


@pytest.fixture(scope="module")
def model(mujoco: Any, lossy: Path) -> Any:
    return mujoco.MjModel.from_xml_string(joint_text(lossy))


def controls(seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(-1, 1, (STEPS, 1))


def states(mujoco: Any, model: Any, data: Any, commands: Array) -> Array:
    """Full physical states, (n, n_states), after each step."""
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    rows = np.empty((len(commands), size))
    for row, command in zip(rows, commands, strict=True):
        data.ctrl[:] = command
        mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, row, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return rows


def test_a_reset_begins_anew(mujoco: Any, model: Any) -> None:
    data = mujoco.MjData(model)
    first = states(mujoco, model, data, controls())
    assert np.abs(data.plugin_state[2:]).max() > 0.1
    mujoco.mj_resetData(model, data)
    assert (data.plugin_state == 0).all()
    assert (states(mujoco, model, data, controls()) == first).all()


def test_angles_may_be_set_until_the_first_step(mujoco: Any, model: Any) -> None:
    """The path of friction begins where the first step does, not where the reset was or a picture was drawn."""
    moved, forwarded = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_forward(model, forwarded)
    for data in (moved, forwarded):
        data.qpos[0] = 0.7
    assert (states(mujoco, model, moved, controls()) == states(mujoco, model, forwarded, controls())).all()
    started = mujoco.MjData(model)
    started.qpos[0] = 0.7
    states(mujoco, model, started, 0.01 * controls()[:1])
    assert np.abs(started.plugin_state[-2:]).max() < 0.01  # of the friction inside and at the output, 1 when it slides


def test_rollback_and_copy_continue_in_the_same_way(mujoco: Any, model: Any) -> None:
    commands, full = controls(), mujoco.mjtState.mjSTATE_FULLPHYSICS
    data = mujoco.MjData(model)
    states(mujoco, model, data, commands[:100])
    saved = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, data, saved, full)
    copied = mujoco.MjData(model)
    mujoco.mj_copyData(copied, model, data)
    expected = states(mujoco, model, data, commands[100:])
    mujoco.mj_setState(model, data, saved, full)
    assert (states(mujoco, model, data, commands[100:]) == expected).all()
    assert (states(mujoco, model, copied, commands[100:]) == expected).all()


def test_parallel_rollouts_are_those_in_series(mujoco: Any, model: Any) -> None:
    from mujoco import rollout

    full, count = mujoco.mjtState.mjSTATE_FULLPHYSICS, 16
    commands = np.stack([controls(k) for k in range(count)])
    start = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, mujoco.MjData(model), start, full)
    parallel, _ = rollout.rollout(
        model, [mujoco.MjData(model) for _ in range(4)], np.tile(start, (count, 1)), commands, nstep=STEPS
    )
    series = np.stack([states(mujoco, model, mujoco.MjData(model), c) for c in commands])
    assert (parallel == series).all()
    assert len(np.unique(parallel[:, -1, 2])) == count


def test_threads_do_not_disturb_each_other(mujoco: Any, model: Any) -> None:
    expected = [states(mujoco, model, mujoco.MjData(model), controls(k)) for k in range(4)]
    came: list[Array | None] = [None] * 4

    def work(k: int) -> None:
        came[k] = states(mujoco, model, mujoco.MjData(model), controls(k))

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((c == e).all() for c, e in zip(came, expected, strict=True))


def test_two_drives_in_one_model_are_those_in_two(mujoco: Any, plain: Path, lossy: Path) -> None:
    """Both libraries are loaded: each keeps its own functions and tables, and exports no symbol."""
    import ctypes

    together = mujoco.MjSpec()
    together.option.timestep, together.option.gravity = 2e-3, np.zeros(3)
    for folder, prefix in ((plain, "a/"), (lossy, "b/")):
        part = mujoco.MjSpec.from_string(joint_text(folder))
        together.attach(part, prefix=prefix, frame=together.worldbody.add_frame())
    both = together.compile()
    data, commands = mujoco.MjData(both), controls()
    joint = states(mujoco, both, data, np.hstack([commands, commands]))
    for k, folder in enumerate((plain, lossy)):
        alone = mujoco.MjModel.from_xml_string(joint_text(folder))
        expected = states(mujoco, alone, mujoco.MjData(alone), commands)
        assert joint[:, 1 + 2 * k : 3 + 2 * k] == pytest.approx(expected[:, 1:3], rel=1e-9, abs=1e-15)
        library = ctypes.CDLL(str(next(f for f in folder.iterdir() if f.suffix in (".so", ".dylib"))))
        assert not any(hasattr(library, name) for name in ("plugin_init", "contact_point", "output", "fmi2DoStep"))
    assert np.abs(joint[-1, 1] - joint[-1, 3]) > 1e-3
