"""A library of motions of drive_1, linearised once for all tests of planning."""

from __future__ import annotations

import pytest

import stiffness_model as sm
from reefmu.planning.protocols.rig import Rig
from reefmu.planning.setting import Setting, prepare_setting
from reefmu.planning.shortest_plan import Plan, make_plan
from stiffness_model.lookup.table import Lookup


@pytest.fixture(scope="session")
def setting(drive: sm.Drive, lookup: Lookup) -> Setting:
    return prepare_setting(drive, Rig(), None, lambda stage, share: None)


@pytest.fixture(scope="session")
def plan(drive: sm.Drive, lookup: Lookup) -> Plan:
    """A plan for three effects on a rig whose crank is locked."""
    return make_plan(drive, Rig(crank="locked", minutes=6.0), ["hysteresis", "creep", "viscous_friction"])
