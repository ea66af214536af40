"""Damaged FMUs: `reefmu check` must answer each of them in one line.

    python tests/fuzz/fuzz_fmu.py --seed 1 --count 1000

changes one member at a time of an FMU of either back end and prints what was no `InputError` of one line: other
exceptions, warnings, and answers that took long. Exit status 1 if there was any. Nothing of an FMU is run here but
what `reefmu check` reads before it loads a library.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import random
import re
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from reefmu.commands.fmus.coupling_step import check_coupling
from reefmu.fmu.export import export_fmu
from reefmu.fmu.python_backend.equations_file import EQUATIONS_FILE, read_equations
from reefmu.fmu.validation.fmu_check import embedded_component
from reefmu.fmu.validation.reference_run import make_excitation
from reefmu.fmu.validation.static_checks import check_declaration, check_standard, declared_variables
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError

LONG = 20.0
"""s: an answer that takes longer is a finding; that of a correct FMU takes some tenths. Chosen by judgement."""
VALUES: tuple[Any, ...] = (
    None,
    True,
    "",
    "x",
    "1",
    [],
    {},
    [1],
    {"a": 1},
    0,
    -1,
    1,
    3,
    0.5,
    1e-300,
    -1e300,
    1e308,
    math.nan,
    math.inf,
    -math.inf,
    10**9,
    10**30,
    [[[]]],
    "\n",
    "é" * 50,
)
WORDS = (
    "0",
    "-1",
    "1",
    "8",
    "100000000",
    "99999999999999999999",
    "nan",
    "inf",
    "1e308",
    "-1e308",
    "1e-300",
    '""',
    '"x"',
    "{}",
    "[]",
    "[1, 2]",
    "true",
    "{0.1}",
    '"1 m"',
    '"nan N.m"',
    '"1e400 m"',
    "",
    "1.2.3",
    '"1.2.3 m"',
)


@dataclass(frozen=True)
class Finding:
    """A case with a wrong answer."""

    case: int
    what: str
    came: str


def examine(path: Path) -> None:
    """All that `reefmu check --inertia` does before it loads the library."""
    file = read_archive(path)
    component = embedded_component(file)
    check_standard(file)
    check_declaration(file, declared_variables(file, component))
    make_excitation(component)
    if file.kind == "drive":
        check_coupling(path, 1e-3, 0.08)
    if f"resources/{EQUATIONS_FILE}" in file.members:
        with zipfile.ZipFile(path) as archive:
            read_equations(archive.read(f"resources/{EQUATIONS_FILE}"), str(path))


def complaint(path: Path, run: Callable[[Path], None] = examine) -> str:
    """The error in the answer to this file; empty if there is none."""
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run(path)
    except InputError as error:
        if "\n" in str(error) or len(str(error)) > 2000:
            return f"an InputError of {len(str(error))} characters: {str(error)[:200]!r}"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:200]} ({Path(place.filename).name}:{place.lineno})"
    took = time.perf_counter() - begin
    return f"{took:.0f} s" if took > LONG else ""


# --- changes: (random, content) -> content ------------------------------------------------------------------


def change_bytes(chance: random.Random, content: bytes) -> bytes:
    """Truncate, overwrite, repeat or replace a part."""
    kind, at = chance.randrange(5), chance.randrange(max(1, len(content)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + chance.randbytes(chance.randrange(1, 9)) + content[at + 8 :]
    if kind == 2:
        return content + content[:at]
    if kind == 3:
        return chance.choice([b"", b"\x00", b"\xff\xfe", b"[" * 50000, b"a = " + b"[" * 50000, b"<a>" * 20000, b"null"])
    return content.replace(chance.choice([b"1", b".", b'"', b"="]), chance.choice([b"", b"9", b"-", b"\n"]), 3)


def change_tree(chance: random.Random, tree: Any) -> Any:
    """Replace or remove one value in a tree of dicts and lists."""
    if isinstance(tree, dict) and tree and chance.random() < 0.9:
        key = chance.choice(sorted(tree))
        if chance.random() < 0.2:
            return {name: value for name, value in tree.items() if name != key}
        return tree | {key: change_tree(chance, tree[key])}
    if isinstance(tree, list) and tree and chance.random() < 0.7:
        at = chance.randrange(len(tree))
        return [*tree[:at], change_tree(chance, tree[at]), *tree[at + 1 :]]
    return chance.choice(VALUES)


def change_json(chance: random.Random, content: bytes) -> bytes:
    return json.dumps(change_tree(chance, json.loads(content))).encode()


def change_npz(chance: random.Random, content: bytes) -> bytes:
    """Another header, another array, or an array whose header states another size."""
    with np.load(io.BytesIO(content)) as data:
        head, arrays = json.loads(str(data["head"])), {name: data[name] for name in data.files if name != "head"}
    name = chance.choice(sorted(arrays))
    a = arrays[name]
    kind = chance.randrange(4)
    if kind == 0:
        head = change_tree(chance, head)
    elif kind == 1:
        arrays[name] = chance.choice(
            [
                a.astype(complex),
                a.astype(str),
                a.astype(np.int32),
                a.astype(bool),
                a[0],
                a[..., :-1],
                a[:0],
                a.ravel(),
                a * math.nan,
                a * 1e300,
                a * 0,
                -a,
                a[None],
            ]
        )
    elif kind == 2:
        arrays = {f"{other}{'x' * (other == name)}": value for other, value in arrays.items()}
    file = io.BytesIO()
    np.savez(file, head=np.array(json.dumps(head)), **arrays)
    if kind != 3:
        return file.getvalue()
    lied = io.BytesIO()
    with zipfile.ZipFile(file) as source, zipfile.ZipFile(lied, "w") as copy:
        for member in source.namelist():
            size = chance.choice([b"(500000000000,)", b"(-1,)", b"(2, 3)", b"()", b"'x'"])
            header = re.sub(rb"'shape': \(.*?\)(, \})", rb"'shape': " + size + rb"\1", source.read(member), count=1)
            copy.writestr(member, header)
    return lied.getvalue()


def change_words(chance: random.Random, content: bytes) -> bytes:
    """Another value in a TOML file, a C header or an XML attribute."""
    text = content.decode("utf-8")
    pattern = r'(?m)(?<== ).+$|(?<=#define )[A-Z_]+ .+$|(?<==")[^"]*(?=")'
    found = chance.choice(list(re.finditer(pattern, text)) or [re.match("", text)])
    assert found is not None
    word = chance.choice(WORDS)
    if text[found.start() - 1 : found.start()] == '"':
        word = word.replace('"', "").replace("<", "")
    elif text[: found.start()].endswith("#define "):
        word = f"{found[0].split()[0]} {word}"
    return (text[: found.start()] + word + text[found.end() :]).encode()


def change_xml(chance: random.Random, content: bytes) -> bytes:
    """Another structure of the document."""
    end = content.rindex(b"</fmiModelDescription>")
    return chance.choice(
        [
            content.replace(b"UTF-8", chance.choice([b"klingon", b"utf-7", b"rot13", b"idna", b"ascii"]), 1),
            content[:end] + b"<a>" * chance.choice([90, 300, 20000]),
            content[:end] + b"<a>" * 20000 + b"</a>" * 20000 + content[end:],
            re.sub(rb"<ModelVariables>.*</ModelVariables>", b"", content, flags=re.DOTALL),
            content.replace(b"<Real ", b"<Integer "),
            content.replace(b"ScalarVariable", b"x:y"),
            content.replace(b"<fmiModelDescription ", b"<fmiModelDescription xmlns='urn:x' ", 1),
        ]
    )


def changes_of(name: str) -> tuple[Callable[[random.Random, bytes], bytes], ...]:
    """The changes that apply to a member."""
    by_end = {
        ".json": (change_json,) * 4,
        ".npz": (change_npz,) * 4,
        ".toml": (change_words,) * 4,
        ".h": (change_words,) * 4,
        ".xml": (change_words, change_words, change_xml),
    }
    return (change_bytes, *by_end.get(Path(name).suffix, ()))


def damaged(members: Mapping[str, bytes], chance: random.Random) -> tuple[str, dict[str, bytes]]:
    """A description of the damage, and the members with it."""
    wanted = (
        "modelDescription.xml",
        "resources/model.toml",
        "resources/joint.toml",
        "resources/lookup.json",
        "resources/lookup.npz",
        "resources/equations.json",
        "sources/tables.h",
    )
    name = chance.choice([member for member in wanted if member in members])
    if chance.random() < 0.02:
        return f"{name} taken away", {member: data for member, data in members.items() if member != name}
    change = chance.choice(changes_of(name))
    return f"{name} by {change.__name__}", {**members, name: change(chance, members[name])}


def findings(bases: Mapping[str, Mapping[str, bytes]], seed: int, count: int, folder: Path) -> list[Finding]:
    """`count` damaged FMUs, the same for the same seed, and the errors in the answers."""
    found: list[Finding] = []
    path = folder / "damaged.fmu"
    for case in range(count):
        chance = random.Random(f"{seed} {case}")
        base = chance.choice(sorted(bases))
        what, members = damaged(bases[base], chance)
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in members.items():
                archive.writestr(name, content)
        if came := complaint(path):
            found.append(Finding(case, f"{base}, {what}", came))
    return found


def members_of(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def make_bases(model: DriveModel, folder: Path) -> dict[str, dict[str, bytes]]:
    """FMUs of a model by both back ends (sources alone, no compiler needed) and a joint."""
    masses = Masses(1e-4, 2.0)
    return {
        "python": members_of(export_fmu(model, folder / "p.fmu", backend="python")),
        "joint": members_of(export_fmu(model, folder / "j.fmu", backend="python", masses=masses)),
        "native": members_of(export_fmu(model, folder / "n.fmu", backend="native", platform="none")),
    }


def main() -> int:
    """Make the FMUs, damage them, and print the findings."""
    parser = argparse.ArgumentParser(description="Damaged FMUs for `reefmu check`")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=1000)
    args = parser.parse_args()
    import stiffness_model as sm

    warnings.simplefilter("ignore")
    effects = {"hysteresis": {"torque": 2.0}, "missing_ball": {}, "modulus_error": {}, "creep": {}}
    model = build_model(sm.load_drive("drive_1"), effects, n_drives=16)
    with tempfile.TemporaryDirectory(prefix="fuzz-fmu-") as folder:
        found = findings(make_bases(model, Path(folder)), args.seed, args.count, Path(folder))
    for one in found:
        print(f"case {one.case}: {one.what}: {one.came}")
    print(f"{len(found)} findings in {args.count} cases of seed {args.seed}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
