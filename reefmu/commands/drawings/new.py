"""`reefmu new`: a drawing to edit, with every field explained."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.io.atomic_files import atomic_file
from stiffness_model.io.new_drawing import new_drawing
from stiffness_model.kinds import KINDS, Kind


def run(args: argparse.Namespace) -> int:
    """Write the drawing, and print what to do with it."""
    path, kind = Path(args.file), _kind(args.kind)
    expect(path.suffix == ".toml", "a file name that ends in .toml", str(path), "new")
    if path.exists() and not args.force:
        raise InputError(f"{path}: expected the name of a new file, got one that exists; --force replaces it")
    with atomic_file(path) as temporary:
        temporary.write_text(new_drawing(kind, path.stem), encoding="utf-8")
    print(f"written to {path}: {kind.noun} with the values of {kind.example}")
    print(f"edit it, then: {shlex.join(['reefmu', 'curve', str(path)])}")
    return 0


def _kind(name: str) -> Kind:
    """The kind of that name, whose words may be joined by hyphens or underscores."""
    plain = name.replace("-", " ").replace("_", " ")
    if plain not in KINDS:
        raise unknown_name("kind", name, KINDS, "--kind")
    return KINDS[plain]
