"""A page in headless Chromium: its layout, and what it requests from the network."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.subprocesses import TIMEOUT

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
_MEASURE = """<script>
addEventListener('load', () => {
  const box = s => { const e = document.querySelector(s); if (!e) return null;
    const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
  const seen = {width: innerWidth, height: innerHeight, page: document.documentElement.scrollWidth,
    verdict: box('.verdict'), lead: box('.lead'), cards: box('.cards'),
    pictures: [...document.querySelectorAll('svg')].map(e => { const r = e.getBoundingClientRect();
      return [r.width, r.height, e.querySelectorAll('path').length]; }),
    wide: [...document.querySelectorAll('body *')].filter(e => !e.closest('svg') &&
      e.getBoundingClientRect().right > innerWidth + 0.5).map(e => e.outerHTML.slice(0, 80))};
  document.body.innerHTML = '<pre id=seen>' + JSON.stringify(seen).replaceAll('<', '(') + '</pre>';
});
</script>"""

_OPERATE = """<script>
addEventListener('load', () => {
  const svg = document.querySelector('svg[data-figure]'), bar = svg.nextElementSibling;
  const layers = JSON.parse(svg.dataset.figure).layers, box = bar.querySelector('input');
  box.click();
  const r = svg.getBoundingClientRect(), say = () => bar.querySelector('output').textContent;
  for (let k = -40; k <= 40 && !say().includes(':'); k += 2) svg.dispatchEvent(new PointerEvent('pointermove',
    {clientX: r.left + 0.53 * r.width, clientY: r.top + 0.47 * r.height + k}));
  document.body.innerHTML = '<pre id=seen>' + JSON.stringify({layers: Object.values(layers), readout: say(),
    hidden: svg.querySelector('#' + Object.keys(layers)[0]).style.display}) + '</pre>';
});
</script>"""


@dataclass(frozen=True)
class Seen:
    """The layout of a page, in pixels. width, height: of the window; page: width of the page; verdict, lead, cards:
    left, top, right, bottom; pictures: width, height and number of paths of each; wide: elements that overflow to the
    right; asked: addresses requested.
    """

    width: float
    height: float
    page: float
    verdict: list[float]
    lead: list[float]
    cards: list[float]
    pictures: list[list[float]]
    wide: list[str]
    asked: list[str]


def look(page: Path, width: int, height: int, work: Path) -> Seen:
    """Open a page in a window of this size; work: folder for temporary files."""
    copy, log = work / f"measured-{width}.html", work / f"net-{width}.json"
    copy.write_text(page.read_text("utf-8").replace("</body>", _MEASURE + "</body>"), "utf-8")
    dom = _chromium(work, f"--window-size={width},{height}", f"--log-net-log={log}", "--dump-dom", copy.as_uri())
    seen: dict[str, Any] = json.loads(re.search(r"<pre id=\"seen\">(.*?)</pre>", dom, re.DOTALL)[1])  # type: ignore[index]
    asked = set(re.findall(r'"url":"((?:https?|wss?):[^"]*)"', log.read_text("utf-8")))
    # Chromium itself requests updates and dictionaries from its vendor.
    vendor = ("google", "gstatic", "gvt1")
    return Seen(**seen, asked=sorted(url for url in asked if not any(name in url.split("/")[2] for name in vendor)))


def operated(page: Path, work: Path) -> dict[str, Any]:
    """What the first figure shows after its first layer was hidden and the pointer was moved near its middle."""
    copy = work / "operated.html"
    copy.write_text(page.read_text("utf-8").replace("</body>", _OPERATE + "</body>"), "utf-8")
    dom = _chromium(work, "--window-size=1280,900", "--dump-dom", copy.as_uri())
    return json.loads(re.search(r"<pre id=\"seen\">(.*?)</pre>", dom, re.DOTALL)[1])  # type: ignore[index, no-any-return]


def printed(page: Path, work: Path) -> bytes:
    """The page as PDF, in the paper size of its style sheet."""
    target = work / "page.pdf"
    _chromium(work, "--no-pdf-header-footer", f"--print-to-pdf={target}", page.as_uri())
    return target.read_bytes()


def screenshot(page: Path, target: Path, width: int, height: int) -> None:
    """A screenshot of the first screen of a page."""
    _chromium(target.parent, f"--window-size={width},{height}", f"--screenshot={target}", page.as_uri())


def _chromium(work: Path, *words: str) -> str:
    assert CHROMIUM is not None
    call = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        f"--user-data-dir={work / 'profile'}",
    ]
    return subprocess.run([*call, *words], check=True, capture_output=True, text=True, timeout=TIMEOUT).stdout
