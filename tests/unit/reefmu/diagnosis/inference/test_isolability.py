"""What tells effects apart, in words."""

from __future__ import annotations

from reefmu.diagnosis.inference.isolability import separating_experiments, separating_line


def test_a_pair_has_one_line_whichever_of_both_is_named_first() -> None:
    for first, second in (("hysteresis", "coulomb_friction"), ("backlash", "preload")):
        assert separating_line(first, second) == separating_line(second, first)
        assert separating_experiments([(first,), (second,)]) == [separating_line(second, first)]
