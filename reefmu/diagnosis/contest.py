"""Names against anonymous rivals: which names stand where something is left that none explains.

A rival only enters where the best set of names leaves it something beyond what the noise and the form of the named
effects could make. Then every set that was fitted is held up again with the rival beside it, and the smallest set that
is as good as the best keeps its names: a name that the rival replaces was a disguise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .anonymous import CURVE, Family, Rival, rivals
from .fit import Fit
from .identify import Search, degenerate
from .study import Study

Array = NDArray[np.float64]

SIGNIFICANT = 30.0
"""Gain that noise does not give a rival; simulated and blind clean records stay under 7."""
FORM = 0.0015
"""Share of the names' gain within which what they leave is an error of their form: a creep with three times for one,
friction with a spread of slip lengths."""
REPLACED, REPLACED_SHARE = 20.0, 0.1
"""A name must be worth more than this beside a rival, and this share of what the rival gains beside the best set."""
BEND, CURVED = 0.003, 100.0
"""Share of the gain that a bend takes beside names of the curve to be no error of their form; and how much worse the
curve alone may be."""
FEW = 3
"""Sets of every size that are held up again."""
STATIC = frozenset({"modulus_error", "structural_compliance", "backlash", "preload"})
"""Effects that only change the curve."""
TOLERATED = 2.0
"""Standard deviations of the population within which a curve is no gap."""


@dataclass(frozen=True)
class Contest:
    """kept: fit of the names that stand, the base fit if none; rival: what is left beside them, None if nothing;
    tolerated: whether that is a curve such as drives of the population have."""

    kept: Fit
    rival: Rival | None
    tolerated: bool = False


def contest(study: Study, found: Search, best: Fit, spread: Array | None) -> Contest:
    """Hold the best set of names against rivals; spread: (n,) N.m, of the population's curves, None if unknown."""
    base = found.base
    gain = max(base.cost - best.cost, 0.0)
    beside = rivals(study, best)
    rest = beside[0].gain if beside else 0.0
    if rest < max(SIGNIFICANT, FORM * gain):
        curve = _curve(study, base, beside)
        if len(best.names) > 1 and set(best.names) <= STATIC and spread is not None and curve is not None \
                and base.cost - curve.gain < best.cost + REPLACED and _tolerated(study, curve, spread):
            return Contest(base, curve, True)
        return Contest(best, None)
    known: list[Family] = [r.family for r in beside[:4]]
    alone = rivals(study, base) if best.names else beside
    known += [r.family for r in alone[:2] if r.family.place not in {f.place for f in known}]
    margin = max(REPLACED, REPLACED_SHARE * rest)
    sets = _sets(study, found, best)
    joint = [(f, rivals(study, f, known)[0]) for f in sets]
    top = min(f.cost - r.gain for f, r in joint)
    alike = [(f, r) for f, r in joint if f.cost - r.gain < top + margin]
    kept, rival = min(alike, key=lambda item: (len(item[0].names), item[0].cost - item[1].gain))
    if spread is None or rival.family.place != CURVE or not set(kept.names) <= STATIC:
        return Contest(kept, rival)
    # The curve itself is off. A bend that the names leave is more than their form, so the whole may be a tolerance.
    curve = rivals(study, base, [rival.family])[0]
    alike = base.cost - curve.gain < kept.cost - rival.gain + CURVED
    if (not kept.names or (alike and rest > BEND * gain)) and _tolerated(study, curve, spread):
        return Contest(base, curve, True)
    return Contest(kept, rival)


def _sets(study: Study, found: Search, best: Fit) -> list[Fit]:
    """The base, the best set, all of its parts that were fitted, and the best few of every size."""
    sets = [found.base, best]
    for size in range(1, len(best.names) + 1):
        fits = [f for f in found.best.get(size, []) if not degenerate(study, f)]
        sets += [f for k, f in enumerate(fits) if k < FEW or set(f.names) < set(best.names)]
    return list({frozenset(f.names): f for f in reversed(sets)}.values())


def _curve(study: Study, base: Fit, beside: list[Rival]) -> Rival | None:
    """The static curve as a rival of all names."""
    curves = [r.family for r in beside if r.family.place == CURVE]
    return rivals(study, base, curves)[0] if curves else None


def _tolerated(study: Study, rival: Rival, spread: Array) -> bool:
    """Whether a curve over the torque is one that drives of the population have: as large, and odd."""
    torque, part = study.torque, rival.part
    order = np.argsort(torque)
    other = np.interp(-torque, torque[order], part[order])
    inside = (-torque > torque.min()) & (-torque < torque.max())
    even, odd = (part + other)[inside] / 2, (part - other)[inside] / 2
    level = np.abs(torque[inside]) > 0.1 * study.base.full_torque
    if not level.any():
        return False
    small = float(np.sqrt(np.mean(odd[level] ** 2))) < TOLERATED * float(np.sqrt(np.mean(spread[inside][level] ** 2)))
    return small and float(np.mean(even**2)) < 0.1 * float(np.mean(odd**2))
