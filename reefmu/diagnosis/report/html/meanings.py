"""What the quantities of the page are, in words that stand beside them."""

from __future__ import annotations

from collections.abc import Sequence

GAP_MEANING = (
    "Root mean square of the measured minus the simulated torque over all samples: without, then with the effects. "
    "Noise: standard deviation of all that does not repeat. Held out: runs that a second fit did not use. "
    "With the angles as measured: simulated from angles whose own noise is not removed."
)
LOCATION_MEANING = (
    "Share: part of the systematic gap (its mean square beyond the noise) that the means over groups of blocks along "
    "the coordinate explain. Coordinates vary together: each share stands alone, and they do not add up to 100 %."
)
REMAINDER_MEANING = (
    "Remainder: root mean square of what the effects leave beyond noise and tolerance scatter. Shares as above, of the "
    "remainder."
)
SEARCH_MEANING = (
    "Gain: by how much a set lowers -2 log likelihood compared with no effect. Excess left: -2 log likelihood beyond "
    "its expectation under noise and scatter alone; negative where a model fits better than that."
)
_SYSTEMATIC = "Systematic gap: mean square of the gap without effects, beyond that of the noise."


def shares_text(shares: Sequence[float]) -> str:
    """What the shares of the named effects add up to.

    >>> shares_text([0.25, 0.7])[-84:]
    'among them in proportion to the residual that the model leaves without each of them.'
    """
    total = sum(shares)
    if len(shares) == 1:
        return f"{_SYSTEMATIC} {100 * max(1 - total, 0.0):.0f} % of it are left."
    return (
        f"{_SYSTEMATIC} The effects together remove {100 * total:.0f} % of it, which is divided among them in "
        "proportion to the residual that the model leaves without each of them."
    )
