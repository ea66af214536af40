"""Precomputed torque tables of one drawing, from which records are simulated within milliseconds."""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import stiffness_model
from stiffness_model import Drive, simulate

from . import drawings
from .elements import Array, draw_individual, element_torques, individual_torque, mean_torque, spread_elements

MODULI = np.array([0.5, 0.7, 0.85, 1.2, 1.5, 2.0])
"""Moduli of gear and cage, relative to the drawing, of the tables; interpolated by polynomials in the logarithm."""
RANGE = 1.8
"""Greatest contact twist of the tables, over the drawing's max_twist; chosen by judgement."""
N_SCATTER = 12
"""Individuals from which the size of the scatter is estimated; chosen by judgement."""
SCATTER_TURNS, SCATTER_NODES = 3, 60
"""Turns past the cage over which their torque is known, and its nodes in each. Chosen by judgement: the size of the
scatter is a mean over all of them."""


@dataclass(frozen=True)
class Tables:
    """Torque, N.m, of one drawing over contact twist x, rad, gear clearance c, m, and other variables.

    mean: (nx, nc) of the mean drive; absolute: (nx,) mean sum of the elements' absolute torques; softer:
    (len(MODULI), nx, nc) change of the torque at other moduli; element: (n_beta, nx, nc_coarse) mean torque of one
    element at `beta`; spread: standard deviation of individuals over their mean torque at full twist.
    scatter: (N_SCATTER, n_turn, nx) difference of individuals from the mean over `SCATTER_TURNS` turns.
    """

    drive: Drive
    x: Array
    c: Array
    mean: Array
    absolute: Array
    softer: Array
    beta: Array
    element: Array
    spread: float
    scatter: Array
    full_torque: float

    @property
    def full_twist(self) -> float:
        """The drawing's max_twist, rad at the output."""
        return self.drive.max_twist

    @property
    def per_twist(self) -> float:
        """Clearance that a twist takes up, m/rad."""
        return self.drive.eccentricity * abs(self.drive.ratio)


@functools.cache
def tables(index: int) -> Tables:
    """Tables of `drawings.DRAWINGS[index]`, from the temporary folder if the same code has made them before."""
    drive = drawings.load(index)
    digest = hashlib.sha256(drawings.DRAWINGS[index].toml.encode())
    own = [Path(__file__).with_name(name) for name in ("elements.py", "tables.py")]
    sources = [*Path(stiffness_model.__file__).parent.rglob("*.py"), *own]
    for source in sorted(sources):
        digest.update(source.read_bytes())
    path = Path(tempfile.gettempdir(), "reefmu-blind", f"{digest.hexdigest()[:24]}.npz")
    if path.is_file():
        with np.load(path) as data:
            return Tables(drive, **{k: v if v.ndim else float(v) for k, v in data.items()})
    made = _make(drive)
    path.parent.mkdir(exist_ok=True)
    part = path.with_name(f"{os.getpid()}-{path.name}")
    np.savez(part, **{k: v for k, v in vars(made).items() if k != "drive"})
    os.replace(part, path)
    return made


def _make(drive: Drive) -> Tables:
    full, per_twist = drive.max_twist, drive.eccentricity * abs(drive.ratio)
    # Contact begins gradually over the scatter of the clearances, which determines the step.
    scatter = np.sqrt(sum(drive.tolerances[part].sigma ** 2 for part in ("gear", "crank", "element")))
    half = np.linspace(0, RANGE * full, int(np.ceil(RANGE / np.clip(scatter / per_twist / full, 1 / 50, 1 / 26))) + 1)
    widest = 0.5 * per_twist * full
    c = np.linspace(-widest, widest, 2 * int(np.ceil(np.clip(widest / scatter, 8, 16))) + 1)
    x = np.concatenate([-half[:0:-1], half])
    both = [mean_torque(drive, half, shift) for shift in c]
    mean = _odd(np.stack([torque for torque, _ in both], -1))
    absolute = _even(both[len(c) // 2][1])
    coarse = np.linspace(-widest, widest, 9)
    softer = np.stack([_odd(_other_modulus(drive, factor, half, coarse)) for factor in MODULI])
    beta = np.linspace(-1, 1, 61) * drive.usable_limit
    few = np.linspace(-RANGE, RANGE, 73) * full
    element = np.stack(
        [
            np.stack([element_torques(drive, spread_elements(drive, 64, b), few, s).mean(axis=0) for s in coarse], -1)
            for b in beta
        ]
    )
    middle = mean[:, len(c) // 2]
    full_torque = float(np.interp(full, x, middle))
    population = simulate(drive, [full], 200, seed=1).torque[:, 0]
    return Tables(
        drive,
        x,
        c,
        mean,
        absolute,
        CubicSpline(coarse, softer, axis=2)(c),
        beta,
        CubicSpline(few, element, axis=1)(x),
        float(population.std() / full_torque),
        _scatter(drive, x, few, middle),
        full_torque,
    )


def _odd(half: Array) -> Array:
    return np.concatenate([-half[:0:-1], half])


def _even(half: Array) -> Array:
    return np.concatenate([half[:0:-1], half])


def _other_modulus(drive: Drive, factor: float, x: Array, c: Array) -> Array:
    """Change of the torque, (nx, nc), N.m, by another modulus of gear and cage, for the same elements."""
    materials = {
        part: replace(m, youngs_modulus=factor * m.youngs_modulus) if part in ("gear", "cage") else m
        for part, m in drive.materials.items()
    }
    other = replace(drive, materials=materials)
    return np.stack([mean_torque(other, x, s, 1024)[0] - mean_torque(drive, x, s, 1024)[0] for s in c], -1)


def _scatter(drive: Drive, x: Array, few: Array, mean: Array) -> Array:
    turn = np.arange(SCATTER_TURNS * SCATTER_NODES) * 2 * np.pi / SCATTER_NODES
    out = []
    for number in range(N_SCATTER):
        one = draw_individual(drive, np.random.default_rng(np.random.SeedSequence(7, spawn_key=(number,))))
        out.append(CubicSpline(few, individual_torque(drive, one, turn, few, 0.0), axis=1)(x) - mean)
    return np.array(out, dtype=np.float32)
