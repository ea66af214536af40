"""The benchmark runs, and its three methods agree."""

from __future__ import annotations

import shutil

import pytest

import stiffness_model as sm
from tests.benchmarks.contacts import bench_equilibrium


def test_three_methods_agree():
    figures = bench_equilibrium.measure(sm.load_drive("drive_3"), 60, 3, repeats=1, n_roots=20)
    assert figures.root_difference < 1e-8
    text = bench_equilibrium.table(figures)
    assert "scipy.optimize.root" in text
    if shutil.which("cc") is None:
        assert "no C compiler" in text
        pytest.skip(figures.c_missing)
    assert figures.c_missing == ""
    assert figures.c_difference is not None
    assert figures.c_difference < 1e-10


def test_without_a_compiler_the_reason_is_shown(monkeypatch):
    monkeypatch.setattr(bench_equilibrium.shutil, "which", lambda name: None)
    figures = bench_equilibrium.measure(sm.load_drive("drive_1"), 60, 2, repeats=1, n_roots=10)
    assert figures.c is None
    assert "no C compiler (cc) on the PATH" in bench_equilibrium.table(figures)
