"""Diagnosis of a cycloidal drive from its drawing: the base curve, and a simulated record with a known effect."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.diagnosis import Priors, diagnose_record
from reefmu.diagnosis.forward.base_curve import table_base
from reefmu.diagnosis.report.text import cautions
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.record import make_record, read_column_map, read_record
from reefmu.simulate import simulate_record
from stiffness_model.lookup.build_lookup import Lookup
from tests.diagnosis_rig import noise_of

DRIVE = sm.load_drive("printed_cycloidal")
ROOT = Path(__file__).parents[3]
RECORDS = ROOT.parent / "shared/data/cycloidal"


def lookup() -> Lookup:
    found = cached_lookup(DRIVE)
    assert isinstance(found, Lookup)
    return found


@pytest.mark.slow
def test_base_curve_is_the_mean_of_the_drawing_with_an_uncertain_scale() -> None:
    base = table_base(DRIVE, lookup())
    assert base.ratio == -13
    # A clearance frees its ratio to e z of twist.
    assert base.lever == pytest.approx(13 * 1.5e-3)
    twist = np.linspace(-1, 1, 17) * DRIVE.max_twist
    full = lookup().full_torque
    for scale in (0.0, 0.5):
        torque = base.elastic.evaluate(twist, 0.0, np.array([scale]))[0]
        np.testing.assert_allclose(torque, (1 + scale) * lookup().torque(twist), atol=2e-3 * full)
    # The band of the drawing, mostly that of its stiffness, is the prior of the scale.
    assert float(base.shape.prior_deviation[0]) == pytest.approx(0.5, rel=0.3)
    assert base.shape.low[0] == -0.9


@pytest.mark.slow
def test_a_hysteresis_is_named_in_the_record_of_a_softer_gear() -> None:
    model = build_model(DRIVE, {"hysteresis": {"torque": 1.5}})
    time = np.arange(4000) * 0.02
    # Between twists that the gear was drawn for; the output is locked, and the crank turns.
    twist = 0.9 * DRIVE.max_twist * np.sin(2 * np.pi * time / 20)
    angles = {"time": time, "crank_angle": DRIVE.ratio * twist, "output_angle": 0 * time}
    torque = simulate_record(model, make_record({**angles, "output_torque": 0 * time}))["measured.tau"]
    # A gear at a lower part of the drawing's band of stiffness has half the mean torque.
    elastic = lookup().torque(twist)
    measured = torque - 0.5 * elastic + noise_of(len(time), 0.1, 0.3, 3)
    found = diagnose_record(make_record({**angles, "output_torque": measured}), drive=DRIVE)
    named = {effect.name: effect for effect in found.effects}
    assert set(named) == {"hysteresis"}, found.verdict
    size = named["hysteresis"].parameters["torque"]
    assert size.value == pytest.approx(1.5, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["base_910/init_pos1", "conic_onyx/preload1_pos6"])
def test_a_corrected_model_is_closer_to_a_measured_record(name: str) -> None:
    """In these two the scatter of the one drive takes up more of the curve beside friction than without it.

    In the first the noise of the angle, fed to the model, moves its friction back and forth, and the report says so.
    """
    path = RECORDS / f"{name}.csv.gz"
    if not path.exists():
        pytest.skip(f"measured records, which are not part of this repository: none in {RECORDS}")
    record = read_record(path, read_column_map(ROOT / "examples/cycloidal_columns.toml"))
    # Printed gears have friction; without this prior the first record leaves open whether anything known is missing.
    friction = Priors(odds={"hysteresis": 10.0, "load_dependent_hysteresis": 10.0})
    found = diagnose_record(record, drive=DRIVE, priors=friction)
    gap = found.gap
    assert found.effects
    assert gap.after < gap.before
    assert gap.held_out_after is not None
    assert gap.held_out_before is not None
    assert gap.held_out_after < gap.held_out_before
    assert gap.raw_after is not None
    assert gap.raw_before is not None
    says_why = any("the noise of the angles moves friction" in line for line in cautions(found))
    assert gap.raw_after < gap.raw_before or says_why
