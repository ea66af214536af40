"""`reefmu curve --individual`: one virtual drive while it turns, and a summary of it in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from stiffness_model import rotation
from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array
from stiffness_model.rotation.ripple_plots import SOURCES
from stiffness_model.rotation.twist_scatter import TwistScatter, twist_scatter
from stiffness_model.units import ARCMIN

from ..terminal.text_table import aligned_table
from ..terminal.worker_processes import pool_with_progress
from .population_run import TWISTS

ANGLES_PER_PASSING = 8
"""Angles from the passing of one ball to that of the next; chosen by judgement."""
OTHER_INDIVIDUALS = 11
"""Individuals of the following seeds, whose twists are shown beside the first; chosen by judgement."""
TORQUE_SHARES = (0.5, 1.0)
"""Shares of the torque at max_twist at which the transmission error is computed; chosen by judgement."""

N_ORDERS = 6
"""Orders that are listed; chosen by judgement."""


@dataclass(frozen=True)
class TurningResults:
    """Results of one individual.

    first_crank_turn, whole_turn: maps of torque over twist and angle. no_load: play and position error. loaded: twist
    and stiffness at each of `TORQUE_SHARES`. half_twist_torque: (n_angle,) N.m at half the drawing's max_twist. orders:
    spectra by the title of their signal. scatter: twists over torque of this and other individuals.
    """

    first_crank_turn: rotation.TurningMap
    whole_turn: rotation.TurningMap
    no_load: rotation.NoLoad
    loaded: tuple[rotation.LoadedTurn, ...]
    half_twist_torque: Array
    orders: Mapping[str, rotation.Spectrum]
    scatter: TwistScatter


def turn_individual(drive: Drive, seed: int) -> TurningResults:
    """Maps, turns under load and spectra of the individual of `seed`; takes some seconds."""
    one = rotation.draw_individual(drive, seed)
    twist = np.linspace(-drive.max_twist, drive.max_twist, TWISTS)
    angle = rotation.angles_over_turn(drive, ANGLES_PER_PASSING)
    # Up to the nearest passing, where a turn of the crank is not a whole number of passings.
    near = rotation.turning_map(one, twist, angle[: round(len(angle) / drive.transmission_ratio)])
    full = float(near.torque[:, -1].mean())
    with pool_with_progress(f"turning individual {seed}") as executor:
        free, *loaded, ripple, far, beside = executor.map(
            _call,
            [
                partial(rotation.no_load, one, angle),
                *(partial(rotation.loaded_turn, one, share * full, angle) for share in TORQUE_SHARES),
                partial(rotation.turning_map, one, [drive.max_twist / 2], angle),
                partial(_mean_of_passings, one, twist[::2]),
                partial(twist_scatter, drive, range(seed, seed + 1 + OTHER_INDIVIDUALS)),
            ],
        )
    signals = {
        "position_error_no_load [arcmin]": free.position_error / ARCMIN,
        **{f"transmission_error_{t.torque:.4g}_N.m [arcmin]": t.transmission_error / ARCMIN for t in loaded},
        "torque_at_half_twist [N.m]": ripple.torque[:, 0],
        f"stiffness_{loaded[-1].torque:.4g}_N.m [N.m/arcmin]": loaded[-1].stiffness * ARCMIN,
    }
    return TurningResults(
        near,
        far,
        free,
        tuple(loaded),
        ripple.torque[:, 0],
        {name: rotation.spectrum(drive, values) for name, values in signals.items()},
        beside,
    )


def _call(job: Callable[[], Any]) -> Any:
    return job()


def summary(turned: TurningResults) -> str:
    """The results of the individual in words."""
    drive, found = turned.first_crank_turn.individual.drive, figures(turned)
    ripple, mean = found["torque_ripple_at_half_twist [N.m]"], found["torque_at_half_twist [N.m]"]
    loaded = [
        f"{t['torque [N.m]']:7.1f} N.m    transmission error {t['transmission_error [arcmin]']:6.3f} arcmin peak to "
        f"peak, stiffness {t['least_stiffness [N.m/arcmin]']:.2f} to {t['greatest_stiffness [N.m/arcmin]']:.2f} "
        "N.m/arcmin"
        for t in found["loaded"]
    ]
    rows = [
        [
            f"{order['per_crank_turn [1]']:.3f}",
            f"{order['per_output_turn [1]']}",
            f"{order['amplitude [arcmin]']:.4f}",
            order["source"],
        ]
        for order in found["strongest_orders"]
    ]
    lines = [
        f"individual {found['seed']}: repeats after one turn of the output, "
        f"{found['crank_turns_until_it_repeats [1]']:g} of the crank, {drive.lobes * drive.elements} passings of a "
        "ball",
        f"no load        position error     {found['position_error_no_load [arcmin]']:7.3f} arcmin peak to peak, play "
        f"{found['least_play [arcmin]']:.3f} to {found['greatest_play [arcmin]']:.3f} arcmin",
        *loaded,
        f"{drive.max_twist / 2 / ARCMIN:7.3g} arcmin torque ripple      {ripple:7.3f} N.m peak to peak, "
        f"{100 * ripple / mean:.1f} % of {mean:.4g} N.m",
        "",
        f"strongest orders of the transmission error at {turned.loaded[-1].torque:.4g} N.m",
        aligned_table(
            ["per crank turn", "per output turn", "amplitude", "can stem from"], ["[1]", "[1]", "[arcmin]", ""], rows
        ),
    ]
    return "\n".join(lines)


def figures(turned: TurningResults) -> dict[str, Any]:
    """The results of the individual by name with unit; `loaded` and `strongest_orders` are lists, the orders those of
    the transmission error at the greatest torque."""
    one, free = turned.first_crank_turn.individual, turned.no_load
    drive = one.drive
    return {
        "seed": one.seed,
        "crank_turns_until_it_repeats [1]": drive.transmission_ratio,
        "position_error_no_load [arcmin]": float(np.ptp(free.position_error)) / ARCMIN,
        "least_play [arcmin]": float(free.play.min()) / ARCMIN,
        "greatest_play [arcmin]": float(free.play.max()) / ARCMIN,
        "loaded": [
            {
                "torque [N.m]": float(t.torque),
                "transmission_error [arcmin]": float(np.ptp(t.twist)) / ARCMIN,
                "least_stiffness [N.m/arcmin]": float(t.stiffness.min()) * ARCMIN,
                "greatest_stiffness [N.m/arcmin]": float(t.stiffness.max()) * ARCMIN,
            }
            for t in turned.loaded
        ],
        "torque_at_half_twist [N.m]": float(turned.half_twist_torque.mean()),
        "torque_ripple_at_half_twist [N.m]": float(np.ptp(turned.half_twist_torque)),
        "strongest_orders": _orders(turned),
    }


def _orders(turned: TurningResults) -> list[dict[str, Any]]:
    """The strongest orders of the transmission error at the greatest torque, with what they can stem from."""
    spectrum = list(turned.orders.values())[len(TORQUE_SHARES)]
    words = {source: text for source, (_, text) in SOURCES.items()}
    return [
        {
            "per_crank_turn [1]": float(spectrum.crank_order[k]),
            "per_output_turn [1]": int(k),
            "amplitude [arcmin]": float(spectrum.amplitude[k]),
            "source": words[spectrum.source(k)],
        }
        for k in spectrum.strongest(N_ORDERS)
    ]


def _mean_of_passings(one: rotation.Individual, twist: Array) -> rotation.TurningMap:
    """The map of a whole turn, with the mean of two angles for each passing of a ball."""
    found = rotation.turning_map(one, twist, rotation.angles_over_turn(one.drive, 2))
    mean = [
        values.reshape(-1, 2, len(twist)).mean(axis=1) for values in (found.torque, found.crank_torque, found.max_force)
    ]
    return rotation.TurningMap(one, found.output_angle[::2], found.twist, *mean)
