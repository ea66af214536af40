"""What changed in the friction at the crank, from records with the torques of crank and output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.comparison import DriveState, StateComparison, compare_states
from reefmu.comparison.comparison_page import comparison_html
from reefmu.comparison.torque_loops import torque_loops
from reefmu.diagnosis.report.html.origin import Origin
from reefmu.record import Record
from tests.both_torques import TRUE, both_torques
from tests.friction_record import GEAR

CRANK = ("crank_friction", "load_dependent_crank_friction")


def compared(*records: Record, ratio: float = GEAR.ratio) -> StateComparison:
    return compare_states([DriveState(f"{k}", (record,)) for k, record in enumerate(records)], ratio)


@pytest.fixture(scope="module")
def worn() -> Record:
    """A drive whose friction at the crank is larger, and whose friction inside is that of the others."""
    return both_torques(2, turning=False, friction=TRUE | {"torque": 0.35, "fraction": 0.15})


@pytest.fixture(scope="module")
def new() -> Record:
    return both_torques(1, turning=False)


def test_a_change_of_friction_at_the_crank_is_found_and_told_from_friction_inside(new: Record, worn: Record) -> None:
    stiff = both_torques(3, turning=False, inside=5.0)
    found = compared(new, worn, stiff)
    change = {(c.start, c.end, c.quantity): c for c in found.changes}
    assert change["0", "1", "crank_friction"].difference.value == pytest.approx(0.2, rel=0.05)
    assert change["0", "1", "load_dependent_crank_friction"].difference.value == pytest.approx(0.03, rel=0.1)
    assert change["0", "1", "crank_friction"].direction == "up"
    assert change["0", "1", "friction"].direction == "not decided"
    assert change["0", "2", "friction"].direction == "up"
    assert change["0", "2", "crank_friction"].direction == "not decided"


def test_friction_at_the_crank_is_positive_whatever_the_sense_of_the_crank(new: Record) -> None:
    turned = replace(new, crank_angle=-new.crank_angle, crank_torque=-np.asarray(new.crank_torque))
    for record, ratio in ((new, GEAR.ratio), (turned, -GEAR.ratio)):
        (loop, *_), _ = torque_loops(record, ratio)
        assert loop.crank_width is not None
        assert np.nanmin(loop.crank_width) > 0.9 * TRUE["torque"]


def test_records_that_do_not_show_it_have_no_such_quantity_and_no_note_of_it(new: Record, worn: Record) -> None:
    one_torque = [replace(record, crank_torque=None) for record in (new, worn)]
    crank_stands = [
        replace(record, crank_angle=0 * record.crank_angle, output_angle=-record.twist(GEAR.ratio))
        for record in (new, worn)
    ]
    for records in (one_torque, crank_stands):
        found = compared(*records)
        assert not {*CRANK} & {change.quantity for change in found.changes}
        assert not any("crank_friction" in note for note in found.notes)
    mixed = compared(new, one_torque[1])
    assert any("not in every record" in note and "crank_friction" in note for note in mixed.notes)


def test_the_next_comparison_names_the_drive_whose_ratio_the_records_need(new: Record, worn: Record) -> None:
    found = compared(new, worn)
    assert "--compare --drive CHA-40A-50 --out" in comparison_html(found, Origin("", "CHA-40A-50"))
    assert "--drive" not in comparison_html(found)
    page = comparison_html(found, Origin("", "CHA-40A-50", ("--columns", "map.toml")))
    assert "--drive CHA-40A-50 --columns map.toml --out found" in page
    assert "--compare --drive CHA-40A-50 --columns map.toml --out changed" in page
