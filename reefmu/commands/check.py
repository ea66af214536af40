"""`reefmu check`: an FMU against the standard and against the Python model."""

from __future__ import annotations

import argparse

from reefmu.fmu.check import check_fmu


def run(args: argparse.Namespace) -> int:
    """Print the findings; 1 if one of them failed."""
    report = check_fmu(args.fmu)
    print(report)
    return 0 if report.passed else 1
