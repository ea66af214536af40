"""compare.json and compare.html, both or none; and the spread between positions from an earlier compare.json."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path

from stiffness_model.errors import InputError
from stiffness_model.io.atomic_files import staged_folder

from ..diagnosis.report.html.origin import Origin
from .comparison_page import comparison_html
from .loop_quantities import QUANTITIES
from .position_scatter import KnownSpread
from .state_changes import StateComparison


def write_comparison(
    comparison: StateComparison,
    out: str | os.PathLike[str],
    origin: Origin | None = None,
    records: Sequence[str] = (),
) -> None:
    """Write compare.json and compare.html into the folder `out`, which is created if necessary.

    origin, records: command and paths of the records, for the page. Raises `InputError` if the folder cannot be
    written.
    """
    with staged_folder(out) as stage:
        text = json.dumps(comparison.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
        (stage / "compare.json").write_text(text + "\n", encoding="utf-8")
        (stage / "compare.html").write_text(comparison_html(comparison, origin, records), encoding="utf-8")


def read_spread(path: str | os.PathLike[str]) -> dict[str, KnownSpread]:
    """The spread between positions by quantity, from the compare.json of a comparison whose states have several.

    Raises `InputError` for a file that is none, or holds no spread.
    """
    try:
        table = json.loads(Path(path).read_text("utf-8"))["position_spread"]
        found = {name: KnownSpread(float(s["value"]), float(s["degrees"])) for name, s in table.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: expected a compare.json with 'position_spread', got {error!r}") from None
    known = {name: s for name, s in found.items() if name in QUANTITIES}
    if not known or not all(math.isfinite(s.value) and s.value > 0 and s.degrees > 0 for s in known.values()):
        raise InputError(
            f"{path}: expected positive spreads between positions, got none; its states have one position each"
        )
    return known
