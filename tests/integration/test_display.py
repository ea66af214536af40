"""Results show themselves: a line of text, a table in a notebook, a picture, a DataFrame with units in its headers."""

from __future__ import annotations

import csv
import dataclasses
import sys
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.diagnosis import Diagnosis, Gap, NamedEffect, Value
from reefmu.model import DriveModel, build_curve_model, build_model
from reefmu.record import COLUMNS, REPLACED_BY, Record, make_record, read_record
from reefmu.torque_loop import torque_loop
from stiffness_model.lookup.curve_lookup import curve_lookup
from stiffness_model.lookup.table import Lookup
from stiffness_model.ratings.bearing_life import bearing_life
from stiffness_model.ratings.efficiency import friction_losses
from stiffness_model.ratings.static_safety import static_safety
from stiffness_model.rotation import (
    Individual,
    angles_over_turn,
    draw_individual,
    loaded_turn,
    no_load,
    spectrum,
    turning_map,
)

NAMES_AND_COUNTS = ("part", "material", "drive", "run", "number", "eccentric", "effect", "parameter", "unit")
UNITLESS = {*NAMES_AND_COUNTS, "value", "low", "high"}
"""Headers of names and counts, and of values whose unit stands in a column of its own."""


class Frame(dict[str, Any]):
    """Stands in for `pandas.DataFrame`, so that the columns are tested without pandas."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        super().__init__({name: np.asarray(values) for name, values in columns.items()})


@pytest.fixture
def _frames(monkeypatch: pytest.MonkeyPatch) -> None:
    pandas = ModuleType("pandas")
    pandas.DataFrame = Frame  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", pandas)


@pytest.fixture(scope="module")
def population(drive: sm.Drive) -> sm.Population:
    return sm.simulate(drive, np.linspace(-1, 1, 9) * drive.max_twist, 6, seed=2)


@pytest.fixture(scope="module")
def record() -> Record:
    twist = np.sin(np.linspace(0, 6, 40)) * 1e-3
    return make_record(
        {"time": np.arange(40.0), "run": np.arange(40) // 20, "twist": twist, "output_torque": 1e5 * twist}
    )


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    torque = Value(5.1, 4.9, 5.3, "N.m")
    gap = Gap(5.2, 0.41, 0.38)
    return Diagnosis(
        "named", "hysteresis <of> 5.1 N.m", (NamedEffect("hysteresis", {"torque": torque}, 0.93),), (), (), gap, ()
    )


@pytest.fixture(scope="module")
def shown(
    drive: sm.Drive,
    lookup: Lookup,
    model: DriveModel,
    population: sm.Population,
    record: Record,
    diagnosis: Diagnosis,
) -> dict[str, Any]:
    return {
        "Drive": drive,
        "Population": population,
        "TwistTorqueCurve": population.curve(),
        "Lookup": lookup,
        "Individual": draw_individual(drive, 7),
        "DriveModel": model,
        "Record": record,
        "Diagnosis": diagnosis,
    }


NAMES = ("Drive", "Population", "TwistTorqueCurve", "Lookup", "Individual", "DriveModel", "Record", "Diagnosis")


@pytest.mark.parametrize("name", NAMES)
def test_repr_is_one_short_line(name: str, shown: dict[str, Any]) -> None:
    text = repr(shown[name])
    assert text.startswith(f"{name}(")
    assert "\n" not in text
    assert len(text) < 200


@pytest.mark.parametrize("name", NAMES)
def test_html_is_a_well_formed_table(name: str, shown: dict[str, Any]) -> None:
    opened: list[str] = []

    class Parser(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            opened.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert opened.pop() == tag

    text = shown[name]._repr_html_()
    Parser().feed(text)
    assert opened == []
    assert text.count("<tr>") >= 3
    assert "<of>" not in text, "texts are escaped"


@pytest.mark.parametrize("name", NAMES)
def test_plot_draws_on_given_and_on_new_axes(name: str, shown: dict[str, Any]) -> None:
    ax = Figure().add_subplot()
    assert shown[name].plot(ax) is ax
    assert ax.has_data() or ax.artists or ax.patches
    new = shown[name].plot()
    assert new is not ax
    assert new.figure is not None
    if name not in ("Drive", "Diagnosis"):
        assert "[" in new.get_xlabel() + new.get_ylabel()


@pytest.mark.usefixtures("_frames")
@pytest.mark.parametrize("name", NAMES)
def test_dataframe_has_columns_of_one_length_with_units(name: str, shown: dict[str, Any]) -> None:
    frame = shown[name].to_dataframe()
    assert len({len(values) for values in frame.values()}) == 1
    for header in frame:
        assert header in UNITLESS or header.endswith("]"), header


@pytest.mark.usefixtures("_frames")
def test_the_curve_s_dataframe_is_its_csv(population: sm.Population, tmp_path: Path) -> None:
    curve = population.curve()
    curve.write_csv(tmp_path / "curve.csv")
    with (tmp_path / "curve.csv").open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    frame = curve.to_dataframe()
    assert list(frame) == header
    assert pytest.approx(np.array(list(frame.values())), rel=1e-8, nan_ok=True) == np.array(rows, float).T


@pytest.mark.usefixtures("_frames")
def test_the_population_s_rows_are_drives_at_twists(population: sm.Population) -> None:
    frame = population.to_dataframe()
    one = frame["drive"] == 4
    assert frame["torque [N.m]"][one] == pytest.approx(population.torque[4])
    assert frame["twist [arcmin]"][one] * sm.ARCMIN == pytest.approx(population.twist)
    assert frame["force_cage_tminus [N]"][one] == pytest.approx(population.contact_force[4, :, 3])


@pytest.mark.usefixtures("_frames")
def test_a_record_s_columns_make_the_record_again(record: Record, tmp_path: Path) -> None:
    frame = record.to_dataframe()
    with (tmp_path / "record.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(frame)
        writer.writerows(zip(*frame.values(), strict=True))
    again = read_record(tmp_path / "record.csv")
    for name in COLUMNS.keys() - REPLACED_BY.keys():
        assert getattr(again, name) == pytest.approx(getattr(record, name))


@pytest.mark.usefixtures("_frames")
def test_an_individual_s_parts_scatter_by_the_drawing_s_tolerances(drive: sm.Drive) -> None:
    frame = draw_individual(drive, 7).to_dataframe()
    assert len(frame["part"]) == 3 * drive.elements + drive.eccentrics * drive.lobes
    for part in ("element", "crank", "cage", "gear"):
        tolerance = drive.tolerances[part]
        deviation = 1e-6 * frame["deviation [um]"][frame["part"] == part]
        assert deviation.mean() == pytest.approx(tolerance.offset, abs=4 * tolerance.sigma / 8)
        assert deviation.std() == pytest.approx(tolerance.sigma, rel=0.3)


def test_a_model_s_loop_shows_its_hysteresis(drive: sm.Drive, lookup: Lookup) -> None:
    loop = torque_loop(build_model(drive, {"hysteresis": {"torque": 3.0}}, lookup=lookup))
    twist, torque = loop["twist [arcmin]"], loop["torque [N.m]"]
    assert np.abs(twist).max() * sm.ARCMIN == pytest.approx(drive.max_twist, rel=1e-3)
    elastic = lookup.torque(twist * sm.ARCMIN)
    steady = slice(120, 240)  # falling from the positive to the negative end
    late = np.abs(twist[steady]) < 0.5 * twist.max()
    assert (torque - elastic)[steady][late] == pytest.approx(-3.0, abs=0.2)


def test_a_curve_s_model_is_drawn_to_its_end() -> None:
    table = curve_lookup(np.array([0.0, 1e-3, 2e-3]), np.array([0.0, 5.0, 12.0]), 0.01, "spring", -50)
    loop = torque_loop(build_curve_model(table))
    assert loop["torque [N.m]"].max() == pytest.approx(12.0, rel=1e-2)


def test_a_record_s_twist_needs_the_ratio_where_the_crank_turns() -> None:
    data = {"time": [0, 1, 2], "crank_angle": [0, -1, -2], "output_angle": [0, 0.03, 0.06], "output_torque": [0, 5, 9]}
    record = make_record(data)
    assert record.plot().get_xlabel() == "time [s]"
    ax = record.plot(ratio=-29.0)
    assert ax.get_xlabel() == "twist [arcmin]"
    assert ax.lines[0].get_xdata() == pytest.approx(record.twist(-29.0) / sm.ARCMIN)


def test_without_pandas_one_line_says_what_to_install(drive: sm.Drive, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(sm.InputError, match=r"pip install '\.\[dataframe\]' in a clone") as caught:
        drive.to_dataframe()
    assert "\n" not in str(caught.value)


def test_with_pandas_it_is_a_dataframe(population: sm.Population) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas (extra dataframe) is not installed")
    frame = population.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.groupby("drive")["torque [N.m]"].max().to_numpy() == pytest.approx(population.torque.max(axis=1))


def test_results_with_arrays_print_their_shapes(drive: sm.Drive) -> None:
    twist = [0.5 * drive.max_twist, drive.max_twist]
    loaded = sm.load_drive("drive_1", bearing_capacity="40 kN", friction_coefficient=0.05)
    one, angle = draw_individual(drive, 1), angles_over_turn(drive, 1)[:20]
    results = [
        sm.contact_pressures(drive, twist, 2),
        static_safety(drive, twist, 2),
        friction_losses(loaded, twist, 2),
        bearing_life(loaded, twist, 2),
        turning_map(one, twist, angle),
        loaded_turn(one, 50.0, angle),
        no_load(one, angle),
        spectrum(drive, np.arange(8.0)),
    ]
    for result in results:
        text = repr(result)
        assert "\n" not in text
        assert "array" not in text
        assert len(text) < 400
        first = next(f.name for f in dataclasses.fields(result) if isinstance(getattr(result, f.name), np.ndarray))
        assert f"{first}: {len(getattr(result, first))}" in text


def test_individuals_say_where_they_are_from(drive: sm.Drive) -> None:
    assert repr(draw_individual(drive, 7)) == "Individual('drive_1', seed 7)"
    assert isinstance(dataclasses.replace(draw_individual(drive, 7), seed=None), Individual)
    assert "no deviations drawn" in repr(dataclasses.replace(draw_individual(drive, 7), seed=None))
