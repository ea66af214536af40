"""The command line: parse, call, print.

Every command is a parser here and a function `run(args) -> int` in a module of `reefmu.commands`, imported
when it is called: `reefmu --help` loads nothing heavier than argparse. Exit status 0 done, 1 a check failed,
2 the input or the call was wrong: then one line on stderr, no traceback, no half-written file. A signal ends a command
with one line too and status 128 + its number, and nothing is left behind.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NoReturn

from .interrupt import exit_status, signals_raised

if TYPE_CHECKING:
    # In the type checker only: at run time the class is private to argparse.
    Commands = argparse._SubParsersAction["_OneLineParser"]  # pyright: ignore[reportPrivateUsage]

DONE, FAILED, WRONG_INPUT = 0, 1, 2
GROUP_PAUSE = 0.2
"""Seconds between the first and the last process of a group that gets a signal, at most."""
MOST_DRIVES = 10_000_000
BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; `argv` without the program's name, default sys.argv."""
    with signals_raised(last=argv is None):
        try:
            return _run(argv)
        except KeyboardInterrupt as stop:
            return _complain("; ".join(["interrupted", *getattr(stop, "__notes__", ())]), exit_status(stop))


def _run(argv: Sequence[str] | None) -> int:
    for name in BLAS_THREADS:  # read when NumPy loads; processes share the cores, and threads would be in their way
        os.environ.setdefault(name, "1")
    try:
        if os.environ.get("SOURCE_DATE_EPOCH"):
            from datetime import UTC, datetime

            from .source_date import source_date

            source_date(datetime.now(UTC))
        args = build_parser().parse_args(argv)
        status = args.run(args)
        sys.stdout.flush()
        return status
    except BrokenPipeError:
        # The reader of our output has gone (`reefmu ... | head`): nothing is wrong, and nobody reads on.
        # What is still in the buffer would raise once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return _complain(str(error), WRONG_INPUT)
    except MemoryError as error:
        return _complain(f"not enough memory for this ({error})", WRONG_INPUT)
    except RuntimeError as error:
        from concurrent.futures import BrokenExecutor

        if not isinstance(error, BrokenExecutor):
            raise
        # A signal to all processes of a group may reach the workers first: then this one is interrupted here.
        time.sleep(GROUP_PAUSE)
        notes = getattr(error, "__notes__", ())
        return _complain("; ".join([f"the workers were lost ({error})", *notes]), FAILED)
    except ValueError as error:
        from stiffness_model.errors import InputError

        if not isinstance(error, InputError):
            raise
        return _complain(str(error), WRONG_INPUT)


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands; each leaves its function in `args.run`."""
    parser = _OneLineParser(
        prog="reefmu",
        description="Stiffness of rolling element eccentric drives: from a drawing to a "
        "curve, an FMU and a joint under control.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and leave")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (_add_demo, _add_curve, _add_compare, _add_export, _add_check, _add_diagnose, _add_draw, _add_explore):
        add(commands)
    return parser


def _add_demo(commands: Commands) -> None:
    parser = _command(
        commands,
        "demo",
        "the whole line for the drive workshop, from drawing to a joint under control",
        "Writes pictures, curve.csv and an FMU.",
    )
    parser.add_argument("--out", metavar="DIR", type=_name, help="folder for the files (default reefmu-demo)")


def _add_curve(commands: Commands) -> None:
    parser = _command(
        commands,
        "curve",
        "twist over torque, contact forces and load shares of a drawing",
        "Writes curve.csv, curve.png, forces.png and load_share.png.",
    )
    _add_study_options(parser, "curve")
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=_whole(0),
        help="one drive of the drawing beside the mean of all, turning: torque over twist and angle, "
        "transmission error, order spectra; writes individual_*.csv and .png",
    )


def _add_compare(commands: Commands) -> None:
    parser = _command(
        commands, "compare", "a drive's stiffness beside published gears", "Writes compare.csv and compare.png."
    )
    _add_study_options(parser, "compare")
    parser.add_argument("--catalog", metavar="FILE", help="TOML file with further gears, as catalog.toml")


def _add_export(commands: Commands) -> None:
    parser = _command(
        commands,
        "export",
        "a drawing or a model as an FMU",
        "Solves the lookup (some seconds, then cached) and writes an FMU.",
    )
    parser.add_argument("source", metavar="DRIVE|MODEL.toml", help="a preset, a TOML drawing or a TOML model")
    parser.add_argument("-o", "--output", metavar="FILE.fmu", type=_name, required=True, help="the FMU to write")
    parser.add_argument(
        "--kind",
        choices=("drive", "joint"),
        default="drive",
        help="drive: angles in, torques out (default); joint: with motor and load inertia inside, "
        "torques in, angles out",
    )
    for name, unit in (
        ("motor-inertia", "kg.m2"),
        ("load-inertia", "kg.m2"),
        ("motor-damping", "N.m.s/rad"),
        ("load-damping", "N.m.s/rad"),
    ):
        parser.add_argument(
            f"--{name}",
            metavar="X",
            type=float,
            help=f"of a joint, {unit}: its start value; around a "
            "drive: warns of a communication step too long for the spring",
        )
    parser.add_argument(
        "--step", metavar="S", type=float, default=1e-3, help="communication step, s, to warn of (default 0.001)"
    )
    parser.add_argument(
        "--backend",
        choices=("python", "native"),
        help="native: compiled, needs nothing, co-simulation and model exchange (default where a "
        "compiler is there); python: runs in the host's Python with reefmu installed",
    )
    parser.add_argument(
        "--platform",
        metavar="NAME",
        help="of a native FMU: linux64, linux-arm64, win64, darwin64, "
        "all, or none for sources alone (default: this machine's)",
    )
    parser.add_argument(
        "--fmi",
        choices=("2", "3"),
        default="2",
        help="version of the standard: 2.0 (default) or, not with --backend python, 3.0",
    )
    parser.add_argument(
        "--effect",
        metavar="NAME[.PARAMETER=VALUE]",
        action="append",
        default=[],
        help="put an effect inside, neutral or with a value: --effect creep --effect backlash.clearance='5 um'",
    )
    _add_set(parser)
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=_whole(0),
        help="one drive of the drawing with its own parts, whose torque changes as it turns, instead "
        "of the mean of all",
    )
    parser.add_argument(
        "--drives",
        metavar="N",
        type=_whole(1, MOST_DRIVES),
        help="virtual drives behind the lookup's band, forces and load share",
    )
    parser.add_argument("--seed", metavar="S", type=_whole(0), default=0, help="seed of the tolerances (default 0)")


def _add_check(commands: Commands) -> None:
    parser = _command(
        commands, "check", "an FMU against the standard and the Python model", "Exit status 1 if something differs."
    )
    parser.add_argument("fmu", metavar="FILE.fmu", help="an FMU that `reefmu export` wrote")
    parser.add_argument(
        "--inertia",
        metavar="J",
        type=float,
        help="of motor and load against each other, kg.m2 at the "
        "output: is the communication step too coarse for the drive's spring between them?",
    )
    parser.add_argument(
        "--step", metavar="S", type=float, help="that communication step, s (default: the one the FMU proposes)"
    )


def _add_diagnose(commands: Commands) -> None:
    parser = _command(
        commands,
        "diagnose",
        "what a measured record says that the model does not know",
        "Names missing effects, fits them, and says so when it cannot know. Writes diagnosis.json, "
        "report.html and model.toml.",
    )
    parser.add_argument(
        "records",
        metavar="RECORD",
        nargs="+",
        help="measured records, .csv or .csv.gz with `name [unit]` headers; several give a table",
    )
    base = parser.add_mutually_exclusive_group(required=True)
    base.add_argument("--drive", metavar="DRIVE", help="the drive's drawing: a preset or a TOML file")
    base.add_argument("--curve", metavar="CURVE.csv", help="a twist-torque curve, for a gear without a drawing")
    base.add_argument("--power-law", action="store_true", help="neither: fit a power law as the base curve")
    parser.add_argument(
        "--exponent",
        metavar="X|shared",
        help="of the power law, which then has a dead band: a "
        "number, or one within 1 ... 2 that all records share (default: free)",
    )
    parser.add_argument(
        "--locked",
        choices=("crank", "output"),
        default="crank",
        help="what the rig locks, for records of a twist alone (default crank)",
    )
    parser.add_argument("--out", metavar="DIR", type=_name, required=True, help="folder for the results")
    parser.add_argument("--columns", metavar="FILE", help='TOML column map for foreign files: TIME = "time [s]"')
    parser.add_argument(
        "--column",
        metavar="FOREIGN=NAME",
        type=_field,
        action="append",
        default=[],
        help="one column of the map: --column 'TIME=time [s]'",
    )


def _add_draw(commands: Commands) -> None:
    parser = _command(
        commands,
        "draw",
        "a drawing to scale: the drive, its contact forces, a turn, the workshop's DXF",
        "Writes drive.png and forces.png; turn.gif and profile.dxf where asked for.",
    )
    _add_drawing_options(parser, "draw")
    parser.add_argument(
        "--twist",
        metavar="ARCMIN",
        type=float,
        help="twist at the output under which the forces are drawn (default the drawing's max_twist)",
    )
    parser.add_argument(
        "--angle", metavar="DEG", type=float, default=0.0, help="angle of the first eccentric (default 0)"
    )
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=_whole(0),
        help="forces of one drive of the drawing, that of `curve --individual SEED` (default: one without deviations)",
    )
    parser.add_argument(
        "--exaggerate",
        metavar="N",
        type=float,
        default=1.0,
        help="in forces.png, draw deviations and displacements N times as large (default 1: to scale)",
    )
    parser.add_argument("--animate", action="store_true", help="write turn.gif: one period of the motion")
    parser.add_argument("--dxf", action="store_true", help="write profile.dxf: gear profile and bores in mm")
    parser.add_argument(
        "--chord",
        metavar="UM",
        type=float,
        default=0.1,
        help="greatest distance of the DXF's polyline from the profile, um (default 0.1)",
    )


def _add_explore(commands: Commands) -> None:
    parser = _command(
        commands,
        "explore",
        "a design study: parameters with ranges to a Pareto front and a drawing",
        "Writes designs.parquet, pareto.png, trade_off.png, effects.png and chosen.toml; stopped, it "
        "goes on where it was. Exit status 1 if no design can be chosen.",
    )
    parser.add_argument(
        "study", metavar="STUDY.toml", help="a study, or one that comes along: tolerance_field, geometry"
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=_whole(1, 4096), help="processes (default: all cores)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a running dask scheduler, tcp://host:8786")
    parser.add_argument(
        "--out", metavar="DIR", type=_name, required=True, help="folder for the results and for what is half done"
    )


def _command(commands: Commands, name: str, summary: str, writes: str) -> argparse.ArgumentParser:
    """A parser whose `args.run` imports `reefmu.commands.<name>` and calls its `run`."""
    description = f"{summary[0].upper()}{summary[1:]}. {writes}"
    parser = commands.add_parser(name, help=summary, description=description)

    def run(args: argparse.Namespace) -> int:
        from importlib import import_module

        module = import_module(f"reefmu.commands.{name}")
        with import_module("reefmu.commands.notes").shown():
            return module.run(args)

    parser.set_defaults(run=run)
    return parser


def _add_study_options(parser: argparse.ArgumentParser, name: str) -> None:
    """Options of the commands that simulate a population of one drive."""
    _add_drawing_options(parser, name)
    parser.add_argument(
        "--drives", metavar="N", type=_whole(1, MOST_DRIVES), default=1000, help="virtual drives (default 1000)"
    )
    parser.add_argument("--seed", metavar="S", type=_whole(0), default=0, help="seed of the tolerances (default 0)")


def _add_drawing_options(parser: argparse.ArgumentParser, name: str) -> None:
    """Options of the commands that work on one drawing."""
    parser.add_argument(
        "drive", metavar="DRIVE", help="a preset (drive_1, drive_2, drive_3, workshop) or a TOML drawing"
    )
    _add_set(parser)
    parser.add_argument("--out", metavar="DIR", type=_name, help=f"folder for the files (default DRIVE-{name})")


def _add_set(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        metavar="FIELD=VALUE",
        dest="fields",
        type=_field,
        action="append",
        default=[],
        help="override a field of the drawing: --set lobes=28 --set crank_radius='41 mm'",
    )


def _whole(low: int, high: int | None = None) -> Callable[[str], int]:
    span = f"of at least {low}" if high is None else f"from {low} to {high}"

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if value < low or (high is not None and value > high):
            raise argparse.ArgumentTypeError(f"expected a whole number {span}, got {text!r}")
        return value

    return parse


def _name(text: str) -> str:
    """A name of a file or folder to write. An empty one, of a shell's unset variable, would be the folder we are in."""
    if not text.strip():
        raise argparse.ArgumentTypeError(f"expected a name, got {text!r}")
    return text


def _field(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (equals and name.strip() and value.strip()):
        raise argparse.ArgumentTypeError(f"expected FIELD=VALUE, such as lobes=28, got {text!r}")
    return name.strip(), value.strip()


def _complain(message: str, status: int) -> int:
    print("reefmu: " + " ".join(message.split("\n")), file=sys.stderr)
    return status


class _OneLineParser(argparse.ArgumentParser):
    """Says in one line what is wrong with a call, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix("reefmu").strip()
        self.exit(_complain((f"{command}: " if command else "") + message, WRONG_INPUT))


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from . import __version__

        print(f"reefmu {__version__}")
        parser.exit()
