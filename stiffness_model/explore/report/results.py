"""The designs of a study with their assessment, and as a columnar file: Parquet, or npz where pyarrow is missing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...io.atomic_files import atomic_file
from ...numerics.arrays import Array
from ..definition.metrics import METRICS
from ..definition.study import Study, study_to_dict
from ..evaluation.evaluate import Evaluations, Outcome
from ..optimisation.pareto import choose, front, violations


@dataclass(frozen=True, eq=False)
class Results:
    """All designs of a study. generation: (n,), 0 for the sample; feasible: (n,); front: indices, along the first
    objective; chosen: index, or None."""

    study: Study
    evaluations: Evaluations
    generation: NDArray[np.intp]
    feasible: NDArray[np.bool_]
    front: NDArray[np.intp]
    chosen: int | None

    def display_values(self, metric: str) -> Array:
        """A metric of all designs, (n,), in its display unit."""
        return self.evaluations.column(metric) / METRICS[metric].scale

    def parameter_values(self, parameter: int) -> Array:
        """A parameter of all designs as numbers, (n,) (`Parameter.axis_value`)."""
        of = self.study.parameters[parameter]
        return np.array([of.axis_value(float(x)) for x in self.evaluations.positions[:, parameter]])


def assess_designs(study: Study, found: Evaluations, generation: NDArray[np.intp]) -> Results:
    """Feasibility, Pareto front and chosen member. generation: of each design, (n,)."""
    members = front(study, found)
    return Results(study, found, generation, violations(study, found) == 0, members, choose(study, found, members))


def columns(results: Results) -> dict[str, NDArray[Any]]:
    """The columns of the file by `name [unit]`, SI; texts and flags without a unit."""
    study, found = results.study, results.evaluations
    count = len(found)
    made: dict[str, NDArray[Any]] = {
        "design": np.arange(count),
        "generation": results.generation,
        "outcome": np.array([Outcome(k).name.lower() for k in found.outcome]),
    }
    for k, parameter in enumerate(study.parameters):
        if parameter.is_categorical:
            made[parameter.name] = np.array([str(parameter.at(float(x))) for x in found.positions[:, k]])
        else:
            made[f"{parameter.name} [{parameter.unit}]"] = results.parameter_values(k)
    for k, metric in enumerate(METRICS.values()):
        made[f"{metric.name} [{metric.unit}]"] = found.metrics[:, k]
    marks = np.arange(count)
    return {
        **made,
        "feasible": results.feasible,
        "front": np.isin(marks, results.front),
        "chosen": marks == (-1 if results.chosen is None else results.chosen),
    }


def write_results(results: Results, folder: Path) -> str:
    """Write designs.parquet, or designs.npz without pyarrow, completely or not at all. Returns the file's name."""
    made = columns(results)
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        with atomic_file(folder / "designs.npz") as temporary, temporary.open("wb") as stream:
            save: Any = np.savez_compressed
            save(stream, **made)
        return "designs.npz"
    arrow: Any = pyarrow
    writer: Any = parquet
    table = arrow.table({name: arrow.array(values) for name, values in made.items()})
    study = {"study": json.dumps(study_to_dict(results.study))}
    with atomic_file(folder / "designs.parquet") as temporary:
        writer.write_table(table.replace_schema_metadata(study), temporary)
    return "designs.parquet"
