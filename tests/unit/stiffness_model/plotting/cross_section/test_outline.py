"""The profile for manufacturing: on the curve, within its chord error, closed, and without intersections."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.errors import InputError
from stiffness_model.geometry.ball_path import BallPath, usable_limit
from stiffness_model.plotting.cross_section import dxf
from stiffness_model.plotting.cross_section.layout import place_parts
from stiffness_model.plotting.cross_section.outline import equidistant, gear_offset, gear_outline, rotated
from tests.unit.stiffness_model.plotting.cross_section.polygons import area, crossings, distances

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf (extra dxf) is not installed")


def distance_from_path(path: BallPath, points: np.ndarray) -> np.ndarray:
    """Distance of points near the first lobe from the ball path, sampled every 0.4 um or so."""
    theta = np.linspace(-1.2, 1.2, 60001) * np.pi / path.lobes
    r = path.radius(path.lobes * theta)
    centres = np.stack([r * np.cos(theta), r * np.sin(theta)], -1)
    return np.array([np.hypot(*(centres - point).T).min() for point in points])


@pytest.mark.parametrize("chord", [1e-7, 5e-6])
def test_outline_keeps_its_chord_error(drawn: sm.Drive, chord: float) -> None:
    """Vertices are at the distance q from the path, to 1e-9 m; between them the error is at most the chord error."""
    outline, q = gear_outline(drawn, chord), gear_offset(drawn)
    per_lobe = len(outline.points) // drawn.lobes
    lobe = outline.points[: per_lobe + 1]
    np.testing.assert_allclose(distance_from_path(drawn.path, lobe), q, rtol=0, atol=1e-9)
    middles = (lobe[1:] + lobe[:-1]) / 2
    off = np.abs(distance_from_path(drawn.path, middles) - q)
    assert off.max() <= chord + 1e-9
    assert off.max() == pytest.approx(outline.error, rel=0.1, abs=1e-9)
    assert outline.error > 0.3 * chord, "far finer than requested"


def test_outline_is_closed_periodic_and_simple(drawn: sm.Drive) -> None:
    outline = gear_outline(drawn, 2e-6)
    points, per_lobe = outline.points, len(outline.points) // drawn.lobes
    assert crossings(points) == 0
    assert area(points) > np.pi * drawn.path.centre_distance**2
    edges = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    assert edges.min() > 0
    assert edges.max() < 2e-3
    turned = rotated(points, 2 * np.pi / drawn.lobes)
    np.testing.assert_allclose(np.roll(turned, per_lobe, axis=0), points, atol=1e-12)


def test_without_trimming_the_profile_intersects_itself_at_every_crest(drive: sm.Drive) -> None:
    """Trimming removes these intersections, and `crossings` detects them."""
    beta = np.linspace(-np.pi, np.pi, 61)[:-1]
    raw = np.concatenate([rotated(drive.path.point(beta, 7e-3), 2 * np.pi * k / 30) for k in range(30)])
    assert crossings(raw) >= 30
    outline = gear_outline(drive)
    assert outline.limit == drive.usable_limit < np.pi
    crest = outline.points[0]
    # The crest is on the symmetry line between two lobes.
    assert np.arctan2(crest[1], crest[0]) == pytest.approx(-np.pi / 30, abs=1e-12)


def test_profile_without_undercut_is_smooth() -> None:
    path = BallPath(48e-3, 0.3e-3, 20)
    assert usable_limit(path, 3e-3) == np.pi
    outline = equidistant(path, 3e-3)
    assert outline.limit == np.pi
    edges = np.diff(np.concatenate([outline.points, outline.points[:1]]), axis=0)
    turn = np.angle(np.exp(1j * np.diff(np.arctan2(edges[:, 1], edges[:, 0]))))
    assert np.abs(turn).max() < 0.05


@settings(max_examples=60, deadline=None)
@given(lobes=st.integers(1, 80), eccentricity=st.floats(-3, -0.01), offset=st.floats(-2.5, 0.5))
def test_no_flank_is_undercut(lobes: int, eccentricity: float, offset: float) -> None:
    """The polar angle increases along the whole outline, which therefore cannot intersect itself. Sizes are powers of
    ten relative to the pitch radius.
    """
    path = BallPath(48e-3, 48e-3 * 10**eccentricity, lobes)
    points = equidistant(path, 48e-3 * 10**offset, 1e-4).points
    angle = np.arctan2(points[:, 1], points[:, 0])
    steps = np.angle(np.exp(1j * np.diff(np.append(angle, angle[0]))))
    assert (steps > 0).all()
    assert steps.sum() == pytest.approx(2 * np.pi)


def test_a_chord_error_is_positive() -> None:
    for chord in (0.0, -1e-6, np.nan):
        with pytest.raises(InputError, match="chord_error"):
            gear_outline(sm.load_drive("drive_1"), chord)


# -- DXF ---------------------------------------------------------------------------------------------------


def read(path: Path) -> Any:
    return ezdxf.readfile(path)


def polyline(document: Any, layer: str) -> np.ndarray:
    (line,) = document.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
    assert line.closed
    assert not line.has_arc, "straight edges only"
    return 1e-3 * np.array(line.get_points("xy"))


@pytest.mark.slow
def test_dxf_reads_back(drawn: sm.Drive, tmp_path: Path) -> None:
    """Units, layers, and every row's profile against `geometry.ball_path` to the stated error."""
    chord = 1e-7
    written = dxf.write_dxf(drawn, tmp_path / "profile.dxf", chord)
    document, layout, q = read(tmp_path / "profile.dxf"), place_parts(drawn), gear_offset(drawn)
    assert document.units == 4
    assert document.header["$INSUNITS"] == 4
    assert document.header["$MEASUREMENT"] == 1
    assert not document.audit().has_errors
    for row, turn in enumerate(layout.gear):
        end = f"_{row + 1}" if row else ""
        bores = document.modelspace().query(f'CIRCLE[layer=="BORES{end}"]')
        centres = 1e-3 * np.array([tuple(bore.dxf.center)[:2] for bore in bores])
        assert len(centres) == drawn.elements_per_row
        np.testing.assert_allclose(
            np.exp(1j * np.arctan2(centres[:, 1], centres[:, 0])), np.exp(1j * layout.bore[row]), atol=1e-9
        )
        if row and turn == 0:
            continue
        points = rotated(polyline(document, f"PROFILE{end}"), -turn)
        np.testing.assert_allclose(points, written.points, atol=1e-12)
        lobe = points[: len(points) // drawn.lobes]
        assert np.abs(distance_from_path(drawn.path, (lobe[1:] + lobe[:-1]) / 2) - q).max() <= chord + 1e-9
        path = rotated(polyline(document, f"BALL_PATH{end}"), -turn)
        angle = np.arctan2(path[:, 1], path[:, 0])
        np.testing.assert_allclose(np.hypot(*path.T), drawn.path.radius(drawn.lobes * angle), rtol=1e-12)
    (circle,) = document.modelspace().query("CIRCLE[layer=='PITCH_CIRCLE']")
    assert circle.dxf.radius == pytest.approx(1e3 * drawn.path.centre_distance)
    (note,) = document.modelspace().query("MTEXT")
    for part in (f"{drawn.lobes} lobes", "chord error below 0.", "mm"):
        assert part in note.text
    assert written.error <= chord
    assert ("crest" in note.text) == (drawn.usable_limit < np.pi)


def test_points_of_geometry_lie_on_the_written_profile(drive: sm.Drive, tmp_path: Path) -> None:
    dxf.write_dxf(drive, tmp_path / "profile.dxf")
    beta = np.random.default_rng(1).uniform(-drive.usable_limit, drive.usable_limit, 300)
    off = distances(drive.path.point(beta, drive.element_radius), polyline(read(tmp_path / "profile.dxf"), "PROFILE"))
    assert 2e-8 < off.max() <= 1e-7


def test_the_profile_includes_the_gear_s_mean_offset(tmp_path: Path) -> None:
    """Manufacturing aims at the middle of the tolerance zone."""
    wide = sm.load_drive("drive_1", gear_offset="20 um")
    dxf.write_dxf(wide, tmp_path / "profile.dxf")
    points = polyline(read(tmp_path / "profile.dxf"), "PROFILE")
    assert points[:, 0].max() == pytest.approx(48.7e-3 + 7.02e-3, abs=1.1e-7)


def test_without_the_library_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf.filemanagement", None)
    with pytest.raises(InputError, match=r"pip install '\.\[dxf\]' in a clone"):
        dxf.write_dxf(sm.load_drive("drive_1"), tmp_path / "profile.dxf")
    assert not list(tmp_path.iterdir())
