"""A small design study for the tests."""

from __future__ import annotations

from typing import Any

from stiffness_model.explore.definition.study import Study
from stiffness_model.explore.definition.study_toml import study_from_dict


def tables(**numbers: Any) -> dict[str, Any]:
    """Its TOML tables: tolerances and lobes of drive_1. `numbers` replaces entries of the table of that name."""
    return {
        "name": "small",
        "base": "drive_1",
        "parameters": {
            "gear_tolerance": {"from": "IT5", "to": "IT8"},
            "gear_offset": {"from": "-5 um", "to": "10 um"},
            "lobes": {"from": 24, "to": 34},
        },
        "fixed": {"elements_per_row": "fill"},
        "constraints": {"packs": True, "undercut": {"max": 0.52}, "pressure": {"max": "5 GPa"}},
        "objectives": {"lost_motion": "min", "no_load_force": "min", "stiffness": "max"},
        "numbers": {
            "torque": "120 N.m",
            "designs": 48,
            "drives": 4,
            "twists": 12,
            "generations": 2,
            "population": 16,
            "seed": 3,
            **numbers,
        },
    }


def study(**numbers: Any) -> Study:
    """The study of `tables`."""
    return study_from_dict(tables(**numbers))
