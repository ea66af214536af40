"""The results of `reefmu curve` as plain tables, for `--json`."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiffness_model.kinds import TOLERANCES, AnyDrive, lacking
from stiffness_model.montecarlo.population import Population
from stiffness_model.montecarlo.twist_torque_curve import TwistTorqueCurve
from stiffness_model.units import ARCMIN

from .load_ratings import LoadRatings


def play(drive: AnyDrive, curve: TwistTorqueCurve) -> float | None:
    """The width of the play, rad; None for a data sheet, whose curve rises from zero and states nothing of a play."""
    return None if lacking(drive, TOLERANCES) else curve.backlash()


def curve_summary(
    drive: AnyDrive, curve: TwistTorqueCurve, population: Population, ratings: LoadRatings | None
) -> dict[str, Any]:
    """Name, kind, population, main figures and the columns of curve.csv, by names with their units.

    ratings: of the loads; None for a drive of another kind. A drive without tolerances has neither a number of drives
    nor a band.
    """
    scatters, width = not lacking(drive, TOLERANCES), play(drive, curve)
    last = int(np.argmax(curve.twist))
    columns = {**curve.columns(), **(ratings.columns() if ratings is not None else {})}
    return {
        "name": drive.name,
        "kind": drive.kind,
        "ratio [1]": drive.ratio,
        "drives": population.n_drives if scatters else None,
        "seed": population.seed if scatters else None,
        "max_twist [arcmin]": drive.max_twist / ARCMIN,
        "full_torque [N.m]": curve.full_torque,
        "full_torque_p10 [N.m]": float(curve.torque_p10[last]) if scatters else None,
        "full_torque_p90 [N.m]": float(curve.torque_p90[last]) if scatters else None,
        "stiffness_at_full_torque [N.m/arcmin]": float(curve.stiffness[last] * ARCMIN),
        "play [arcmin]": None if width is None else width / ARCMIN,
        "lost_motion [arcmin]": curve.lost_motion() / ARCMIN,
        "remarks": population.lines() if ratings is None else ratings.lines(),
        "columns": columns,
    }
