"""The pictures of a design study: texts lie inside the figure and apart from each other."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from stiffness_model.explore.optimisation.run import run_study
from stiffness_model.explore.report import figures
from stiffness_model.explore.report.results import assess_designs
from tests.picture_layout import layout_faults
from tests.small_study import study


@pytest.mark.slow
def test_texts_of_a_study_s_pictures_do_not_collide(tmp_path: Path) -> None:
    small = study()
    with ProcessPoolExecutor(1) as executor:
        results = assess_designs(small, *run_study(small, tmp_path, executor))
    axes = {
        "front": figures.pareto_front(results),
        "trade-off": figures.trade_off(results)[0],
        "main effects": figures.main_effects(results)[0],
    }
    drawn = {name: ax.get_figure(root=True) for name, ax in axes.items()}
    assert all(figure is not None for figure in drawn.values())
    assert {name: found for name, figure in drawn.items() if figure and (found := layout_faults(figure))} == {}
