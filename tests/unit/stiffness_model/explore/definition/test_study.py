"""Reading a study, and one line for every fault."""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.explore.definition.design import Packing, design_drive, require_plain_model
from stiffness_model.explore.definition.study_toml import load_study, studies, study_from_dict
from stiffness_model.explore.evaluation.evaluate import Outcome, drive_at, evaluate, values_at
from stiffness_model.geometry import ball_path as geometry
from stiffness_model.geometry.ball_path import max_elements_on_circle
from stiffness_model.io.drawing_toml import read_table
from tests.small_study import study, tables


@pytest.mark.parametrize("name", studies())
def test_studies_of_the_package_are_read_and_make_drives(name: str) -> None:
    read = load_study(name)
    assert read.name == name
    middle = np.full(len(read.parameters), 0.5)
    drive = drive_at(read, middle)
    assert drive.elements_per_row >= 1
    assert set(values_at(read, middle)) == {p.name for p in read.parameters} | set(read.fixed)


def test_a_design_is_the_base_drawing_with_its_values() -> None:
    read = study()
    drive = drive_at(read, np.array([0.99, 0.5, 0.0]))
    assert drive.tolerances["gear"].text == "IT8"
    assert drive.tolerances["gear"].offset == pytest.approx(2.5e-6)
    # A base drive that reverses stays one: 24 lobes are a ratio of -23.
    assert (drive.lobes, drive.ratio, drive.eccentrics) == (24, -23, 3)
    assert drive.elements_per_row == max_elements_on_circle(drive.path.centre_distance, drive.element_radius) == 21
    base = sm.load_drive("drive_1")
    assert drive.materials == base.materials
    assert drive.crank_radius == base.crank_radius


def test_steps_are_sizes_as_a_drawing_writes_them() -> None:
    table = tables()
    table["parameters"] = {
        "crank_radius": {"from": "38 mm", "to": "39 mm", "step": "0.1 mm"},
        "cage_offset": {"from": "0 sigma", "to": "3 sigma"},
    }
    radius, offset = study_from_dict(table).parameters
    assert [radius.at(x) for x in (0.0, 0.31, 1.0)] == [38e-3, 38.3e-3, 39e-3]
    assert offset.at(0.5) == "1.5 sigma"
    drive = drive_at(study_from_dict(table), np.array([0.31, 0.5]))
    assert drive.tolerances["cage"].offset == pytest.approx(1.5 * drive.tolerances["cage"].sigma)


def test_packed_balls_leave_the_web_between_them() -> None:
    table, _ = read_table("drive_1")
    for radius, web in ((7e-3, 0.0), (4e-3, 0.0), (4e-3, 1e-3), (2e-3, 0.5e-3)):
        for rule in ("beside", "seats"):
            packing = Packing(rule, web)
            drive = design_drive(table, {"element_radius": radius, "elements_per_row": "fill"}, packing, "")
            count, seats, around = drive.elements_per_row, 29, drive.path.centre_distance
            step = 2 * np.pi / count if rule == "beside" else 2 * np.pi / seats * (seats // count)
            assert 2 * around * np.sin(step / 2) >= 2 * radius + web - 1e-12
            assert count <= seats
            assert packing.fits(drive)
            # One more would not have fitted.
            more = 2 * np.pi / (count + 1) if rule == "beside" else 2 * np.pi / seats * (seats // count - 1)
            assert count == seats or 2 * around * np.sin(more / 2) < 2 * radius + web


def test_designs_that_cannot_be_built_are_classified_and_not_simulated() -> None:
    table = tables()
    table["parameters"] = {
        "element_radius": {"from": "2 mm", "to": "60 mm"},
        "eccentricity": {"from": "0.3 mm", "to": "3 mm"},
    }
    table["fixed"] = {"elements_per_row": 21}
    table["constraints"] = {"packs": True, "undercut": {"max": 0.5}}
    read = study_from_dict(table)
    element = [(x - 2e-3) / 58e-3 for x in (4e-3, 4e-3, 9e-3, 55e-3)]
    found = evaluate(read, np.array([[element[0], 0.2], [element[1], 1.0], [element[2], 0.1], [element[3], 0.1]]))
    assert [Outcome(k) for k in found.outcome] == [
        Outcome.SIMULATED,
        Outcome.OUT_OF_LIMITS,
        Outcome.DOES_NOT_PACK,
        Outcome.NO_DRIVE,
    ]
    assert np.isfinite(found.metrics[0]).all()
    assert found.column("undercut")[1] > 0.5
    assert np.isnan(found.column("stiffness")[1:]).all()


@pytest.mark.parametrize("lobes", [30, 36])
def test_undercut_and_diameter_agree_with_points_of_the_profile(lobes: int) -> None:
    """Points of the equidistant nearer to the path than the element's radius are cut away, and twice the greatest
    distance from the axis is the diameter."""
    table = tables()
    table["parameters"] = {"eccentricity": {"from": "0.3 mm", "to": "0.8 mm"}}
    table["fixed"] = {"lobes": lobes, "elements_per_row": "fill", "element_radius": "6 mm"}
    read = study_from_dict(table)
    found = evaluate(read, np.array([[0.2], [0.9]]))
    for k, eccentricity in enumerate((0.4e-3, 0.75e-3)):
        path = geometry.BallPath(47e-3, eccentricity, lobes)
        beta = np.linspace(-np.pi, np.pi, 2001)
        # One period of the profile in the gear's frame; the path extends by half a period on either side.
        wide = np.linspace(-2 * np.pi, 2 * np.pi, 8001)
        centres = path.radius(wide) * np.exp(1j * wide / lobes)
        n_r, n_t = path.normal(beta)
        points = (path.radius(beta) + 6e-3 * (n_r + 1j * n_t)) * np.exp(1j * beta / lobes)
        nearest = np.abs(points[:, None] - centres).min(axis=1)
        cut = nearest < 6e-3 - 1e-8
        assert found.column("undercut")[k] == pytest.approx(cut.mean(), abs=2e-3)
        assert cut.any() or k == 0
        assert found.column("diameter")[k] == pytest.approx(2 * np.abs(points[~cut]).max(), rel=1e-6)


def test_the_identity_depends_on_what_the_results_depend_on() -> None:
    same = tables()
    same["name"], same["description"], same["choose"] = "other", "words", {"rule": "best", "objective": "stiffness"}
    assert study_from_dict(same).identity == study().identity
    for change in (
        {"base": "drive_2"},
        {"objectives": {"twist": "min", "scatter": "min"}},
        {"constraints": {}},
        {"fixed": {}},
        {"parameters": {"lobes": {"from": 24, "to": 34}}},
    ):
        assert study_from_dict({**tables(), **change}).identity != study().identity
    assert study(seed=4).identity != study().identity


def test_a_study_reads_the_drawing_beside_it_with_its_materials(tmp_path: Path) -> None:
    text = (Path(sm.__file__).parent / "presets" / "drive_1.toml").read_text("utf-8")
    (tmp_path / "mine.toml").write_text(
        text + '\n[material.brass]\nyoungs_modulus = "100 GPa"\npoisson_ratio = 0.35\n', "utf-8"
    )
    import tomli_w

    table = {**tables(), "base": "mine.toml", "parameters": {"cage_material": {"choices": ["100Cr6", "brass", "PLA"]}}}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(table), "utf-8")
    read = load_study(tmp_path / "study.toml")
    assert drive_at(read, np.array([0.5])).materials["cage"].youngs_modulus == 100e9


FAULTS: list[tuple[str, Any, str]] = [
    ("parametres", {}, "unknown section or field 'parametres'; did you mean 'parameters'?"),
    ("base", "drive_9", "unknown drive 'drive_9'; did you mean"),
    ("base", 7, "base: expected a text, got 7"),
    ("parameters", {}, "expected at least one parameter"),
    ("parameters.crank_radios", {"from": "1 mm", "to": "2 mm"}, "did you mean 'crank_radius'"),
    ("parameters.transmission_ratio", {"from": 20, "to": 30}, "unknown parameter 'transmission_ratio'"),
    ("parameters.crank_radius", {"from": 38, "to": "44 mm"}, "crank_radius: from: expected a length with its unit"),
    ("parameters.crank_radius", {"from": "44 mm", "to": "38 mm"}, "expected from below to, got '44 mm to 38 mm'"),
    ("parameters.crank_radius", {"from": "38 mm"}, "expected the key 'to'"),
    ("parameters.crank_radius", {"form": "38 mm", "to": "44 mm"}, "unknown key 'form'; did you mean 'from'"),
    ("parameters.crank_radius", {"from": "38 mm", "to": "44 mm", "step": "9 mm"}, "a step above zero and within"),
    ("parameters.crank_radius", {"from": "38 mm", "to": "44 kN"}, "unknown unit of length 'kN'"),
    ("parameters.crank_radius", "40 mm", "expected a table such as"),
    ("parameters.lobes", {"from": 24.5, "to": 30}, "expected a whole number of at least 1, got 24.5"),
    ("parameters.gear_tolerance", {"from": "IT8", "to": "IT5"}, "from the finer grade to the coarser"),
    ("parameters.gear_tolerance", {"choices": ["IT5", "IT99"]}, "IT99"),
    ("parameters.cage_material", {"choices": ["100Cr6", "PLB"]}, "unknown material 'PLB'"),
    ("parameters.cage_material", {"from": "100Cr6", "to": "PLA"}, "expected choices: names have no range"),
    ("parameters.element", {"choices": ["ball", "cube"]}, "unknown choice 'cube'; expected one of ball, roller"),
    ("parameters.lobes", {"choices": []}, "expected a list of choices, got []"),
    ("parameters.lobes", {"choices": [30, 30]}, "expected choices that differ"),
    ("fixed.lobes", 30, "expected a field that is not varied"),
    ("fixed.crank_radios", "4 mm", "did you mean 'crank_radius'"),
    ("constraints.presure", {"max": "4 GPa"}, "unknown constraint 'presure'; did you mean 'pressure'"),
    ("constraints.pressure", {"max": 4e9}, "expected a text with a unit, such as '1 GPa', got 4000000000.0"),
    ("constraints.pressure", {"max": "4 um"}, "unknown unit of pressure 'um'"),
    ("constraints.pressure", "4 GPa", "expected a table such as { max = ... }"),
    ("constraints.undercut", {"max": "half"}, "expected a finite number, got 'half'"),
    ("constraints.undercut", {"min": 0.5, "max": 0.4}, "expected min below max"),
    ("constraints.packs", "yes", "expected true, false or 'beside' or 'seats', got 'yes'"),
    ("constraints", {"web": "1 mm"}, "packs = true"),
    ("objectives", {"stiffness": "max"}, "expected at least two objectives"),
    ("objectives.stiffness", "more", "stiffness: expected 'max' or 'min', got 'more'"),
    ("objectives.stifness", "max", "unknown objective 'stifness'; did you mean 'stiffness'?"),
    ("numbers", {}, "expected the field 'torque'"),
    ("numbers.torque", 120, "expected a torque with its unit, such as '200 N.m', got 120"),
    ("numbers.torque", "-3 N.m", "expected a positive torque"),
    ("numbers.drives", 0, "expected a whole number from 1 to 100000, got 0"),
    ("numbers.designs", 10, "expected a population of at most the 10 designs"),
    ("numbers.desings", 10, "did you mean 'designs'"),
    ("choose.rule", "nee", "expected the rule 'knee' or 'best', got 'nee'"),
    ("choose", {"rule": "best"}, "expected one of the objectives lost_motion"),
    ("choose", {"rule": "best", "objective": "stiffness", "limits": {"los_motion": {"max": 1}}}, "did you mean"),
    ("numbers.seed", True, "expected a whole number"),
]


@pytest.mark.parametrize(("where", "value", "said"), FAULTS, ids=[f"{w}-{k}" for k, (w, _, _) in enumerate(FAULTS)])
def test_every_fault_is_reported_in_one_line(where: str, value: Any, said: str) -> None:
    table = copy.deepcopy(tables())
    *path, last = where.split(".")
    inner = table
    for name in path:
        inner = inner.setdefault(name, {})
    inner[last] = value
    with pytest.raises(sm.InputError) as raised:
        study_from_dict(table, "mine.toml")
    text = str(raised.value)
    assert said in text
    assert "\n" not in text
    if "drive_9" not in text:
        assert text.startswith("mine.toml")


def test_unreadable_studies_are_refused(tmp_path: Path) -> None:
    for name, text, said in (("a.toml", "name = ", "syntax error"), ("b.toml", "\udcff", "readable")):
        (tmp_path / name).write_bytes(text.encode("utf-8", "surrogateescape"))
        with pytest.raises(sm.InputError, match=said):
            load_study(tmp_path / name)
    with pytest.raises(sm.InputError, match="no such file"):
        load_study(tmp_path / "c.toml")
    with pytest.raises(sm.InputError, match="did you mean 'tolerance_field'"):
        load_study("tolerance_fields")


def test_options_that_a_study_does_not_take_into_account_are_refused() -> None:
    @dataclass(frozen=True)
    class Wider(sm.Drive):
        bearing_stiffness: float = 0.0

    plain = sm.load_drive("drive_1")
    known = {f.name: getattr(plain, f.name) for f in fields(plain)}
    require_plain_model(plain, "mine.toml")
    require_plain_model(Wider(**known), "mine.toml")
    with pytest.raises(sm.InputError, match="bearing_stiffness = 250000000"):
        require_plain_model(Wider(**known, bearing_stiffness=250e6), "mine.toml")
