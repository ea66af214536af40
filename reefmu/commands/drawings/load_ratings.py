"""Ratings of a population under load: pressures, losses, lives, and the effect of the drawing's options on torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.contact.element_contacts import PARTNERS
from stiffness_model.drawing.options import STIFFNESSES, ModelOptions, write_options
from stiffness_model.montecarlo.population import Population, simulate
from stiffness_model.numerics.arrays import Array
from stiffness_model.ratings.bearing_life import BearingLife, bearing_life
from stiffness_model.ratings.efficiency import FrictionLosses, friction_losses
from stiffness_model.ratings.static_safety import StaticSafety, static_safety
from stiffness_model.units import ARCMIN

MAX_RATED_DRIVES = 64
"""Drives that are rated. The standard deviation of the 90th percentile of their greatest pressures is then 0.3 %
(measured on drive_2, whose pressures scatter by 1.3 %)."""
_OPTIONS = (*STIFFNESSES, "gear_contact", "cage_contact", "inertia")


@dataclass(frozen=True)
class LoadRatings:
    """Ratings over the population's twists.

    losses and life: None where the drawing does not state the data that they need. plain_torque: mean torque, N.m, at
    max_twist of the same drives without the drawing's options, and with them; None for a drawing without options.
    """

    population: Population
    strength: StaticSafety
    losses: FrictionLosses | None
    life: BearingLife | None
    plain_torque: tuple[float, float] | None

    def columns(self) -> Mapping[str, Array]:
        """Columns of curve.csv by their heads."""
        order = np.argsort(self.population.twist)
        pressure = self.strength.pressure_p90()[order] / 1e6
        columns = {f"pressure_{part} [MPa]": pressure[:, k] for k, part in enumerate(PARTNERS)}
        columns["pressure_safety [1]"] = self.strength.min_safety()[order]
        if self.losses is not None:
            columns["loss_torque_at_crank [N.m]"] = self.losses.loss.mean(axis=0)[order]
            columns["efficiency [1]"] = self.losses.mean_efficiencies()[0][order]
        if self.life is not None:
            columns["bearing_load [N]"] = self.life.load[order]
            columns["bearing_life [Mrev]"] = self.life.system_revolutions[order] / 1e6
        return columns

    def lines(self) -> list[str]:
        """The ratings in words, line by line."""
        return [*self._option_lines(), *self._pressure_lines(), *self._friction_lines(), *self._bearing_lines()]

    def _option_lines(self) -> list[str]:
        if self.plain_torque is None:
            return []
        drive = self.population.drive
        plain, now = self.plain_torque
        options = [f"{name} = {value}" for name, value in write_options(drive.beyond).items() if name in _OPTIONS]
        return [
            f"beyond the plain model: {', '.join(options)}",
            f"torque at {drive.max_twist / ARCMIN:g} arcmin {now:.1f} N.m; plain model {plain:.1f} N.m",
        ]

    def _pressure_lines(self) -> list[str]:
        drive, strength = self.population.drive, self.strength
        last, order = int(self.population.twist.argmax()), np.argsort(self.population.twist)
        gear, crank, cage = strength.pressure_p90()[last] / 1e9
        governing, least = strength.governing_contacts()[last], strength.min_safety()[last]
        lines = [
            f"contact pressure at {drive.max_twist / ARCMIN:g} arcmin: gear {gear:.2f}, crank {crank:.2f}, "
            f"cage {cage:.2f} GPa (greatest over a turn; nine drives of ten stay below)"
        ]
        # A contact without a known limit is named in the same line, because it may be the one that fails.
        unknown = "".join(
            f"; no limit known at the {part}, {pressure / 1e6:.0f} MPa" for part, pressure in governing.no_limit.items()
        )
        if governing.contact:
            limit = strength.limit[PARTNERS.index(governing.contact)] / 1e6
            ordered = replace(strength, twist=strength.twist[order], pressure=strength.pressure[:, order])
            reached = ordered.permissible_torque(self.population.torque.mean(axis=0)[order])
            lines.append(
                f"static safety {least:.2f} at the {governing.contact} (limit {limit:.0f} MPa), {reached}{unknown}"
            )
        elif unknown:
            lines.append(f"static safety unknown{unknown}")
        if unknown:
            part = next(iter(governing.no_limit))
            lines.append(f"state what is missing as {part}_pressure_limit, or as the material's allowable_pressure")
        return lines

    def _friction_lines(self) -> list[str]:
        if self.losses is None:
            return []
        last, start = int(self.population.twist.argmax()), int(np.abs(self.population.twist).argmin())
        loss = self.losses.loss.mean(axis=0)
        efficiency, back = self.losses.mean_efficiencies()
        return [
            f"friction {self.population.drive.beyond.friction_coefficient:g} in the contacts: efficiency "
            f"{100 * efficiency[last]:.1f} % driving, {100 * back[last]:.1f} % driven back; no-load torque at the "
            f"crank {1e3 * loss[start]:.1f} mN.m"
        ]

    def _bearing_lines(self) -> list[str]:
        if self.life is None:
            return []
        last = int(self.population.twist.argmax())
        hours = self.life.hours[last]
        text = (
            f"crank bearings at {self.life.torque[last]:.0f} N.m: P = {self.life.load[last] / 1e3:.2f} kN, L10 of "
            f"all together {self.life.system_revolutions[last] / 1e6:.3g} million turns of the crank"
            + (f", {hours:.3g} h" if np.isfinite(hours) else "")
            + f" (in each turn the rings of a bearing make {self.life.relative_revolutions[last]:.3f} revolutions "
            "relative to each other)"
        )
        return [
            text + ("" if self.life.valid[last] else "; beyond C/2, where ISO 281 does not hold"),
            "balls, gear and cage: no rating life, for no standard covers their contacts",
        ]


def rate_loads(population: Population) -> LoadRatings:
    """Pressures of the population's first drives, and their losses and lives where the drawing states the data."""
    drive, twist, seed = population.drive, population.twist, population.seed
    count = min(population.n_drives, MAX_RATED_DRIVES)
    options = drive.beyond
    plain = None
    if not options.is_plain:
        kept = {name: getattr(options, name) for name in ModelOptions.__dataclass_fields__ if name not in _OPTIONS}
        without = simulate(replace(drive, beyond=ModelOptions(**kept)), [drive.max_twist], count, seed).torque.mean()
        plain = float(without), float(population.torque[:count, int(twist.argmax())].mean())
    return LoadRatings(
        population,
        static_safety(drive, twist, count, seed),
        friction_losses(drive, twist, count, seed) if options.friction_coefficient > 0 else None,
        bearing_life(drive, twist, count, seed) if options.bearing_capacity > 0 else None,
        plain,
    )
