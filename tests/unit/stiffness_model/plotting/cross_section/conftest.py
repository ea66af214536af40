"""Drives to draw: turning together and reversing, balls and rollers, one to three rows, full and half-empty cages."""

from __future__ import annotations

import pytest

import stiffness_model as sm

FIELDS = {
    "drive_1": {},
    "together": {"lobes": 28},
    "small balls": {"element_radius": "4 mm", "crank_radius": "44 mm"},
    "two rows of rollers": {
        "element": "roller",
        "element_length": "10 mm",
        "element_radius": "3 mm",
        "crank_radius": "45 mm",
        "eccentrics": 2,
        "elements": 58,
    },
    "empty places": {"element_radius": "4 mm", "crank_radius": "44 mm", "elements": 3 * 20},
    "every second place": {"transmission_ratio": 20, "lobes": 21, "elements": 3 * 10, "eccentricity": "1.5 mm"},
    "one row": {"eccentrics": 1, "elements": 11, "transmission_ratio": 11, "lobes": 10, "eccentricity": "2 mm"},
}


@pytest.fixture(params=FIELDS)
def drawn(request: pytest.FixtureRequest) -> sm.Drive:
    return sm.load_drive("drive_1", **FIELDS[request.param])


@pytest.fixture
def roomy() -> sm.Drive:
    """A drive with bars between its bores."""
    return sm.load_drive("drive_1", **FIELDS["small balls"])
