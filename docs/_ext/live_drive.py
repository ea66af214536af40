"""The directive `live-drive PRESET`: a frame in which a drive runs in the browser, compiled to WebAssembly.

The page in the frame is that of `reefmu curve --interactive`, self-contained. Where ziglang, which compiles it, is not
installed (extra `native`), the content of the directive stands in its place.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import stiffness_model as sm
from reefmu.commands.drawings.interactive_page import EFFECTS, PAGE
from reefmu.fmu.codegen.sources import make_sources
from reefmu.fmu.documentation.drive_page import drive_page
from reefmu.fmu.documentation.web_assembly import compile_module
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.model import build_model

DRIVES = 60
"""Virtual drives behind the table, as on the other pages, which have solved it."""
TELL_HEIGHT = """<script>
{
  const tell = () => {
    const bottom = document.querySelector(".drive").getBoundingClientRect().bottom + window.scrollY;
    parent.postMessage({ driveHeight: Math.ceil(bottom) + 16 }, "*");
  };
  new ResizeObserver(tell).observe(document.body);
  addEventListener("message", tell);
}
</script>
"""
"""In the page: where the drive ends, below which it has equations and variables. 16: pixels of room below it."""
TAKE_HEIGHT = """<script>
{
  const frame = () => document.querySelector("iframe.live");
  addEventListener("message", (event) => {
    if (event.source === frame().contentWindow && event.data.driveHeight > 0)
      frame().style.height = `${event.data.driveHeight}px`;
  });
  addEventListener("resize", () => frame().contentWindow.postMessage("height", "*"));
}
</script>
"""
"""Around the frame, which then ends below the drive and not in the middle of a control, at any width. A browser may not
tell a frame that is out of sight of its new width, so that the page around it asks."""
DESCRIPTION = (
    "The preset workshop. Move the twist and watch torque and stiffness. The effects below are those that a real drive "
    "may add; they are zero at first: set hysteresis.torque, and run two loops."
)


def write_page(preset: str, folder: Path) -> bool:
    """Write the page into a folder; returns whether the drive runs on it."""
    if importlib.util.find_spec("ziglang") is None:
        return False
    model = build_model(sm.load_drive(preset), {name: {} for name in EFFECTS}, n_drives=DRIVES)
    component = drive_component(model, start=False)
    interface = declare_with_derivatives(component)
    module = compile_module(make_sources(component, interface, "", "web"))
    if module is None:
        return False
    folder.mkdir(parents=True, exist_ok=True)
    page = drive_page(component, interface, DESCRIPTION, module)
    (folder / PAGE).write_text(page.replace("</body>", f"{TELL_HEIGHT}</body>"), "utf-8")
    return True


class LiveDrive(SphinxDirective):
    """Writes the frame, or the content of the directive."""

    required_arguments: ClassVar[int] = 1
    has_content: ClassVar[bool] = True

    def run(self) -> list[nodes.Node]:
        if not write_page(self.arguments[0], Path(self.env.app.outdir) / "_static"):
            return self.parse_content_to_nodes()
        frame = f'<iframe class="live" src="_static/{PAGE}" title="The drive {self.arguments[0]} at work"></iframe>'
        return [nodes.raw("", TAKE_HEIGHT + frame, format="html")]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("live-drive", LiveDrive)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
