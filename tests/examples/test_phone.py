"""On a phone, 390 pixels wide, no table and no picture of the site reaches beyond the page."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.integration.diagnosis.browser import CHROMIUM
from tests.subprocesses import TIMEOUT
from tests.unit.test_docs import ROOT

PAGES = (
    "index",
    "start/index",
    "tutorials/fmu_in_tools",
    "reference/drawing_format",
    "reference/effects",
    "reference/effects/hysteresis",
    "reference/fmu_variables",
    "reference/record",
    "explanation/interventions",
    "explanation/validation",
)
MEASURE = """<pre id="found"></pre><script>
const pages = PAGES, found = {};
(async () => {
  for (const page of pages) {
    const frame = document.createElement("iframe");
    frame.style.width = "390px";
    frame.src = `${page}.html`;
    document.body.append(frame);
    await new Promise((loaded) => (frame.onload = loaded));
    const inside = frame.contentDocument;
    const wide = [...inside.querySelectorAll("table.docutils")].filter(
      (table) => table.parentElement.scrollWidth > table.parentElement.clientWidth + 1
    );
    const cut = [...inside.querySelectorAll("figure img")].filter(
      (image) => image.getBoundingClientRect().right > frame.clientWidth
    );
    found[page] = [
      inside.querySelectorAll("table.docutils").length,
      ...wide.map((table) => table.textContent.trim().slice(0, 60)),
      ...cut.map((image) => image.alt),
    ];
    frame.remove();
  }
  document.getElementById("found").textContent = JSON.stringify(found);
})();
</script>"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="foreign host Chromium")
def test_tables_and_pictures_fit(tmp_path: Path) -> None:
    pytest.importorskip("furo", reason="foreign host Chromium: the site is not installed")
    copy, site = tmp_path / "reefmu", tmp_path / "site"
    shutil.copytree(ROOT / "docs", copy / "docs", ignore=shutil.ignore_patterns("_build", "gallery"))
    for linked in ("examples", "stiffness_model", "reefmu"):
        (copy / linked).symlink_to(ROOT / linked, target_is_directory=True)
    build = ["-q", "-b", "html", "-D", "plot_gallery=0", "docs", str(site)]
    subprocess.run([sys.executable, "-m", "sphinx", *build], cwd=copy, check=True, timeout=TIMEOUT, capture_output=True)
    (site / "measure.html").write_text(MEASURE.replace("PAGES", json.dumps(PAGES)), "utf-8")
    assert CHROMIUM is not None
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-web-security"]
    command += ["--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}"]
    command += ["--virtual-time-budget=60000", "--dump-dom", (site / "measure.html").as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIMEOUT)
    answer = re.search(r'<pre id="found">(\{.*?\})</pre>', done.stdout)
    assert answer is not None, done.stderr
    found = json.loads(answer[1])
    assert set(found) == set(PAGES)
    assert found["reference/drawing_format"][0] > 8
    assert {page: rest for page, (_, *rest) in found.items() if rest} == {}
