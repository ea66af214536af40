"""RIG.toml: every key is read with its unit, and slips are refused in one line."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from reefmu.planning import load_rig, rig_of_record
from reefmu.planning.protocols.rig import KEYS, Rig, rig_from_dict
from stiffness_model.errors import InputError, UnknownNameError
from stiffness_model.units import ARCMIN
from tests.diagnosis_rig import drive, protocol

TEXT = """
name = "bench 3"
minutes = 12
[motion]
crank = "angles"
torque = "0.12 kN.m"
speed = "600 rpm"
shortest_loop = "500 ms"
[temperature]
lowest = "15 degC"
highest = "45 degC"
rate = "1 K/min"
[sampling]
rate = "1 kHz"
[torque_sensor]
noise = "0.4 N.m"
correlation_time = "5 ms"
[output_encoder]
resolution = "0.01 arcmin"
[crank_encoder]
measured = false
"""


def test_values_are_read_with_their_units(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text(TEXT, "utf-8")
    rig = load_rig(file)
    assert (rig.name, rig.minutes, rig.crank, rig.torque, rig.torque_noise) == ("bench 3", 12.0, "angles", 120.0, 0.4)
    assert rig.speed == pytest.approx(20 * np.pi)
    assert rig.heating_rate == pytest.approx(1 / 60)
    assert rig.output_resolution == pytest.approx(0.01 * ARCMIN)
    assert (rig.shortest_loop, rig.sample_rate, rig.correlation_time) == (0.5, 1000.0, 0.005)
    assert rig.missing == ("crank_angle",)
    assert not rig.can_turn
    assert rig.can_heat


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"motoin": {}}, "did you mean 'motion'"),
        ({"motion": {"torqe": "1 N.m"}}, "did you mean 'torque'"),
        ({"torque_sensor": {"noize": "1 N.m"}}, "did you mean 'noise'"),
    ],
)
def test_unknown_keys_are_refused(table: dict[str, object], message: str) -> None:
    with pytest.raises(UnknownNameError, match=message):
        rig_from_dict(table)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"motion": {"torque": 120}}, "a text with a unit, such as '200 N.m'"),
        ({"motion": {"torque": "120 s"}}, "unit of torque"),
        ({"motion": {"torque": "-3 N.m"}}, "a torque of"),
        ({"motion": {"crank": "free"}}, "'turns' or 'angles' or 'locked'"),
        ({"motion": "fast"}, r"a table \[motion\]"),
        ({"minutes": float("nan")}, "a number of minutes"),
        ({"temperature": {"measured": "no"}}, "true or false"),
        ({"temperature": {"lowest": "60 degC", "highest": "20 degC"}}, "lowest at most highest"),
    ],
)
def test_wrong_values_are_refused_in_one_line(table: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        rig_from_dict(table)
    assert "\n" not in str(caught.value)


def test_a_rig_without_sizes_takes_them_from_the_drive() -> None:
    rig = Rig().for_drive(200.0)
    assert (rig.torque, rig.torque_noise) == (200.0, pytest.approx(0.6))
    assert Rig(torque=50.0).for_drive(200.0).torque == 50.0


def test_the_rig_of_a_record_moves_as_the_record_does() -> None:
    full = rig_of_record(protocol(), drive().ratio, 0.6, 1e-6)
    assert full.can_turn
    assert full.highest == 45.0
    assert full.speed == pytest.approx(6.0, rel=0.2)
    single = rig_of_record(protocol(full=False), drive().ratio, 0.6, 1e-6)
    assert (single.crank, single.can_heat) == ("locked", False)


def test_the_example_of_the_documentation_is_a_rig() -> None:
    text = (Path(__file__).parents[3] / "docs/reference/plan.md").read_text("utf-8")
    block = re.search(r"^```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert block is not None
    table = tomllib.loads(block[1])
    rig = rig_from_dict(table)
    assert (rig.name, rig.torque, rig.missing) == ("bench 3", 200.0, ())
    # It shows every key, so that a reader needs no other list.
    assert {key: set(keys) for key, keys in KEYS.items()} == {k: set(v) for k, v in table.items() if k in KEYS}
