"""The report in a browser, on screens and on paper, and its texts."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from reefmu.diagnosis import Diagnosis, Gap, Hypothesis, IsolabilityMatrix, Location, NamedEffect, Value
from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.fitted_values import ParameterAtBound
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from reefmu.diagnosis.report.html.page import report_html
from reefmu.diagnosis.report.html.script import SCRIPT
from reefmu.diagnosis.report.text import MEANING, cautions, file_name
from reefmu.diagnosis.schema import VERDICTS
from reefmu.effects import EFFECTS
from tests import diagnosis_rig as rig
from tests.integration.diagnosis import browser

pytestmark = pytest.mark.slow

BROWSER = pytest.mark.skipif(browser.CHROMIUM is None, reason="no Chromium on the PATH")
HYSTERESIS = NamedEffect(
    "hysteresis",
    {"torque": Value(4.0, 3.9, 4.1, "N.m"), "presliding": Value(1e-7, 1e-7, 1e-4, "rad", "at its bound", "low")},
    0.9,
)
AT_BOUND = ParameterAtBound("hysteresis.presliding", "low", 1e-7, None, 1e-4, "rad", "this record does not resolve it")
MADE = Diagnosis(
    "named",
    "What is missing is friction.",
    (HYSTERESIS,),
    (),
    (Location("direction", "growing", 0.9),),
    Gap(5.0, 1.0, 0.9, 5.1, 1.1),
    (),
    at_bounds=(AT_BOUND,),
)


@pytest.fixture(scope="module")
def found() -> Analysis:
    found = analyse(rig.measured({"hysteresis": {"torque": 4.0}}, full=False, seed=2), BaseCurveSource(rig.drive()))
    assert isinstance(found, Analysis)
    return found


@pytest.fixture(scope="module")
def page(found: Analysis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(report_html(found), "utf-8")
    return path


@pytest.fixture(scope="module")
def plain_page(found: Analysis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a diagnosis without probabilities."""
    path = tmp_path_factory.mktemp("plain") / "report.html"
    plain = replace(found.diagnosis, hypotheses=(), global_p=None, isolability=None)
    path.write_text(report_html(replace(found, diagnosis=plain)), "utf-8")
    return path


@BROWSER
@pytest.mark.parametrize("which", ["page", "plain_page"])
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (794, 1123), (500, 800)])
def test_the_page_in_a_browser(
    request: pytest.FixtureRequest, tmp_path: Path, width: int, height: int, which: str
) -> None:
    """On a screen, on a sheet of A4 and in a narrow window nothing overflows, and the verdict is visible at once."""
    seen = browser.look(request.getfixturevalue(which), width, height, tmp_path)
    assert seen.page <= seen.width
    assert seen.wide == []
    assert len(seen.pictures) == 5
    assert all(w > 250 and h > 80 and paths > 10 for w, h, paths in seen.pictures)
    assert seen.lead[3] < 0.5 * height
    if width == 1280:
        assert seen.cards[3] < 0.6 * height if which == "plain_page" else seen.cards[1] < height
    assert seen.asked == []


@BROWSER
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (500, 800)])
def test_the_page_with_probabilities_in_a_browser(found: Analysis, tmp_path: Path, width: int, height: int) -> None:
    """With the largest matrix that is shown nothing overflows, and on a screen the cards are at most one page down."""
    names = tuple(EFFECTS)
    rows = tuple(tuple(0.6 if a == b else 0.025 for b in names) for a in names)
    hypotheses = [
        Hypothesis(("hysteresis",), False, 0.9),
        Hypothesis(("load_dependent_hysteresis", "structural_compliance", "torque_sensor_offset"), True, 0.06),
        Hypothesis((), False, 0.04),
    ]
    diagnosis = replace(found.diagnosis, verdict="none", effects=())
    diagnosis = diagnosis.with_probabilities(hypotheses, 0.004, IsolabilityMatrix(names, rows))
    path = tmp_path / "report.html"
    path.write_text(report_html(replace(found, diagnosis=diagnosis)), "utf-8")
    seen = browser.look(path, width, height, tmp_path)
    assert path.read_text("utf-8").count("<th scope=row>") == 10
    assert seen.page <= seen.width
    assert seen.wide == []
    if width == 1280:
        assert seen.cards[1] < height


@BROWSER
def test_values_under_the_pointer_and_layers_that_can_be_hidden(page: Path, tmp_path: Path) -> None:
    seen = browser.operated(page, tmp_path)
    assert seen["layers"] == ["measured", "model as drawn", "with the effect"]
    assert seen["hidden"] == "none"
    name, _, values = seen["readout"].partition(": ")
    assert name in seen["layers"][1:]
    twist, torque = re.fullmatch(r"twist (\S+) arcmin, torque (\S+) N\.m", values).groups()  # type: ignore[union-attr]
    assert abs(float(twist)) < 0.5 * rig.drive().max_twist * 10800 / 3.1416
    assert abs(float(torque)) < 60


@BROWSER
def test_the_page_on_paper(page: Path, tmp_path: Path) -> None:
    pdf = browser.printed(page, tmp_path)
    assert pdf.startswith(b"%PDF")
    sheets = len(re.findall(rb"/Type\s*/Page\b", pdf))
    assert 1 <= sheets <= 5


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_a_page(verdict: str) -> None:
    text = report_html(replace(MADE, verdict=verdict, effects=MADE.effects if verdict in ("named", "partly") else ()))
    assert MEANING[verdict] in text
    assert MADE.sentence in text


def test_the_page_is_self_contained_and_shows_no_folder(found: Analysis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    text = report_html(replace(found, record=replace(found.record, source="/home/somebody/a<b>.csv")))
    assert not re.search(r'(?:src|href)\s*=\s*(?!["\']#)', text.replace("xlink:href", "href"))
    assert "2023-11-14 22:13 UTC" in text
    assert not re.search(r"(?:fetch|import|XMLHttpRequest|WebSocket)\b", SCRIPT)
    assert "/home/somebody" not in text
    assert "a&lt;b&gt;.csv" in text
    assert text == report_html(replace(found, record=replace(found.record, source="/home/somebody/a<b>.csv")))


def test_cautions_of_the_report() -> None:
    (bound,) = cautions(MADE)
    assert "presliding" in bound
    assert "ended at its lower bound" in bound
    assert "95 %: at most" in bound
    assert bound in report_html(MADE)
    assert json.loads(MADE.to_json())["at_bounds"][0]["low"] is None
    wide = replace(HYSTERESIS, parameters={"torque": Value(4.0, 0.0, 9.0, "N.m", "wide interval")})
    free = replace(MADE, at_bounds=())
    assert "torque is only known to be within" in cautions(replace(free, effects=(wide,)))[0]
    sure = replace(free, effects=(replace(HYSTERESIS, parameters={"torque": Value(4.0, 3.9, 4.1, "N.m")}),))
    assert cautions(sure) == []
    assert "does not shrink" in cautions(replace(sure, gap=Gap(5.0, 5.5, 5.4)))[0]
    assert "in runs that were not fitted" in cautions(replace(sure, gap=Gap(5.0, 1.0, 0.9, 5.0, 6.0)))[0]
    assert "2.2 times the noise; without" in cautions(replace(sure, gap=Gap(5.0, 2.0, 0.9, after_own_scatter=1.0)))[0]


def test_file_names_of_several_paths() -> None:
    assert file_name("/a/b.csv, C:\\c\\d.csv") == "b.csv, d.csv"
