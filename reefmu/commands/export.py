"""`reefmu export`: a drawing or a model becomes an FMU."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

from reefmu.fmu.build import export_fmu
from reefmu.model import DriveModel, build_model
from reefmu.model_file import is_model_file, load_model
from stiffness_model.drawing_file import load_drive
from stiffness_model.errors import expect
from stiffness_model.lookup import N_DRIVES, describe

from . import study


def run(args: argparse.Namespace) -> int:
    """Write the FMU and print what it holds."""
    target = Path(args.output)
    expect(target.suffix == ".fmu", "a file name that ends in .fmu", str(target), "--output")
    expect(target.parent.is_dir(), "an existing folder for the FMU", str(target.parent), "--output")
    model, notes = load(args)
    export_fmu(model, target)
    study.show_notes(notes)
    print(f"{model.name}: lookup over {describe(model.lookup)}")
    inside = ", ".join(effect.name for effect in model.effects) or "none"
    print(f"effects inside: {inside}")
    print(f"written to {target}: FMI 2.0 co-simulation, kind drive, {target.stat().st_size / 1024:.0f} kB; "
          "its host needs Python with reefmu")
    return 0


def load(args: argparse.Namespace) -> tuple[DriveModel, list[str]]:
    """The model that a drawing or a model.toml asks for, with the effects of `--effect`, and notes on it."""
    with warnings.catch_warnings(record=True) as caught, study.all_cores("solving the lookup") as executor:
        warnings.simplefilter("always")
        if is_model_file(args.source):
            expect(not args.effect, "no --effect beside a model file, which names its own", args.effect, "--effect")
            model = load_model(args.source, executor=executor)
        else:
            model = build_model(load_drive(args.source), {name: {} for name in args.effect},
                                n_drives=args.drives or N_DRIVES, seed=args.seed, executor=executor)
    return model, list(dict.fromkeys(str(warning.message) for warning in caught))
