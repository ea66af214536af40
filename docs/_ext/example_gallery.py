"""The gallery of examples: each runs as a program that writes its pictures to a folder of its own."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

FIRST_CELL = """\
# The arguments of the program: the folder to which it writes.
import sys
from pathlib import Path

sys.argv = ["example", "output"]
__file__ = str(Path("example.py").resolve())  # data of an example are expected beside the notebook"""
LAST_CELL = """\
from IPython.display import Image, display

for picture in sorted(Path("output").glob("*.png")):
    display(Image(picture))"""


class OutputFolder:
    """Arguments of an example's program: the folder of its pictures. Also sets `__file__`, as Python does."""

    def __init__(self, parent: Path) -> None:
        self.parent = parent

    def __repr__(self) -> str:
        return "OutputFolder"  # without the path, so that Sphinx finds the configuration unchanged

    def __call__(self, gallery_conf: dict[str, Any], script_vars: dict[str, Any]) -> list[str]:
        script_vars["example_globals"]["__file__"] = script_vars["src_file"]
        folder = self.parent / Path(script_vars["src_file"]).stem
        shutil.rmtree(folder, ignore_errors=True)
        # Examples run in their own folder and print where they have written: no path of this machine on the pages.
        return [os.path.relpath(folder, Path(script_vars["src_file"]).parent)]


class PicturesOfFolder:
    """Collects the pictures that an example has written, with their names as captions."""

    def __init__(self, parent: Path) -> None:
        self.parent = parent

    def __repr__(self) -> str:
        return "PicturesOfFolder"

    def __call__(self, block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
        folder = self.parent / Path(block_vars["src_file"]).stem
        copies: list[str] = []
        for picture in sorted(folder.glob("*.png")):
            target = next(block_vars["image_path_iterator"])
            shutil.copy(picture, target)
            copies.append(target)
        return figure_rst(copies, gallery_conf["src_dir"])


def configuration(docs: Path) -> dict[str, Any]:
    """`sphinx_gallery_conf` for the sources in docs. Examples run one after the other, as programs without arguments
    but the folder."""
    output = docs / "gallery" / "output"
    return {
        "examples_dirs": [str(docs.parent / "examples")],
        "gallery_dirs": [str(docs / "gallery")],
        "filename_pattern": r".*\.py$",
        "ignore_pattern": r"__init__\.py",
        "copyfile_regex": r".*\.(csv\.gz|toml)$",
        "reset_argv": OutputFolder(output),
        "image_scrapers": (PicturesOfFolder(output),),
        "abort_on_example_error": False,
        "only_warn_on_example_error": False,
        "first_notebook_cell": FIRST_CELL,
        "last_notebook_cell": LAST_CELL,
        "show_memory": False,
        "min_reported_time": 1,
        "remove_config_comments": True,
        "show_signature": False,
        "plot_gallery": "True",
        "thumbnail_size": (560, 350),
        "write_computation_times": False,
    }
