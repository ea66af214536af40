"""The files of a plan: protocol.csv, plan.json and plan.html, all of them or none."""

from __future__ import annotations

import os

from stiffness_model.io.atomic_files import staged_folder

from ..shortest_plan import Plan
from .protocol_table import protocol_csv
from .result import plan_json


def write_plan(plan: Plan, out: str | os.PathLike[str]) -> None:
    """Write the files into the folder `out`, which is created if necessary. Raises `InputError` if it cannot be
    written."""
    # Drawing the page loads matplotlib.
    from .plan_page import plan_html

    with staged_folder(out) as stage:
        (stage / "protocol.csv").write_text(protocol_csv(plan.schedule, plan.drive, plan.torque), encoding="utf-8")
        (stage / "plan.json").write_text(plan_json(plan), encoding="utf-8")
        (stage / "plan.html").write_text(plan_html(plan), encoding="utf-8")
