"""Another name of `reefmu.model.model_file`, which the README mentions."""

from .model.model_file import is_model_file, load_model, save_model

__all__ = ["is_model_file", "load_model", "save_model"]
