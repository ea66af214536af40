"""What the software writes for fixed inputs stays what it was: moves and renames of code change no number."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.validation.fingerprint import GOLDEN, fingerprints

DIAGNOSIS = 1e-6
"""Relative tolerance of fitted sizes, which iterations stop at; of all other numbers `SOLVED`."""
SOLVED = 1e-9


@pytest.mark.slow
def test_files_are_as_they_were() -> None:
    golden = json.loads(GOLDEN.read_text("utf-8"))
    now = fingerprints()
    assert now.keys() == golden.keys()
    for name, content in golden.items():
        found = now[name]
        assert (found["text"], found["count"]) == (content["text"], content["count"]), name
        fitted = name.startswith(("drawing/", "power_law/"))
        greatest = np.abs(content["numbers"]).max(initial=0.0)
        np.testing.assert_allclose(
            found["numbers"],
            content["numbers"],
            rtol=DIAGNOSIS if fitted else SOLVED,
            atol=1e-12 * greatest,
            err_msg=name,
        )
