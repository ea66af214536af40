"""Another name of `reefmu.fmu.export`, which the README's examples import."""

from .export import export_fmu

__all__ = ["export_fmu"]
