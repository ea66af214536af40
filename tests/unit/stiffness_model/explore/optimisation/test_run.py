"""A study over executors: the results do not depend on them, and an interrupted study continues."""

from __future__ import annotations

import builtins
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.explore.definition.study import Study
from stiffness_model.explore.evaluation.evaluate import Evaluations, evaluate
from stiffness_model.explore.optimisation.run import CHUNK, CHUNK_FOLDER, chunk_count, run_study
from stiffness_model.explore.optimisation.search import sample, search, snap
from stiffness_model.explore.report.results import assess_designs, columns, write_results
from tests.small_study import study


class Counting(Executor):
    """Executes and counts tasks at once, and is interrupted as by Ctrl-C after `stop` tasks."""

    def __init__(self, stop: int = 10**9) -> None:
        self.done, self._stop = 0, stop

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.done >= self._stop:
            future.set_exception(KeyboardInterrupt())
        else:
            self.done += 1
            future.set_result(fn(*args, **kwargs))
        return future


def same(a: tuple[Evaluations, Any], b: tuple[Evaluations, Any]) -> None:
    """Equal to the bit."""
    for name in ("positions", "metrics", "outcome"):
        np.testing.assert_array_equal(getattr(a[0], name), getattr(b[0], name))
    np.testing.assert_array_equal(a[1], b[1])


@pytest.fixture(scope="module")
def small() -> Study:
    return study()


@pytest.fixture(scope="module")
def whole(small: Study, tmp_path_factory: pytest.TempPathFactory) -> tuple[Evaluations, Any]:
    return run_study(small, tmp_path_factory.mktemp("whole"), Counting())


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda: ProcessPoolExecutor(1), id="1 process", marks=pytest.mark.slow),
        pytest.param(lambda: ProcessPoolExecutor(3), id="3 processes"),
        pytest.param(lambda: ThreadPoolExecutor(2), id="2 threads"),
    ],
)
def test_the_results_do_not_depend_on_the_workers(
    make: Callable[[], Executor], small: Study, whole: tuple[Evaluations, Any], tmp_path: Path
) -> None:
    with make() as executor:
        same(run_study(small, tmp_path, executor), whole)


def test_the_metrics_of_a_design_do_not_depend_on_the_others(small: Study, whole: tuple[Evaluations, Any]) -> None:
    some = [40, 3, 17]
    again = evaluate(small, whole[0].positions[some])
    np.testing.assert_array_equal(again.metrics, whole[0].metrics[some])
    assert len({row.tobytes() for row in again.metrics}) == 3


@pytest.mark.parametrize(
    "stop", [0, pytest.param(1, marks=pytest.mark.slow), 3, pytest.param(4, marks=pytest.mark.slow)]
)
def test_an_interrupted_study_continues_where_it_stopped(
    stop: int, small: Study, whole: tuple[Evaluations, Any], tmp_path: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_study(small, tmp_path, Counting(stop))
    assert len(list((tmp_path / CHUNK_FOLDER).iterdir())) == stop
    further, steps = Counting(), []
    same(run_study(small, tmp_path, further, lambda: steps.append(1)), whole)
    assert further.done == chunk_count(small) - stop
    assert len(steps) == chunk_count(small)
    # A finished study is only read.
    same(run_study(small, tmp_path, Counting(0)), whole)


def test_a_damaged_chunk_or_one_of_other_designs_is_evaluated_again(
    small: Study, whole: tuple[Evaluations, Any], tmp_path: Path
) -> None:
    run_study(small, tmp_path, Counting())
    files = sorted((tmp_path / CHUNK_FOLDER).iterdir())
    files[0].write_bytes(files[0].read_bytes()[:200])
    files[1].write_bytes(files[2].read_bytes())
    files[3].write_bytes(b"")
    further = Counting()
    same(run_study(small, tmp_path, further), whole)
    assert further.done == 3


def test_a_folder_of_a_different_study_is_refused(small: Study, tmp_path: Path) -> None:
    run_study(small, tmp_path, Counting())
    with pytest.raises(sm.InputError, match="holds a different study"):
        run_study(study(drives=5), tmp_path, Counting())
    (tmp_path / "study.json").write_text("{}", "utf-8")
    with pytest.raises(sm.InputError, match="expected the identity of a study"):
        run_study(small, tmp_path, Counting())


def test_a_larger_sample_begins_with_the_smaller_one() -> None:
    np.testing.assert_array_equal(sample(study(designs=100))[:48], sample(study(designs=48)))
    assert not np.array_equal(sample(study(seed=1)), sample(study(seed=2)))
    assert 0 <= sample(study()).min() <= sample(study()).max() < 1


def test_the_optimiser_improves_the_front_and_evaluates_no_design_twice(
    small: Study, whole: tuple[Evaluations, Any]
) -> None:
    found, generation = whole
    assert np.bincount(generation).tolist() == [48, 16, 16]
    np.testing.assert_array_equal(snap(small, found.positions), found.positions)
    later = found.positions[generation > 0]
    assert len(np.unique(later, axis=0)) == len(later)
    results = assess_designs(small, found, generation)
    assert (generation[results.front] > 0).any()


def test_the_search_comes_closer_to_a_known_front_than_the_sample() -> None:
    """Two analytic objectives with the known front f2 = 1 - sqrt(f1) at x2 = 0 (ZDT1 in three variables)."""
    of = study(designs=64, population=32, generations=25)
    from stiffness_model.explore.definition.metrics import METRICS

    names = list(METRICS)

    def analytic(x: np.ndarray) -> Evaluations:
        metrics = np.ones((len(x), len(names)))
        g = 1 + 4.5 * (x[:, 1] + (x[:, 2] - 0.5 / 11))
        metrics[:, names.index("lost_motion")] = x[:, 0]
        metrics[:, names.index("no_load_force")] = g * (1 - np.sqrt(x[:, 0] / g))
        metrics[:, names.index("undercut")] = 0.0
        return Evaluations(x, metrics, np.zeros(len(x), np.int8))

    designs = search(of)
    parts = [analytic(next(designs))]
    for _ in range(25):
        parts.append(analytic(designs.send(parts[-1])))
    with pytest.raises(StopIteration):
        designs.send(parts[-1])
    excess = [(p.column("no_load_force") - 1 + np.sqrt(p.column("lost_motion"))).min() for p in parts]
    assert min(excess) > -1e-12
    assert min(excess[-3:]) < 0.1 * excess[0]


def test_without_pymoo_only_the_sample_is_possible(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "pymoo"]:
        monkeypatch.delitem(sys.modules, name)
    _forbid(monkeypatch, "pymoo")
    executor = Counting()
    with pytest.raises(sm.InputError, match=r"pip install '\.\[explore\]' in a clone"):
        run_study(study(), tmp_path, executor)
    assert executor.done == 0
    (tmp_path / "alone").mkdir()
    found, generation = run_study(study(generations=0, designs=CHUNK + 1), tmp_path / "alone", executor)
    assert len(found) == CHUNK + 1
    assert executor.done == 2
    assert not generation.any()


@pytest.mark.parametrize("arrow", [True, False])
def test_results_are_one_columnar_file(
    arrow: bool, small: Study, whole: tuple[Evaluations, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = assess_designs(small, *whole)
    if arrow:
        parquet = pytest.importorskip("pyarrow.parquet")
        assert write_results(results, tmp_path) == "designs.parquet"
        table = parquet.read_table(tmp_path / "designs.parquet")
        read = {name: table[name].to_numpy() for name in table.column_names}
        assert b'"torque": 120.0' in table.schema.metadata[b"study"]
    else:
        _forbid(monkeypatch, "pyarrow")
        assert write_results(results, tmp_path) == "designs.npz"
        with np.load(tmp_path / "designs.npz") as held:
            read = dict(held)
    assert list(read) == list(columns(results))
    assert len(read["design"]) == 80
    np.testing.assert_array_equal(read["stiffness [N.m/rad]"], whole[0].column("stiffness"))
    assert set(read["gear_tolerance"]) == {"IT5", "IT6", "IT7", "IT8"}
    assert read["gear_offset [m]"].min() >= -5e-6
    assert set(read["lobes [1]"]) <= set(range(24, 35))
    # Designs marked as feasible keep the limits, and the front consists of them.
    feasible = read["feasible"]
    assert (read["undercut [1]"][feasible] <= 0.52).all()
    assert (read["pressure [Pa]"][feasible] <= 5e9).all()
    assert 0 < feasible.sum() < 80
    assert feasible[read["front"]].all()
    assert read["front"][read["chosen"]].tolist() == [True]
    assert set(read["outcome"]) == {"simulated", "out_of_limits"}


def _forbid(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.split(".")[0] == package:
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)


@pytest.fixture(autouse=True)
def _no_stray_files(tmp_path: Path) -> Iterator[None]:
    yield
    assert not list(tmp_path.rglob(".*.npz"))
