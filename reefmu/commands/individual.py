"""`reefmu curve --individual`: one drive of the drawing, turning: files, pictures and a summary in words."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model import rotation as turning
from stiffness_model.drawing.drive import Drive
from stiffness_model.plotting.curves import save
from stiffness_model.rotation import ripple_plots as plots
from stiffness_model.rotation.twist_scatter import TwistScatter, twist_scatter
from stiffness_model.units import ARCMIN

from . import study

PER_PASS = 8
"""Angles between one ball's passing and the next."""
OTHERS = 11
"""Individuals beside the first in the fan: those of the next seeds."""
SHARES = (0.5, 1.0)
"""Of the torque at max_twist, at which the transmission error is asked for."""
FILES = (
    "individual_map.csv",
    "individual_turn.csv",
    "individual_orders.csv",
    "individual_map.png",
    "individual_error.png",
    "individual_orders.png",
    "individual_fan.png",
)


@dataclass(frozen=True)
class Turned:
    """What is computed of one individual."""

    near: turning.TurningMap
    far: turning.TurningMap
    free: turning.NoLoad
    loaded: tuple[turning.LoadedTurn, ...]
    ripple: NDArray[np.float64]
    orders: Mapping[str, turning.Spectrum]
    scatter: TwistScatter


def compute(drive: Drive, seed: int) -> Turned:
    """Map, turns under load and spectra of the individual of `seed`; some seconds."""
    one = turning.draw_individual(drive, seed)
    twist = np.linspace(-drive.max_twist, drive.max_twist, study.TWISTS)
    angle = turning.angles_over_turn(drive, PER_PASS)
    # To the nearest passing, where balls do not pass a whole number of times in a turn of the crank.
    near = turning.turning_map(one, twist, angle[: round(len(angle) / drive.transmission_ratio)])
    full = float(near.torque[:, -1].mean())
    with study.all_cores(f"turning individual {seed}") as executor:
        free, *loaded, ripple, far, beside = executor.map(
            _run,
            [
                partial(turning.no_load, one, angle),
                *(partial(turning.loaded_turn, one, share * full, angle) for share in SHARES),
                partial(turning.turning_map, one, [drive.max_twist / 2], angle),
                partial(_passing_means, one, twist[::2]),
                partial(twist_scatter, drive, range(seed, seed + 1 + OTHERS)),
            ],
        )
    signals = {
        "position_error_no_load [arcmin]": free.position_error / ARCMIN,
        **{f"transmission_error_{t.torque:.4g}_N.m [arcmin]": t.transmission_error / ARCMIN for t in loaded},
        "torque_at_half_twist [N.m]": ripple.torque[:, 0],
        f"stiffness_{loaded[-1].torque:.4g}_N.m [N.m/arcmin]": loaded[-1].stiffness * ARCMIN,
    }
    return Turned(
        near,
        far,
        free,
        tuple(loaded),
        ripple.torque[:, 0],
        {name: turning.spectrum(drive, values) for name, values in signals.items()},
        beside,
    )


def _run(job: Callable[[], Any]) -> Any:
    return job()


def write(turned: Turned, folder: Path) -> None:
    """The files of `FILES`."""
    from matplotlib.figure import Figure

    _write_map(turned.near, folder / "individual_map.csv")
    _write_turn(turned, folder / "individual_turn.csv")
    _write_orders(turned.orders, folder / "individual_orders.csv")
    figure = Figure(figsize=(8.4, 6.6), dpi=150, layout="constrained")
    above, below = figure.subplots(2)
    plots.ripple_map(turned.far, above).set_title(
        "a whole turn of the output, mean of every ball's passing", loc="left", fontsize="small"
    )
    plots.ripple_map(turned.near, below).set_title("its first turn of the crank", loc="left", fontsize="small")
    save(below, folder / "individual_map.png")
    save(plots.transmission_error_over_turn(turned.free, turned.loaded[-1:]), folder / "individual_error.png")
    figure = Figure(figsize=(8.4, 7.2), dpi=150, layout="constrained")
    above, below = figure.subplots(2, sharex=True)
    names = list(turned.orders)
    plots.order_spectrum(turned.orders[names[0]], "position error,\nno load [arcmin]", ax=above).set_xlabel("")
    plots.order_spectrum(
        turned.orders[names[len(SHARES)]], f"transmission error,\n{turned.loaded[-1].torque:.3g} N.m [arcmin]", ax=below
    )
    legend = below.get_legend()
    if legend is not None:
        legend.remove()
    save(below, folder / "individual_orders.png")
    save(plots.twists_of_individuals(turned.scatter), folder / "individual_fan.png")


def summary(turned: Turned) -> str:
    """The individual in words and numbers."""
    one, free = turned.near.individual, turned.free
    drive = one.drive
    error, ripple = np.ptp(free.position_error) / ARCMIN, np.ptp(turned.ripple)
    lines = [
        f"individual {one.seed}: repeats after one turn of the output, {drive.transmission_ratio:g} of the crank, "
        f"{drive.lobes * drive.elements} passings of a ball",
        f"no load        position error     {error:7.3f} arcmin peak to peak, play "
        f"{free.play.min() / ARCMIN:.3f} to {free.play.max() / ARCMIN:.3f} arcmin",
    ]
    for t in turned.loaded:
        low, high = t.stiffness.min() * ARCMIN, t.stiffness.max() * ARCMIN
        lines.append(
            f"{t.torque:7.1f} N.m    transmission error {np.ptp(t.twist) / ARCMIN:6.3f} arcmin peak to peak, "
            f"stiffness {low:.2f} to {high:.2f} N.m/arcmin"
        )
    mean = turned.ripple.mean()
    lines.append(
        f"{drive.max_twist / 2 / ARCMIN:7.3g} arcmin torque ripple      {ripple:7.3f} N.m peak to peak, "
        f"{100 * ripple / mean:.1f} % of {mean:.4g} N.m"
    )
    spectrum = list(turned.orders.values())[len(SHARES)]
    words = {source: text for source, (_, text) in plots.SOURCES.items()}
    rows = [
        [f"{spectrum.crank_order[k]:.3f}", f"{k}", f"{spectrum.amplitude[k]:.4f}", words[spectrum.source(k)]]
        for k in spectrum.strongest(6)
    ]
    lines += [
        "",
        f"strongest orders of the transmission error at {turned.loaded[-1].torque:.4g} N.m",
        study.table(
            ["per crank turn", "per output turn", "amplitude", "can stem from"], ["[1]", "[1]", "[arcmin]", ""], rows
        ),
    ]
    return "\n".join(lines)


def _passing_means(one: turning.Individual, twist: NDArray[np.float64]) -> turning.TurningMap:
    """The map of a whole turn, every passing of a ball as the mean of two angles in it."""
    found = turning.turning_map(one, twist, turning.angles_over_turn(one.drive, 2))
    mean = [
        values.reshape(-1, 2, len(twist)).mean(axis=1) for values in (found.torque, found.crank_torque, found.max_force)
    ]
    return turning.TurningMap(one, found.output_angle[::2], found.twist, *mean)


def _write_map(turned: turning.TurningMap, path: Path) -> None:
    angle, twist = np.meshgrid(np.degrees(turned.output_angle), turned.twist / ARCMIN, indexing="ij")
    _write(
        path,
        {
            "output_angle [deg]": angle.ravel(),
            "crank_turns [1]": np.repeat(turned.crank_turns, len(turned.twist)),
            "twist [arcmin]": twist.ravel(),
            "torque [N.m]": turned.torque.ravel(),
            "crank_torque [N.m]": turned.crank_torque.ravel(),
            "max_force [N]": turned.max_force.ravel(),
        },
    )


def _write_turn(turned: Turned, path: Path) -> None:
    free = turned.free
    columns = {
        "output_angle [deg]": np.degrees(free.output_angle),
        "error_forward_no_load [arcmin]": free.forward / ARCMIN,
        "error_backward_no_load [arcmin]": free.backward / ARCMIN,
    }
    for t in turned.loaded:
        columns[f"transmission_error_{t.torque:.4g}_N.m [arcmin]"] = t.transmission_error / ARCMIN
        columns[f"stiffness_{t.torque:.4g}_N.m [N.m/arcmin]"] = t.stiffness * ARCMIN
    _write(path, {**columns, "torque_at_half_twist [N.m]": turned.ripple})


def _write_orders(orders: Mapping[str, turning.Spectrum], path: Path) -> None:
    first = next(iter(orders.values()))
    count = min(len(first.order), 3 * first.drive.lobes * first.drive.elements + 1)
    _write(
        path,
        {
            "order_per_output_turn [1]": first.order[:count],
            "order_per_crank_turn [1]": first.crank_order[:count],
            **{name: s.amplitude[:count] for name, s in orders.items()},
        },
        {"can_stem_from": [first.source(int(k)) if k else "mean" for k in first.order[:count]]},
    )


def _write(
    path: Path, columns: Mapping[str, Iterable[float]], words: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*columns, *words])
        writer.writerows(
            zip(*([f"{v:.9g}" for v in values] for values in columns.values()), *words.values(), strict=True)
        )
