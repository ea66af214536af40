"""`reefmu check`: an FMU against the standard, the Python model and the masses it is to move."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from reefmu.fmu.validation.fmu_check import check_fmu
from stiffness_model.errors import expect


def run(args: argparse.Namespace) -> int:
    """Print the findings; 1 if one of them failed."""
    expect(
        args.inertia is not None or args.step is None,
        "--inertia beside --step: the masses decide on the step",
        "none",
        "check",
    )
    coupling = ()
    if args.inertia is not None:
        from .coupling import coupling_finding

        coupling = (coupling_finding(Path(args.fmu), args.step, args.inertia),)
    report = check_fmu(args.fmu)
    report = replace(report, results=(*report.results, *coupling))
    print(report)
    return 0 if report.passed else 1
