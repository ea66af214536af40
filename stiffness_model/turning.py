"""Another name of `stiffness_model.rotation`, which the README's examples import."""

from .rotation import (
    Individual,
    LoadedTurn,
    NoLoad,
    Spectrum,
    TurningMap,
    draw_individual,
    loaded_turn,
    mean_individual,
    no_load,
    spectrum,
    standing,
    turn,
    turning_map,
)

__all__ = [
    "Individual",
    "LoadedTurn",
    "NoLoad",
    "Spectrum",
    "TurningMap",
    "draw_individual",
    "loaded_turn",
    "mean_individual",
    "no_load",
    "spectrum",
    "standing",
    "turn",
    "turning_map",
]
