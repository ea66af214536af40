"""The FMU as a block of python-control, and invalid calls of loop and block."""

from __future__ import annotations

from pathlib import Path

import control as ct
import numpy as np
import pytest

from reefmu.joint import cosimulate, fmu_block, masses_block
from stiffness_model.errors import InputError, UnknownNameError
from tests.integration.cosimulation.joints import MASSES

pytestmark = pytest.mark.slow


def test_block_is_a_pure_function(lossy_fmu: Path) -> None:
    """Repeated, branched and restarted calls give the results of a new FMU; outputs lag by one sample."""
    with fmu_block(lossy_fmu, 1e-3) as block:
        assert block.dt == 1e-3
        zero = np.zeros(1)
        load, unload = np.array([0.0, 0, -1e-3, 0, 20]), np.array([0.0, 0, -2e-4, 0, 20])
        one = block.dynamics(0, zero, load)
        assert abs(block.output(0, zero, load)[0]) < 1e-9, "the torque follows an input one sample later"
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


def test_block_refuses_states_that_it_has_not_returned(lossy_fmu: Path) -> None:
    u = np.array([0.0, 0, 0, 0, 20])
    with fmu_block(lossy_fmu, 1e-3, snapshots=3) as block:
        with pytest.raises(InputError, match="drive: expected the state 0 or one that the block returned"):
            ct.linearize(block, np.zeros(1), u)
        x = first = block.dynamics(0, np.zeros(1), u)
        for k in range(3):
            x = block.dynamics(0, x, u + k * 1e-5)
        with pytest.raises(InputError, match="last 3 steps, got 1"):
            block.output(0, first, u)
        assert block.dynamics(0, np.zeros(1), u)[0] == 5, "a discarded successor is computed again"
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
