"""Tolerance scatter: how individual drives of one drawing differ from the mean, over twist and crank phase.

An individual turns: every ball, bore and eccentric keeps its deviation while beta moves with the crank. The maps
of some hundred individuals over one turn are computed once for a drawing and kept on disk.

Where the first ball of a drive stands is random, so that the scatter is stationary in the phase: its principal
components are harmonics of the phase times profiles over the twist, and those come from all individuals. What
stems from balls and bores repeats with the crank's angle past the cage, what stems from the lobes with the
crank's angle in the gear; after a turn of the crank the two have moved apart by one part in the ratio.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from stiffness_model import sampling
from stiffness_model.contacts import build_contacts, usable
from stiffness_model.drive import Drive
from stiffness_model.equilibrium import solve
from stiffness_model.errors import InputError
from stiffness_model.files import whole_file
from stiffness_model.geometry import wrap

from ..tables import cache_folder, fingerprint  # pyright: ignore[reportPrivateUsage]

Array = NDArray[np.float64]

INDIVIDUALS = 128
HELD_BACK = 48
"""Individuals that calibrate thresholds and are kept out of the components."""
PHASES = 192
"""Enough for the order at which single elements come and go, 87 in the presets."""
TWISTS = 33
REACH = 1.3
"""Greatest twist of the maps over the drawing's max_twist; beyond, they are held."""
_ELEMENTS_AT_ONCE = 6000


@dataclass(frozen=True)
class ScatterMaps:
    """Torque of individuals less their mean, (individual, phase, twist), N.m.

    twist: (n_twist,) rad, uniform; phases are uniform over a turn of the crank.
    """

    twist: Array
    deviation: NDArray[np.float32]

    def along(self, twist: Array) -> Array:
        """Weights (n, n_twist) that interpolate a profile at n twists by cubic splines, held beyond the ends."""
        inside = np.clip(twist, self.twist[0], self.twist[-1])
        return CubicSpline(self.twist, np.eye(len(self.twist)), bc_type="natural")(inside)

    def at(self, individuals: NDArray[np.intp], twist: Array, phase: Array, shift: Array) -> Array:
        """Deviations at n points of some individuals, each turned by its own shift (rad): (m, n) N.m."""
        weights = self.along(twist).astype(np.float32)
        n_phase = self.deviation.shape[1]
        result = np.empty((len(individuals), len(twist)))
        for row, (individual, turn) in enumerate(zip(individuals, shift, strict=True)):
            v = ((phase + turn) / (2 * np.pi) % 1.0) * n_phase
            k = v.astype(np.intp) % n_phase
            g = v - np.floor(v)
            table = self.deviation[individual]
            low = np.einsum("nt,nt->n", table[k], weights)
            result[row] = low * (1 - g) + np.einsum("nt,nt->n", table[(k + 1) % n_phase], weights) * g
        return result


def individual_maps(drive: Drive, individuals: int = INDIVIDUALS, phases: int = PHASES, twists: int = TWISTS,
                    seed: int = 1) -> ScatterMaps:
    """Solve the individuals over twist and crank phase (some seconds)."""
    twist = np.linspace(-REACH, REACH, twists) * drive.max_twist
    torque = np.empty((individuals, phases, twists), np.float32)
    angles = 2 * np.pi * np.arange(phases) / phases
    at = 0
    for block, count in sampling.blocks(individuals):
        drawn = sampling.draw(drive, block, count, seed)
        for k, angle in enumerate(angles):
            torque[at:at + count, k] = _turned_torque(drive, drawn, angle, twist)
        at += count
    mean = torque.mean(axis=(0, 1), dtype=float)
    return ScatterMaps(twist, (torque - mean).astype(np.float32))


def _turned_torque(drive: Drive, drawn: sampling.Deviations, angle: float, twist: Array) -> Array:
    """Torque (n_drives, n_twist) of drives whose crank stands at `angle`."""
    turned = replace(drawn, beta=wrap(drawn.beta + angle))
    keep = usable(drive, turned.beta)
    contacts = build_contacts(drive, turned)[keep.ravel()]
    owner = np.repeat(np.arange(len(keep)), keep.sum(axis=1))
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    torque = np.zeros((len(keep), len(twist)))
    step = max(1, _ELEMENTS_AT_ONCE // max(1, len(contacts)))
    for first in range(0, len(twist), step):
        part = slice(first, first + step)
        solved = solve(contacts, twist[part] * drive.ratio).output_torque
        torque[owner[starts], part] = np.add.reduceat(solved, starts, axis=1).T
    return torque


@functools.lru_cache(maxsize=4)
def _load(path: Path) -> ScatterMaps:
    with np.load(path, allow_pickle=False) as data:
        return ScatterMaps(data["twist"], data["deviation"])


def cached_maps(drive: Drive) -> ScatterMaps:
    """The drawing's maps, from the cache if they were made before by the same code, else computed."""
    path = cache_folder() / f"scatter-{fingerprint(drive, INDIVIDUALS, PHASES * 1000 + TWISTS)}.npz"
    if path.is_file():
        try:
            return _load(path)
        except (OSError, ValueError, KeyError, EOFError):
            pass  # truncated or foreign: build it again
    maps = individual_maps(drive)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, twist=maps.twist, deviation=maps.deviation)
    except (OSError, InputError):
        pass
    return maps


def gear_share(drive: Drive) -> float:
    """Share of the scatter's variance that stems from the lobes: that of their part in the clearances."""
    variance = {part: drive.tolerances[part].sigma ** 2 for part in ("gear", "element", "crank", "cage")}
    return variance["gear"] / max(sum(variance.values()), 1e-300)


def components(maps: ScatterMaps, twist: Array, turned: Array, crank: Array, share: float, floor: Array) -> Array:
    """Principal components (m, n), N.m, of the scatter at n points; their sum of squares is its variance.

    twist: rad; turned: crank past the cage, rad; crank: in the gear, rad; share: of the lobes in the variance;
    floor: (n,) N.m below which a component does not matter.
    """
    training = maps.deviation[HELD_BACK:].astype(float)
    spectrum = np.fft.rfft(training, axis=1) / training.shape[1]
    level = float(np.median(floor))
    weights = maps.along(twist)
    found = []
    for order in range(spectrum.shape[1] - 1):
        profiles = spectrum[:, order] * (1.0 if order == 0 else 2.0)
        _, size, vectors = np.linalg.svd(profiles, full_matrices=False)
        size = size / np.sqrt(len(profiles))
        # A component of this size moves single points by at most size times the profile's peak.
        keep = size * np.abs(vectors).max(axis=1) > 0.3 * level
        for scale, profile in zip(size[keep], vectors[keep], strict=True):
            along = weights @ (scale * profile)
            if order == 0:
                found.append(along.real)
                continue
            for phase, part in ((turned, 1 - share), (crank, share)):
                wave = along * np.exp(1j * order * phase) * np.sqrt(part / 2)
                found += [wave.real, wave.imag]
    return np.array(found) if found else np.zeros((0, len(twist)))


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record: maps, curve (twist and mean torque, rising), and the blocks' twist and angles."""

    maps: ScatterMaps
    curve: tuple[Array, Array]
    twist: Array
    turned: Array
    crank: Array
    share: float
    floor: Array

    def at(self, twist: Array) -> Array:
        """Components (m, n), N.m, where the contacts feel these twists (n,)."""
        return components(self.maps, twist, self.turned, self.crank, self.share, self.floor)

    def felt(self, elastic: Array, least: float) -> Array:
        """Twist (n,) at which the mean drive as drawn carries torques (n,), N.m; below `least` as measured."""
        return np.where(np.abs(elastic) > least, np.interp(elastic, self.curve[1], self.curve[0]), self.twist)

    @property
    def own(self) -> Array:
        """Components with the twist as measured."""
        return self.at(self.twist)


def fresh_individuals(maps: ScatterMaps, twist: Array, phase: Array, copies: int = 2, seed: int = 0) -> Array:
    """Individuals (m, n), N.m, that had no part in the components, each turned by `copies` random angles."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(twist)]))
    individuals = np.repeat(np.arange(HELD_BACK), copies)
    return maps.at(individuals, twist, phase, rng.uniform(0, 2 * np.pi, len(individuals)))
