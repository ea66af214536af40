"""`reefmu explore`: a design study with its Pareto front and a chosen drawing."""

from __future__ import annotations

import argparse
from concurrent.futures import BrokenExecutor, CancelledError
from pathlib import Path

from reefmu.progress import Progress
from stiffness_model.errors import InputError
from stiffness_model.explore.definition.study_toml import load_study
from stiffness_model.explore.optimisation.run import chunk_count, run_study
from stiffness_model.explore.report import figures
from stiffness_model.explore.report.chosen_drawing import chosen_drive
from stiffness_model.explore.report.main_effects import sampled_designs
from stiffness_model.explore.report.results import Results, assess_designs, write_results
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.io.drawing_toml import save_drive
from stiffness_model.plotting import curves as plots

from .executors import study_executor
from .study_text import study_text


def run(args: argparse.Namespace) -> int:
    """Run or continue the study, print its results, and write designs.parquet, pictures and chosen.toml."""
    study, folder = load_study(args.study), Path(args.out)
    # The folder is made first, because the study keeps its finished parts there.
    _make_folder(folder)
    try:
        with study_executor(args) as executor, Progress(f"evaluating {study.name}", chunk_count(study)) as progress:
            found, generation = run_study(study, folder, executor, progress.step)
    except CancelledError as error:
        raise _with_remedy(BrokenExecutor(str(error) or "its work was cancelled"), folder) from None
    except (BrokenExecutor, KeyboardInterrupt) as error:
        raise _with_remedy(error, folder) from None
    results = assess_designs(study, found, generation)
    files = _write(results, folder, args.format)
    print(study_text(results))
    print(f"\nwritten to {folder}: {', '.join(files)}")
    return 0 if results.chosen is not None else 1


def _with_remedy(error: BaseException, folder: Path) -> BaseException:
    """The exception that stopped the study, with a note on how to continue."""
    error.add_note(f"finished designs are kept in {folder}, and the same command continues from there")
    return error


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: expected a folder that can be written, got {error.strerror or error}") from None


def _write(results: Results, folder: Path, suffix: str) -> list[str]:
    """Write tables, pictures with this suffix and the chosen drawing; returns the names of the files."""
    with staged_folder(folder) as stage:
        write_results(results, stage)
        if len(results.front):
            plots.save(figures.pareto_front(results), stage / f"pareto.{suffix}")
            plots.save(figures.trade_off(results)[0], stage / f"trade_off.{suffix}")
        if len(sampled_designs(results)):
            plots.save(figures.main_effects(results)[0], stage / f"effects.{suffix}")
        if results.chosen is not None:
            save_drive(chosen_drive(results), stage / "chosen.toml")
        return sorted(file.name for file in stage.iterdir())
