"""Exports as files and commands, and the drive in a model of one's own."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.codegen import compile as platforms
from reefmu.model.drive_model import DriveModel
from reefmu.robots import add_drive, export_mujoco, load_plugin, mujoco_library, settle
from stiffness_model.errors import InputError, UnknownNameError

slow = pytest.mark.slow
ARM = """<mujoco><option timestep="0.002"/><worldbody>
<body><joint name="shoulder" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 .4 0 0"/>
<body pos=".4 0 0"><joint name="elbow" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 .3 0 0"/>
</body></body></worldbody></mujoco>"""


@slow
def test_a_robot_at_rest_stays_at_rest(mujoco: Any, lossy: Path) -> None:
    """`settle` finds the twists under the weight; the motors' torques that it returns hold them."""
    spec = mujoco.MjSpec.from_string(ARM)
    for joint in ("shoulder", "elbow"):
        add_drive(spec, joint, lossy, motor_inertia=1e-4, settings={"hysteresis.torque": 0.0})
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[[0, 2]] = 0.3, -0.4
    torques = settle(model, data)
    rest = data.qpos.copy()
    assert (np.abs(rest[[1, 3]]) > 1e-6).all()
    rigid = mujoco.MjModel.from_xml_string(ARM)
    weight = mujoco.MjData(rigid)
    weight.qpos[:] = 0.3, -0.4
    mujoco.mj_forward(rigid, weight)
    assert torques == pytest.approx(weight.qfrc_bias, rel=1e-3)
    data.qfrc_applied[[0, 2]] = torques
    mujoco.mj_step(model, data, 500)
    assert data.qpos == pytest.approx(rest, abs=1e-7)


@slow
def test_one_arm_is_attached_twice(mujoco: Any, lossy: Path) -> None:
    """The drive finds its joints by its body, so that prefixes of names do not matter."""
    spec = mujoco.MjSpec.from_string(ARM)
    add_drive(spec, "shoulder", lossy, motor_inertia=1e-4, settings={"hysteresis.torque": 2.0})
    both = mujoco.MjSpec()
    for k, side in enumerate(("left/", "right/")):
        frame = both.worldbody.add_frame(pos=[0, 2 * k, 0])
        both.attach(mujoco.MjSpec.from_string(spec.to_xml()), prefix=side, frame=frame)
    model = both.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    left, right = np.split(data.qpos, 2)
    assert left == pytest.approx(right, rel=1e-9)
    assert np.abs(left[1]) > 1e-6
    assert model.nplugin == 2


@slow
def test_joints_and_attributes_are_checked(mujoco: Any, lossy: Path) -> None:
    def added(joint: str = "elbow", **settings: float) -> None:
        add_drive(mujoco.MjSpec.from_string(ARM), joint, lossy, motor_inertia=1e-4, settings=settings)

    with pytest.raises(UnknownNameError, match="did you mean 'elbow'"):
        added("elbo")
    with pytest.raises(UnknownNameError, match=r"did you mean 'hysteresis\.torque'"):
        added(**{"hysteresis.torqe": 1.0})
    with pytest.raises(InputError, match="expected a folder of `reefmu export --to mujoco`"):
        load_plugin(lossy.parent)
    spec = mujoco.MjSpec.from_string(ARM)
    add_drive(spec, "elbow", lossy, motor_inertia=1e-4, settings={"hysteresis.torque": -1.0})
    with pytest.raises(
        ValueError, match=r"hysteresis\.torque: expected a number from 0 to 10000 in SI units, got '-1.0'"
    ):
        spec.compile()
    text = (
        (lossy / "joint.xml").read_text("utf-8").replace('name="joint_twist" type="hinge" axis="0 0 1"', 'axis="1 0 0"')
    )
    with pytest.raises(ValueError, match="in body load: expected two hinges on one axis as its last joints"):
        mujoco.MjModel.from_xml_string(text)


@slow
def test_an_export_replaces_an_earlier_one_and_nothing_else(
    mujoco: Any, plain: Path, plain_model: DriveModel, tmp_path: Path
) -> None:
    described = json.loads((plain / "drive.json").read_text("utf-8"))
    assert described["plugin"] == "reefmu.plain"
    assert described["mujoco"] == mujoco.__version__
    assert {"drive.json", "joint.xml", "model.toml", "sources", described["library"]} == {
        f.name for f in plain.iterdir()
    }
    target = tmp_path / "gear"
    for _ in range(2):
        assert export_mujoco(plain_model, target) == target
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "notes.txt").write_text("mine", "utf-8")
    with pytest.raises(InputError, match=r"expected a new folder, an empty one or one with drive\.json"):
        export_mujoco(plain_model, tmp_path / "own")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["gear", "own"]


@slow
def test_the_command_exports_a_drawing_with_effects(
    mujoco: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "elbow"
    words = ["export", "CHA-40A-50", "--to", "mujoco", "-o", str(folder), "--effect", "damping.coefficient=3 N.m.s/rad"]
    assert main([*words, "--step", "0.001", "--motor-inertia", "2e-4"]) == 0
    assert "plugin reefmu.elbow for MuJoCo" in capsys.readouterr().out
    load_plugin(folder)
    model = mujoco.MjModel.from_xml_path(str(folder / "joint.xml"))
    assert model.opt.timestep == 1e-3
    assert model.dof_armature[0] == pytest.approx(2e-4 * 50**2)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--fmi", "3"], "--fmi: expected --to mujoco without --fmi, which is for FMUs, got '3'"),
        (["--load", "5"], "--load: expected --to mujoco without --load, which is for FMUs, got 5.0"),
        (["--kind", "joint"], "--kind: expected --to mujoco without --kind, which is for FMUs, got 'joint'"),
        (["-o", "gear.fmu"], "--output: expected a folder for the plugin, got 'gear.fmu'"),
        (["-o", "..."], "plugin: expected a folder whose name has letters or digits"),
    ],
)
def test_options_of_fmus_are_refused(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "drive_1", "--to", "mujoco", "-o", "gear", *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="foreign host: no plugin can be linked with MuJoCo's wheel here")
def test_without_mujoco_or_a_compiler_one_line_has_the_remedy(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", "drive_1", "--to", "mujoco", "-o", str(tmp_path / "gear")]
    monkeypatch.setattr(mujoco_library.importlib.util, "find_spec", lambda name: None)
    assert main(words) == 2
    remedy = "pip install '.[mujoco]' in a clone of reefmu"
    assert capsys.readouterr().err == f"reefmu: mujoco: expected the package ({remedy}), got none\n"
    monkeypatch.undo()
    pytest.importorskip("mujoco", reason="foreign host mujoco")
    monkeypatch.setattr(platforms, "_program", lambda p: ())
    assert main(words) == 2
    assert (
        "expected a C compiler (pip install '.[native]' in a clone of reefmu brings one), got"
        in capsys.readouterr().err
    )
    assert not (tmp_path / "gear").exists()
