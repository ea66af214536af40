"""`reefmu check`: an FMU compared with the standard and the Python model, and its step with the masses around it."""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
from pathlib import Path

from reefmu.fmu.validation.fmu_check import check_fmu
from stiffness_model.errors import expect

from ..terminal.json_output import print_json


def run(args: argparse.Namespace) -> int:
    """Print the results; the exit status is 1 if one of them failed."""
    expect(
        args.inertia is not None or args.step is None,
        "--inertia beside --step, because the masses limit the step",
        "none",
        "check",
    )
    coupling = ()
    if args.inertia is not None:
        from .coupling_step import check_coupling

        coupling = (check_coupling(Path(args.fmu), args.step, args.inertia),)
    report = check_fmu(args.fmu)
    report = replace(report, results=(*report.results, *coupling))
    if args.json:
        results = [asdict(result) for result in report.results]
        print_json({"file": str(report.path), "passed": report.passed, "results": results})
    else:
        print(report)
    return 0 if report.passed else 1
