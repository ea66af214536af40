"""A page in headless Chromium: what it looks like, what it measures, what it asks of the network."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.patience import HANG

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


@dataclass(frozen=True)
class Seen:
    """width, height: of the window; page: width of the page; boxes: left, top, right, bottom; pictures: width,
    height and number of paths of each; wide: what sticks out to the right; asked: addresses that were asked for.
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
    """Open a page in a window of this size."""
    copy, log = work / f"measured-{width}.html", work / f"net-{width}.json"
    copy.write_text(page.read_text("utf-8").replace("</body>", _MEASURE + "</body>"), "utf-8")
    dom = _chromium(work, f"--window-size={width},{height}", f"--log-net-log={log}", "--dump-dom", copy.as_uri())
    seen: dict[str, Any] = json.loads(re.search(r"<pre id=\"seen\">(.*?)</pre>", dom, re.DOTALL)[1])  # type: ignore[index]
    asked = set(re.findall(r'"url":"((?:https?|wss?):[^"]*)"', log.read_text("utf-8")))
    # Chromium itself asks its maker for updates and dictionaries.
    maker = ("google", "gstatic", "gvt1")
    return Seen(**seen, asked=sorted(url for url in asked if not any(name in url.split("/")[2] for name in maker)))


def printed(page: Path, work: Path) -> bytes:
    """The page as PDF, on the paper that it asks for."""
    target = work / "page.pdf"
    _chromium(work, "--no-pdf-header-footer", f"--print-to-pdf={target}", page.as_uri())
    return target.read_bytes()


def screenshot(page: Path, target: Path, width: int, height: int) -> None:
    """A picture of the page's first screen."""
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
    return subprocess.run([*call, *words], check=True, capture_output=True, text=True, timeout=HANG).stdout
