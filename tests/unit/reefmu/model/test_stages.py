"""The order of the effects is declared once, and model, predictor and C follow it."""

from __future__ import annotations

import itertools
import re

import casadi as ca
import pytest

from reefmu.diagnosis.forward.record_stages import RecordStages
from reefmu.effects import EFFECTS, Effect, Place
from reefmu.fmu.codegen.functions import make_functions
from reefmu.fmu.codegen.stage_order import stage_order
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.model.drive_model import build_model
from reefmu.model.masses import TYPICAL_MASSES
from reefmu.model.stages.order import (
    COEFFICIENTS,
    CONTACT_EQUILIBRIUM,
    KINEMATICS,
    OUTPUT,
    STAGES,
    TORQUE_CHAIN,
    advance_order,
)
from reefmu.model.stages.scalar import make_scalar_stages
from stiffness_model.lookup.build_lookup import Lookup

CASES = {
    "none": [],
    "wear": ["wear"],
    "creep": ["creep"],
    "drift": ["torque_sensor_drift"],
    "both": ["creep", "hysteresis"],
    "all": list(EFFECTS),
}


def test_every_place_acts_in_a_stage() -> None:
    assert {place for stage in STAGES for place in stage.places} == set(Place)
    assert (Place.CRANK, *(place for place, _ in TORQUE_CHAIN)) == OUTPUT.places


@pytest.mark.parametrize("case", list(itertools.product([True, False], repeat=4)))
def test_a_stage_reads_what_stages_before_it_have_written(case: tuple[bool, bool, bool, bool]) -> None:
    angles, time, torque, loaded = case
    known = {"x", "u", "p", "dt"}
    for stage in (
        KINEMATICS,
        *advance_order(angles=angles, time=time, torque=torque, loaded=loaded),
        *CONTACT_EQUILIBRIUM,
        OUTPUT,
    ):
        needed = set(stage.reads) - ({"c"} if stage.name == "advance_time" and not torque else set())
        assert needed <= known, stage
        known.add(stage.writes)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kind", ["drive", "joint"])
def test_c_calls_the_stages_in_the_declared_order(kind: str, name: str, drive: object, lookup: Lookup) -> None:
    model = build_model(drive, {effect: {} for effect in CASES[name]}, lookup=lookup)  # type: ignore[arg-type]
    component = drive_component(model) if kind == "drive" else joint_component(model, TYPICAL_MASSES)
    functions = make_functions(component)
    text = stage_order(functions)
    bodies = dict(
        re.findall(r"(?m)^static .*?(\w+)\(Instance [^\n]*\{\n(.*?)^\}", text, flags=re.DOTALL | re.MULTILINE)
    )
    called = re.findall(r"(?:RUN\((\w+))|(solve_at)", bodies["apply_drift"])
    motion = ["drift_angles", "kinematics"] if kind == "joint" else []
    declared = [s.name for s in functions.stages.advance_order if s is not COEFFICIENTS]
    assert [run or "contacts" for run, _ in called] == motion + declared
    contacts = re.findall(r"(?:RUN\((\w+))|(solve_at)", bodies["evaluate_contacts"])
    assert [run or "contacts" for run, _ in contacts] == [s.name for s in CONTACT_EQUILIBRIUM if s is not COEFFICIENTS]


@pytest.mark.parametrize("kind", ["drive", "joint"])
def test_generated_functions_compute_equal_expressions_once(kind: str, drive: object, lookup: Lookup) -> None:
    """Outputs and rates share the chain of torques, also in their directional derivative."""
    model = build_model(drive, {effect: {} for effect in EFFECTS}, lookup=lookup)  # type: ignore[arg-type]
    component = drive_component(model) if kind == "drive" else joint_component(model, TYPICAL_MASSES)
    for name, function in make_functions(component).functions.items():
        symbols = function.sx_in()
        shared = ca.Function(name, symbols, [ca.cse(function(*symbols))])
        assert function.n_instructions() == shared.n_instructions(), name


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_only_states_that_depend_on_torque_need_the_contacts_to_advance(effect: Effect, lookup: Lookup) -> None:
    order = [stage.name for stage in make_scalar_stages(lookup, (effect,)).advance_order]
    assert ("contacts" in order) == (effect.name in ("creep", "crank_friction"))
    assert ("advance_loaded" in order) == (effect.name == "crank_friction")


def test_the_predictor_has_a_method_for_every_stage() -> None:
    """But for rates, for friction at the crank, which is not diagnosed, and for a start under a load."""
    needed = [stage.name for stage in STAGES if stage.name not in ("rate", "advance_loaded", "settle")]
    assert all(callable(getattr(RecordStages, name, None)) for name in needed)
