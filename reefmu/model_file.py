"""`reefmu.model.model_file` by the name that the README gives."""

from .model.model_file import is_model_file, load_model, save_model

__all__ = ["is_model_file", "load_model", "save_model"]
