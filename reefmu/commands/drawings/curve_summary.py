"""The results of `reefmu curve` as plain tables, for `--json`."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiffness_model.kinds import TOLERANCES, AnyDrive, lacking
from stiffness_model.montecarlo.population import Population
from stiffness_model.montecarlo.twist_torque_curve import TwistTorqueCurve
from stiffness_model.units import ARCMIN

from .load_ratings import LoadRatings


def curve_summary(
    drive: AnyDrive, curve: TwistTorqueCurve, population: Population, ratings: LoadRatings | None
) -> dict[str, Any]:
    """Name, kind, population, main figures and the columns of curve.csv, by names with their units.

    ratings: of the loads; None for a drive of another kind. A drive without tolerances has no number of drives.
    """
    last = int(np.argmax(curve.twist))
    columns = {**curve.columns(), **(ratings.columns() if ratings is not None else {})}
    return {
        "name": drive.name,
        "kind": drive.kind,
        "ratio [1]": drive.ratio,
        "drives": None if lacking(drive, TOLERANCES) else population.n_drives,
        "seed": None if lacking(drive, TOLERANCES) else population.seed,
        "max_twist [arcmin]": drive.max_twist / ARCMIN,
        "full_torque [N.m]": curve.full_torque,
        "full_torque_p10 [N.m]": float(curve.torque_p10[last]),
        "full_torque_p90 [N.m]": float(curve.torque_p90[last]),
        "stiffness_at_full_torque [N.m/arcmin]": float(curve.stiffness[last] * ARCMIN),
        "backlash [arcmin]": curve.backlash() / ARCMIN,
        "lost_motion [arcmin]": curve.lost_motion() / ARCMIN,
        "remarks": population.lines() if ratings is None else ratings.lines(),
        "columns": columns,
    }
