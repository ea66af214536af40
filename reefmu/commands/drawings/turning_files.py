"""Files of `reefmu curve --individual`: tables and pictures of one virtual drive while it turns."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from stiffness_model import rotation
from stiffness_model.plotting.style import caption, headline, new_figure
from stiffness_model.rotation import ripple_plots as plots
from stiffness_model.units import ARCMIN

from .turning_individual import TORQUE_SHARES, TurningResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLES = ("individual_map.csv", "individual_turn.csv", "individual_orders.csv")
PICTURES = ("individual_map", "individual_error", "individual_orders", "individual_fan")


def write_files(turned: TurningResults, folder: Path, suffix: str = "png") -> list[str]:
    """Write the `TABLES` and `PICTURES` into the folder, and return their names. suffix: of the pictures."""
    _write_map(turned.first_crank_turn, folder / "individual_map.csv")
    _write_turn(turned, folder / "individual_turn.csv")
    _write_orders(turned.orders, folder / "individual_orders.csv")
    figures = (
        _map_figure(turned),
        _error_figure(turned),
        _orders_figure(turned),
        plots.twists_of_individuals(turned.scatter).get_figure(root=True),
    )
    for name, figure in zip(PICTURES, figures, strict=True):
        assert figure is not None
        figure.savefig(folder / f"{name}.{suffix}")
    return [*TABLES, *(f"{name}.{suffix}" for name in PICTURES)]


def _map_figure(turned: TurningResults) -> Figure:
    """Torque ripple over a whole turn of the output, and over the first turn of the crank."""
    figure = new_figure(8.4, 6.8)
    above, below = figure.subplots(2)
    who = plots.individual_text(turned.whole_turn.individual)
    caption(
        plots.ripple_map(turned.whole_turn, above), f"{who}: a whole turn of the output, mean of every ball's passing"
    )
    caption(plots.ripple_map(turned.first_crank_turn, below), "its first turn of the crank")
    return figure


def _error_figure(turned: TurningResults) -> Figure:
    """Play without load, and transmission error under the greatest torque, over a whole turn of the output."""
    figure = new_figure(8.4, 6.8)
    above, below = figure.subplots(2, sharex=True)
    plots.play_over_turn(turned.no_load, above).set_xlabel("")
    plots.transmission_error_over_turn(turned.loaded[-1], below)
    headline(figure, f"{plots.individual_text(turned.no_load.individual)}: a whole turn of the output")
    return figure


def _orders_figure(turned: TurningResults) -> Figure:
    """Order spectra of the position error without load and of the transmission error under the greatest torque."""
    figure = new_figure(8.4, 7.4)
    above, below = figure.subplots(2, sharex=True)
    names = list(turned.orders)
    plots.order_spectrum(turned.orders[names[0]], "position error,\nno load [arcmin]", ax=above).set_xlabel("")
    plots.order_spectrum(
        turned.orders[names[len(TORQUE_SHARES)]],
        f"transmission error,\n{turned.loaded[-1].torque:.3g} N.m [arcmin]",
        ax=below,
    )
    legend = below.get_legend()
    if legend is not None:
        legend.remove()
    headline(figure, f"{plots.individual_text(turned.no_load.individual)}: what the orders can stem from")
    return figure


def _write_map(turned: rotation.TurningMap, path: Path) -> None:
    angle, twist = np.meshgrid(np.degrees(turned.output_angle), turned.twist / ARCMIN, indexing="ij")
    _write_csv(
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


def _write_turn(turned: TurningResults, path: Path) -> None:
    free = turned.no_load
    columns = {
        "output_angle [deg]": np.degrees(free.output_angle),
        "error_forward_no_load [arcmin]": free.forward / ARCMIN,
        "error_backward_no_load [arcmin]": free.backward / ARCMIN,
    }
    for t in turned.loaded:
        columns[f"transmission_error_{t.torque:.4g}_N.m [arcmin]"] = t.transmission_error / ARCMIN
        columns[f"stiffness_{t.torque:.4g}_N.m [N.m/arcmin]"] = t.stiffness * ARCMIN
    _write_csv(path, {**columns, "torque_at_half_twist [N.m]": turned.half_twist_torque})


def _write_orders(orders: Mapping[str, rotation.Spectrum], path: Path) -> None:
    first = next(iter(orders.values()))
    count = min(len(first.order), 3 * first.drive.lobes * first.drive.elements + 1)
    _write_csv(
        path,
        {
            "order_per_output_turn [1]": first.order[:count],
            "order_per_crank_turn [1]": first.crank_order[:count],
            **{name: s.amplitude[:count] for name, s in orders.items()},
        },
        {"can_stem_from": [first.source(int(k)) if k else "mean" for k in first.order[:count]]},
    )


def _write_csv(
    path: Path, columns: Mapping[str, Iterable[float]], texts: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*columns, *texts])
        writer.writerows(
            zip(*([f"{v:.9g}" for v in values] for values in columns.values()), *texts.values(), strict=True)
        )
