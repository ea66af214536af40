"""`reefmu explore`: a design study, to its Pareto front and a chosen drawing."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
from collections.abc import Generator
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from pathlib import Path
from typing import Any

import numpy as np

from reefmu.progress import Progress
from stiffness_model.errors import InputError
from stiffness_model.explore.definition.metrics import METRICS
from stiffness_model.explore.definition.study_toml import load_study
from stiffness_model.explore.evaluation.evaluate import Outcome
from stiffness_model.explore.optimisation.run import chunk_count, run_study
from stiffness_model.explore.report import figures
from stiffness_model.explore.report.chosen_drawing import chosen_drive, rule_text
from stiffness_model.explore.report.main_effects import parameter_effect, sampled_designs
from stiffness_model.explore.report.results import Results, assess_designs, write_results
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.io.drawing_toml import save_drive
from stiffness_model.plotting import curves as plots

from . import study as tables
from . import workers

ROWS = 12
"""Members of the front in the printed table; the file has them all."""
CONNECT = 10
"""Seconds to wait for a scheduler."""


def run(args: argparse.Namespace) -> int:
    """Run or go on with the study, print, and write designs.parquet, pictures and chosen.toml."""
    study, folder = load_study(args.study), Path(args.out)
    # Made first and kept: what is computed is kept there as it comes.
    _make(folder)
    try:
        with _executor(args) as executor, Progress(f"evaluating {study.name}", chunk_count(study)) as progress:
            found, generation = run_study(study, folder, executor, progress.step)
    except CancelledError as error:
        raise _kept(BrokenExecutor(str(error) or "its work was cancelled"), folder) from None
    except (BrokenExecutor, KeyboardInterrupt) as error:
        raise _kept(error, folder) from None
    results = assess_designs(study, found, generation)
    files = _write(results, folder)
    print(_summary(results))
    if len(results.front):
        print(f"\nPareto front, {min(ROWS, len(results.front))} of {len(results.front)} members:\n\n{_front(results)}")
    print(f"\nshare of the sample's variance that a parameter makes alone:\n\n{_effects(results)}")
    if results.chosen is None:
        print(f"\nno design is {rule_text(results)}: no drawing is chosen")
    else:
        print(f"\nchosen, {rule_text(results)}:\n\n{_chosen(results)}")
    print(f"\nwritten to {folder}: {', '.join(files)}")
    return 0 if results.chosen is not None else 1


def _kept(error: BaseException, folder: Path) -> BaseException:
    """What stops the study, with a note that it can go on."""
    error.add_note(f"what is done is kept in {folder}, and the same command goes on from there")
    return error


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: expected a folder that can be written, got {error.strerror or error}") from None


@contextlib.contextmanager
def _executor(args: argparse.Namespace) -> Generator[Executor]:
    """Processes of this machine, or the workers of a dask scheduler."""
    if args.scheduler is None:
        with workers.pool(args.workers) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler: expected dask.distributed, got none: pip install 'reefmu[cluster]'") from None
    try:
        asyncio.run(_reach(args.scheduler))
        client: Any = Client(args.scheduler, timeout=CONNECT, set_as_default=False)
    except Exception as error:  # of whichever transport the address names
        said = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(
            f"--scheduler: expected the address of a running dask scheduler, such as "
            f"tcp://host:8786, got {args.scheduler!r} ({said})"
        ) from None
    with client:
        try:
            # A chunk whose worker died is done again elsewhere; it gives the same numbers.
            yield client.get_executor(pure=False, retries=3)
        except (ImportError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "deserialization" not in str(error):
                raise
            raise InputError(
                "--scheduler: expected a scheduler and workers with this version of reefmu installed, got "
                f"{str(error).splitlines()[0]!r}"
            ) from None
        except Exception as error:
            if type(error).__module__.split(".")[0] != "distributed":
                raise
            raise BrokenExecutor(str(error).splitlines()[0]) from None


async def _reach(address: str) -> None:
    """Connect once, and leave: a `Client` that cannot be made keeps a thread, which complains when the program ends."""
    from distributed.comm.core import connect
    from distributed.security import Security

    security: Any = Security()
    comm: Any = await connect(address, timeout=CONNECT, **security.get_connection_args("client"))
    await comm.close()


def _write(results: Results, folder: Path) -> list[str]:
    with staged_folder(folder) as stage:
        write_results(results, stage)
        if len(results.front):
            plots.save(figures.pareto_front(results), stage / "pareto.png")
            plots.save(figures.trade_off(results)[0], stage / "trade_off.png")
        if len(sampled_designs(results)):
            plots.save(figures.main_effects(results)[0], stage / "effects.png")
        if results.chosen is not None:
            save_drive(chosen_drive(results), stage / "chosen.toml")
        return sorted(file.name for file in stage.iterdir())


def _summary(results: Results) -> str:
    counts = np.bincount(results.evaluations.outcome, minlength=len(Outcome))
    numbers = results.study.numbers
    said = [
        f"{results.study.name}: {len(results.evaluations)} designs, {numbers.drives} virtual drives at "
        f"{numbers.twists} twists each, seed {numbers.seed}"
    ]
    said += [
        f"  {counts[outcome]:6d}  {words}"
        for outcome, words in (
            (Outcome.SIMULATED, "simulated"),
            (Outcome.OUT_OF_LIMITS, "left out: the drawing alone breaks a limit"),
            (Outcome.DOES_NOT_PACK, "left out: the elements do not fit"),
            (Outcome.TOO_SOFT, "do not reach the torque"),
            (Outcome.NO_DRIVE, "are no drive"),
        )
        if counts[outcome]
    ]
    said.append(f"  {results.feasible.sum():6d}  keep within all limits, {len(results.front)} of them on the front")
    return "\n".join(said)


def _front(results: Results) -> str:
    study = results.study
    picked = np.unique(np.linspace(0, len(results.front) - 1, ROWS).round().astype(int))
    names = list(study.objectives)
    heads = ["design", *names, *(p.name for p in study.parameters)]
    units = [
        "",
        *(f"[{METRICS[name].display_unit}]" if METRICS[name].display_unit else "" for name in names),
        *("" for _ in study.parameters),
    ]
    rows = [
        [
            str(design),
            *(f"{results.display_values(name)[design]:.4g}" for name in names),
            *_values(results, int(design)),
        ]
        for design in results.front[picked]
    ]
    return tables.table(heads, units, rows)


def _values(results: Results, design: int) -> list[str]:
    return [
        p.text(float(x)) for p, x in zip(results.study.parameters, results.evaluations.positions[design], strict=True)
    ]


def _effects(results: Results) -> str:
    if not len(sampled_designs(results)):
        return "  nothing was simulated"
    names = list(results.study.objectives)
    rows = [
        [p.name, *(f"{100 * parameter_effect(results, k, name).index:.0f} %" for name in names)]
        for k, p in enumerate(results.study.parameters)
    ]
    return tables.table(["", *names], ["", *("" for _ in names)], rows)


def _chosen(results: Results) -> str:
    design = results.chosen
    assert design is not None
    lines = [
        f"  {p.name:18s} {text}{'' if p.is_interior(float(x)) else '   (at the end of its range)'}"
        for p, text, x in zip(
            results.study.parameters, _values(results, design), results.evaluations.positions[design], strict=True
        )
    ]
    lines += [
        f"  {metric.text:30s} {results.display_values(name)[design]:10.4g} {metric.display_unit}".rstrip()
        for name, metric in METRICS.items()
        if not np.isnan(results.display_values(name)[design])
    ]
    return "\n".join(lines)
