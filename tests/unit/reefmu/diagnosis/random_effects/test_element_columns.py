"""Columns of the deviations of places, compared with the torque of one element beside its place."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from reefmu.diagnosis.random_effects.element_columns import SeatedElements
from reefmu.diagnosis.random_effects.element_motion import ElementMotion, elements_on_profile, share_inside
from reefmu.diagnosis.random_effects.part_responses import part_responses
from reefmu.diagnosis.random_effects.responses import NODES, element_responses, place_deviations
from stiffness_model import Drive, load_drive
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array

TWIST = 0.6
"""At which the elements stand, of the greatest one."""


@pytest.fixture(scope="module")
def drive() -> Drive:
    """Of so fine tolerances that the torque is linear in all deviations, at the edges of the profile too."""
    return load_drive("drive_1", gear_tolerance="IT1", cage_tolerance="IT1")


def columns_of_places(drive: Drive, position: Array) -> tuple[Array, Array]:
    """(n,) N.m, columns of the places of the first element and of its lobe, where it stands at positions (n,), rad."""
    n, number = len(position), np.arange(len(position))
    motion = ElementMotion(position, np.zeros(n), np.ones(n), np.zeros((n, 1)), number, number, np.ones(n, np.intp))
    responses, twist = element_responses(drive), np.full(n, TWIST * drive.max_twist)
    parts = part_responses(responses, motion, twist, np.zeros(n))
    columns = SeatedElements(drive, responses, motion, parts, 0.0).columns((1.0, 0.0, 0.0))
    # The last rows are those of the places of all elements that are on the profile, then of their lobes.
    margin = NODES.max() * abs(drive.ratio - 1) * place_deviations(drive).along
    on = elements_on_profile(drive, motion, 0.0, margin)
    lobes = len(np.unique(on.lobe))
    return columns[-len(np.unique(on.element)) - lobes], columns[-lobes]


def slopes(drive: Drive, position: Array) -> tuple[Array, Array]:
    """(n,) N.m/rad, derivatives of an element's torque, by its share on the profile, by twist and by position."""
    r, twist = element_responses(drive), TWIST * drive.max_twist
    middle = r.single[len(r.single) // 2]
    on_profile = RegularGridInterpolator((r.twist, r.position), middle, method="cubic")

    def torque(twist: float, position: Array) -> Array:
        held = np.clip(position, r.position[0], r.position[-1])
        return on_profile(np.stack([np.full(len(held), twist), held], axis=1)) * share_inside(drive, position)

    step, turn = 0.01 * drive.max_twist, 0.05 * FADE_HALF_WIDTH
    by_twist = (torque(twist + step, position) - torque(twist - step, position)) / (2 * step)
    return by_twist, (torque(twist, position + turn) - torque(twist, position - turn)) / (2 * turn)


def test_places_twist_an_element_and_move_it_along_the_profile_and_over_its_edges(drive: Drive) -> None:
    """A lobe twists its element by as much less than a bore as the output turns less than an element of the crank."""
    edge, places = drive.usable_limit, place_deviations(drive)
    position = np.append(np.linspace(-0.8, 0.8, 33) * edge, edge + np.linspace(-5, 5, 101) * FADE_HALF_WIDTH)
    by_twist, by_position = slopes(drive, position)
    of_element, of_lobe = columns_of_places(drive, position)
    moved = (drive.ratio - 1) * by_position
    expected = places.bore / places.radius * (moved - by_twist)
    np.testing.assert_allclose(of_element, expected, atol=0.02 * np.abs(expected).max())
    # What both have in common cancels, so that the small difference shows.
    less = of_lobe / places.lobe - of_element / places.bore
    expected = by_twist / drive.ratio / places.radius
    np.testing.assert_allclose(less, expected, atol=0.1 * np.abs(expected).max())
