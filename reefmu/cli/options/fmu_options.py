"""Options of the commands that write or read an FMU: export, check."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..argument_types import MAX_DRIVES, add_command, add_fields, add_json, add_seed, file_name, quantity, whole_number

if TYPE_CHECKING:
    from ..argument_types import Commands


def add_export(commands: Commands) -> None:
    """`reefmu export`."""
    parser = add_command(
        commands,
        "fmus",
        "export",
        "a drawing or a model as an FMU, or as a plugin of the simulator MuJoCo",
        "Solves the lookup (some seconds, then cached) and writes an FMU, or a folder with the plugin.",
    )
    parser.add_argument(
        "source", metavar="DRIVE|MODEL.toml", help="a preset, a gear of `reefmu gears`, a TOML drawing or a TOML model"
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE.fmu|DIR",
        type=file_name,
        required=True,
        help="the FMU to write; with --to mujoco the folder, whose name is the plugin's",
    )
    parser.add_argument(
        "--to",
        choices=("fmu", "mujoco"),
        default="fmu",
        help="fmu (default); mujoco: a plugin, with the model of one joint (MJCF); needs MuJoCo and a C compiler",
    )
    parser.add_argument(
        "--ssp",
        action="store_true",
        help="write a system instead (FILE.ssp, SSP 1.0): the drive, or a joint connected with a controller of its "
        "motor, with sets of parameters",
    )
    parser.add_argument(
        "--kind",
        choices=("drive", "joint"),
        default="drive",
        help="drive: angles in, torques out (default); joint: with the inertias of motor and load, "
        "torques in, angles out",
    )
    for name, kind, unit in (
        ("motor-inertia", "moment of inertia", "kg.m2"),
        ("load-inertia", "moment of inertia", "kg.m2"),
        ("motor-damping", "rotational damping", "N.m.s/rad"),
        ("load-damping", "rotational damping", "N.m.s/rad"),
    ):
        parser.add_argument(
            f"--{name}",
            metavar="X",
            type=quantity(kind, unit),
            help=f"start value of a joint's parameter, {unit} or with its unit; with --kind drive, to warn of a "
            "communication step that is too long for the drive's spring",
        )
    parser.add_argument(
        "--load",
        metavar="N.m",
        type=quantity("torque", "N.m"),
        help="torque on the output under which a simulation with the FMU's parameter set loaded.ssv starts in "
        "equilibrium (default: half the full torque)",
    )
    parser.add_argument(
        "--step",
        metavar="S",
        type=quantity("time", "s"),
        help="communication step, s, that these warnings are about (default 0.001); with --to mujoco the time step for "
        "which the joint is made stable (default 0.002)",
    )
    parser.add_argument(
        "--backend",
        choices=("python", "native"),
        help="native: compiled, for co-simulation and model exchange in any host (default where there is a "
        "compiler); python: runs in the host's Python with reefmu installed",
    )
    parser.add_argument(
        "--platform",
        metavar="NAME",
        help="platform of a native FMU: linux64, linux-arm64, win64, darwin64, "
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
        help="include an effect, neutral or with a value: --effect creep --effect backlash.clearance='5 um'",
    )
    add_fields(parser)
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=whole_number(0),
        help="one virtual drive with its own deviations, whose torque ripples as it turns, instead of the mean drive",
    )
    parser.add_argument(
        "--drives",
        metavar="N",
        type=whole_number(1, MAX_DRIVES),
        help="virtual drives from which the lookup's band, forces and load share are computed",
    )
    add_seed(parser)


def add_check(commands: Commands) -> None:
    """`reefmu check`."""
    parser = add_command(
        commands,
        "fmus",
        "check",
        "an FMU compared with the standard and the Python model",
        "Exit status 1 if something differs.",
    )
    parser.add_argument("fmu", metavar="FILE.fmu", help="an FMU that `reefmu export` wrote")
    parser.add_argument(
        "--inertia",
        metavar="J",
        type=quantity("moment of inertia", "kg.m2"),
        help="reduced inertia of motor and load, kg.m2 at the output: is the communication step "
        "short enough for the drive's spring between them?",
    )
    parser.add_argument(
        "--step",
        metavar="S",
        type=quantity("time", "s"),
        help="communication step, s (default: the one the FMU proposes)",
    )
    add_json(parser)
