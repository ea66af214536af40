"""`reefmu plan`: the shortest test protocol that separates the effects of interest on a rig."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from reefmu.effects import find_effect
from reefmu.model.contacts.tables import cached_lookup
from reefmu.planning.plan_report.plan_files import write_plan
from reefmu.planning.plan_report.result import summary, untold_text
from reefmu.planning.protocols.rig import Rig, expect_minutes, load_rig
from reefmu.planning.shortest_plan import Plan, make_plan
from reefmu.progress import Progress
from stiffness_model.kinds import CONTACT_RESPONSES

from ..terminal.drawing_input import ree_drawing_with_fields
from ..terminal.notes import show_notes
from ..terminal.worker_processes import pool_with_progress, process_pool


def run(args: argparse.Namespace) -> int:
    """Plan the protocol, print what it tells and what not, and write the files into the folder."""
    rig = Rig() if args.rig is None else load_rig(args.rig)
    if args.minutes is not None:
        rig = replace(rig, minutes=expect_minutes(args.minutes, "--minutes"))
    for name in args.effects or ():
        find_effect(name, "--effects")
    drive, notes = ree_drawing_with_fields(args.drive, args.fields, "plan", CONTACT_RESPONSES)
    folder = Path(args.out)
    with pool_with_progress("solving the lookup (once: it is cached)") as executor:
        cached_lookup(drive, executor=executor)
    with process_pool() as pool, Progress(f"planning a test of {drive.name}", 100) as progress:
        plan = make_plan(drive, rig, args.effects, lambda stage, share: progress.advance_to(share, stage), pool.map)
        write_plan(plan, folder)
    show_notes(notes)
    print(summary(plan))
    print("\n".join(_not_told(plan)))
    print(f"\nwritten to {folder}: protocol.csv, plan.json, plan.html")
    return 0


def _not_told(plan: Plan) -> list[str]:
    """One line for each pair that the protocol does not separate, and for each effect that is no candidate."""
    lines = [f"  {untold_text(remedy)}" for remedy in plan.remedies]
    return lines + [f"  {name} is no candidate: {reason}" for name, reason in plan.excluded.items()]
