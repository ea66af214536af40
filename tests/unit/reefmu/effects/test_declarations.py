"""The declaration of every effect: names of the contract, bounds, units, texts."""

from __future__ import annotations

import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS, Effect, Place
from reefmu.fmu.model.base_units import base_unit
from reefmu.model.drive_model import build_model
from reefmu.model.model_file import parse_parameter
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import Lookup

CONTRACT = {
    "backlash",
    "preload",
    "thermal_clearance",
    "wear",
    "modulus_error",
    "missing_ball",
    "structural_compliance",
    "creep",
    "kinematic_error",
    "hysteresis",
    "load_dependent_hysteresis",
    "damping",
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    "torque_sensor_offset",
    "torque_sensor_drift",
}
FURTHER = {"crank_friction", "elastoplastic_friction"}
"""Effects that no diagnosis names, which the contract therefore does not list."""
SIGNED = {"thermal_clearance", "modulus_error", "torque_sensor_offset", "torque_sensor_drift"}


def test_names_are_those_of_the_contract() -> None:
    assert set(EFFECTS) == CONTRACT | FURTHER
    assert {e.name for e in EFFECTS.values() if e.identification.not_a_candidate} == FURTHER


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_parameters_lie_within_their_bounds(effect: Effect) -> None:
    for p in effect.parameters:
        assert p.minimum <= p.neutral <= p.maximum, p
        assert p.minimum <= p.nominal <= p.maximum, p
        assert p.nominal > 0, p
        base_unit(p.unit)  # raises for a unit that an FMU cannot state
        assert p.description[0].isupper()
        assert not p.description.endswith(".")
        text = f"{p.nominal!r} {p.unit}"
        assert parse_parameter(text, p, "model.toml") == pytest.approx(p.nominal, rel=1e-12)
    names = [p.name for p in effect.parameters] + [s.name for s in effect.states]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_texts_are_complete(effect: Effect) -> None:
    assert effect.name in EFFECTS
    assert effect.title[0].isupper()
    assert effect.meaning[0].isupper()
    assert effect.meaning.endswith(".")
    assert effect.excitation.endswith(".")
    assert effect.source.endswith(".")
    assert "=" in effect.equation
    for state in effect.states:
        base_unit(state.unit)
        assert state.description[0].isupper()


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_the_amplitudes_switch_the_effect_off(effect: Effect) -> None:
    amplitudes = [p for p in effect.parameters if p.name in effect.amplitudes]
    assert effect.parameters[0] in amplitudes
    assert len(amplitudes) == len(effect.amplitudes)
    for amplitude in amplitudes:
        assert amplitude.neutral == 0.0
        assert (amplitude.minimum < 0) == (effect.name in SIGNED)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_values_beyond_the_bounds_are_refused(effect: Effect, drive: sm.Drive, lookup: Lookup) -> None:
    for p in effect.parameters:
        for beyond in (p.minimum - 1, p.maximum + 1, float("nan")):
            with pytest.raises(InputError, match=p.name):
                build_model(drive, {effect.name: {p.name: beyond}}, lookup=lookup)


def test_every_place_is_used() -> None:
    assert {e.place for e in EFFECTS.values()} == set(Place)
