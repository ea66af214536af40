"""What a record can tell at best: the Cramer-Rao bound of the generator's own linearised responses.

The covariance is that of the rig's noise, of individuals drawn by the generator along the record, and of the base
curve's tolerance. An effect of size a whose response, whitened and freed of all that competes with it, has the norm d
is estimated with a standard deviation of a/d, and the odds against the model without it are exp(d^2/2) on average.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from stiffness_model.numerics.arrays import Array
from tests.validation.blind.protocols import Schedule
from tests.validation.blind.sizing import EFFECTS

from .catalogue import Case
from .contacts import MeanDrive, draw_assembly, linear_columns, mean_curve, varied
from .measure import noise_parts
from .priors import BASE_ECCENTRICITY, BASE_HARD, size_range
from .simulate import Hidden, Motion, Shape, run

SEPARABLE = 6.0
"""Standard deviations that tell two models apart: the log odds have mean d^2/2 and deviation d, so that odds of 19 to
1, those of a name at 95 %, are reached in 99 % of all records."""
INDISTINGUISHABLE = 2.0
"""Below this the truth is the likelier of two models in less than 84 % of all records."""
BLOCK = 20
"""Samples whose means stand for them."""
INDIVIDUALS = 40
ROUGH = 0.01
"""Share of the scatter's variance that is not linear in the deviations and follows no direction of its own. In the
presets 4 % are not linear, of which a good model holds the most; a hundredth is chosen by judgement."""
_SIGN_PAIR = {"backlash": "preload", "preload": "backlash"}
_NEEDS = {
    "thermal_clearance": "temperature",
    "kinematic_error": "crank_angle",
    "wear": "crank_angle",
    "missing_ball": "crank_angle",
}


@dataclass(frozen=True)
class Sight:
    """What can be seen of the truth at best. detectable: d of each hidden effect beside the others; isolable: d of each
    with its nearest rival beside; rivals: names that are nearer than `INDISTINGUISHABLE`; over_scatter: trace over what
    individuals show in its direction; foreign: what no single name takes of the foreign trace, as chi-square over that
    which an omnibus test of all blocks needs.
    """

    detectable: Mapping[str, float]
    isolable: Mapping[str, float]
    rivals: Mapping[str, tuple[str, ...]]
    over_scatter: Mapping[str, float]
    foreign: float


class Responses:
    """Traces of effects on the mean drive along a test, as means over blocks, N.m."""

    def __init__(self, case: Case, mean: MeanDrive, test: Schedule) -> None:
        self.case, self.mean, self.test = case, mean, test
        lengths = np.diff(test.starts)
        self.first = np.concatenate(
            [np.arange(start, start + length, BLOCK) for start, length in zip(test.starts, lengths, strict=False)]
        )
        self.count = np.diff(np.append(self.first, len(test.time)))
        self.centre = self.first + self.count // 2
        self.plain = run(mean, Hidden(), test)
        self.nodes = np.linspace(-1.8, 1.8, 49) * mean.full_twist
        self.drawn = mean_curve(mean.drive, self.nodes, elements=2048)

    def block(self, values: Array) -> Array:
        """Means over the blocks, (n_blocks,)."""
        return np.add.reduceat(values, self.first) / self.count

    def curve(self, eccentricity: float = 1.0, hard: float = 1.0, soft: float = 1.0) -> Array:
        """Trace of a drive whose base curve is off by factors as in `contacts.varied`."""
        other = mean_curve(varied(self.mean.drive, eccentricity, hard, soft), self.nodes, elements=2048)
        return self.block(np.interp(self.plain.contact, self.nodes, other - self.drawn))

    def trace(self, name: str, size: float, shape: Shape) -> Array:
        """Trace of one effect of the vocabulary."""
        if name == "modulus_error":
            return self.curve(soft=1 + size)
        if name == "missing_ball":
            contact, at = self.plain.contact[self.centre], self.centre
            cage = self.test.crank[at] / self.mean.drive.ratio - contact
            return -self.mean.missing_torque(contact, cage, np.zeros(len(at)), shape.place)
        hidden = Hidden({name: size}, shape)
        moved = name in ("backlash", "preload", "thermal_clearance", "wear")
        motion = run(self.mean, hidden, self.test, contact=None if moved else self.plain.contact)
        return self.block(motion.gap - self.plain.gap)

    def variants(self, name: str) -> list[Array]:
        """Columns (n_blocks, k) of an effect in the forms that it may have; each is a rival of its own."""
        size, twist = size_range(name, self.case.drawing)[0], self.mean.full_twist

        def columns(shapes: Iterable[Shape]) -> Array:
            return np.stack([self.trace(name, size, shape) for shape in shapes], axis=1)

        match name:
            case "missing_ball":
                return [columns([Shape(place=place)]) for place in np.linspace(-np.pi, np.pi, 16, endpoint=False)]
            case "kinematic_error":
                return [columns(Shape(orders=((k, 1.0, p),)) for k in (1, 2, 3, 4) for p in (0.0, np.pi / 2))]
            case "creep":
                return [columns(Shape(creep_times=(time,)) for time in (4.0, 20.0))]
            case "hysteresis" | "load_dependent_hysteresis":
                return [columns(Shape(slip=(share * twist,)) for share in (0.01, 0.05))]
            case "coulomb_friction":
                return [columns(Shape(rubbing=(share * twist,)) for share in (0.005, 0.04))]
            case "stribeck_friction":
                return [columns([Shape(rubbing=(0.01 * twist,), stribeck=(w, 2.0))]) for w in (0.03, 0.1, 0.3)]
            case "torque_sensor_drift":
                return [columns(Shape(settling=settling) for settling in (0.5, 10.0))]
        return [columns([Shape()])]

    def scatter(self, rng: np.random.Generator) -> Array:
        """Torque of individuals less the mean drive's, (INDIVIDUALS, n_blocks) N.m."""
        contact, drive = self.plain.contact[self.centre], self.mean.drive
        cage, none = self.test.crank[self.centre] / drive.ratio - contact, np.zeros(len(contact))
        mean = self.mean.torque(contact, cage, none)
        return np.stack([draw_assembly(drive, rng).torque(contact, cage, none) - mean for _ in range(INDIVIDUALS)])

    def deviations(self, start: float) -> Array:
        """Columns (n_deviations, n_blocks), N.m, of the sizes and positions of a drive; start as in
        `contacts.linear_columns`."""
        contact, drive = self.plain.contact[self.centre], self.mean.drive
        return linear_columns(drive, start, contact, self.test.crank[self.centre] / drive.ratio - contact)


def noise_covariance(case: Case, responses: Responses) -> Array:
    """Covariance (n_blocks, n_blocks), (N.m)^2, of the blocks' means of the rig's noise."""
    rig, test = case.rig, responses.test
    torque, angle = noise_parts(rig, responses.mean, responses.plain)
    slope = responses.block(responses.plain.slope)
    run_number = test.run[responses.first]
    same = run_number[:, None] == run_number
    whole = same * torque**2 * _block_correlation(rig.correlation, rig.mixed, responses)
    own = same * angle**2 * _block_correlation(0.6 * rig.correlation, rig.mixed, responses)
    return whole + slope[:, None] * slope * own


def _block_correlation(correlation: float, mixed: float, responses: Responses) -> Array:
    """Covariance of means of unit noise over blocks of one run."""
    rho, number, count = correlation, responses.first, responses.count.astype(float)
    gap = np.abs(number[:, None] - number)
    lags = np.arange(1, BLOCK)
    own = (1 + 2 * ((1 - lags[:, None] / count) * (lags[:, None] < count) * rho ** lags[:, None]).sum(axis=0)) / count
    between = np.zeros_like(gap, dtype=float)
    if rho > 0:
        geometric = (1 - rho**count) / (1 - rho) / count
        earlier = np.minimum(number[:, None], number)
        length = count[np.searchsorted(number, earlier)]
        between = rho ** np.maximum(gap - length + 1, 1) * geometric[:, None] * geometric
    found = (1 - mixed) * between
    np.fill_diagonal(found, (1 - mixed) * own + mixed / count)
    return found


def sight(
    case: Case,
    hidden: Hidden,
    responses: Responses,
    foreign: tuple[Motion, Motion] | None,
    start: float,
    rng: np.random.Generator,
) -> Sight:
    """Bounds of one case. foreign: the motion with what has no name, and without it; start: place of the first element
    on the profile, rad."""
    base = [responses.curve(eccentricity=1 + BASE_ECCENTRICITY), responses.curve(hard=1 + BASE_HARD)]
    covariance = noise_covariance(case, responses)
    drives = responses.scatter(rng)
    if case.individual:
        columns = np.vstack([responses.deviations(start), *base])
        covariance = covariance + columns.T @ columns + np.diag(ROUGH * (drives**2).mean(axis=0))
    factor = cholesky(covariance + 1e-12 * np.trace(covariance) / len(covariance) * np.eye(len(covariance)), lower=True)

    def white(columns: Array) -> Array:
        return solve_triangular(factor, columns, lower=True)

    zero = responses.block(responses.plain.slope)[:, None]
    traces = {name: responses.trace(name, size, hidden.shape) for name, size in hidden.sizes.items()}
    known = {name: white(trace[:, None])[:, 0] for name, trace in traces.items()}
    wanted = bool(known) or foreign is not None
    rivals = {
        name: [white(v) for v in responses.variants(name)]
        for name in EFFECTS
        if wanted and _NEEDS.get(name) not in case.missing and name not in known
    }
    nuisance = white(zero)
    detectable, isolable, near = {}, {}, {}
    for name, own in known.items():
        others = [nuisance, *(trace[:, None] for other, trace in known.items() if other != name)]
        detectable[name] = left_over(own, others)
        distance = {
            rival: min(left_over(own, [*others, columns]) for columns in variants)
            for rival, variants in rivals.items()
            if rival != _SIGN_PAIR.get(name)
        }
        isolable[name] = min(distance.values(), default=detectable[name])
        near[name] = tuple(r for r, d in distance.items() if d < INDISTINGUISHABLE)
    over = {name: over_scatter(trace, zero[:, 0], drives) for name, trace in traces.items()}
    seen = 0.0
    if foreign is not None:
        trace = white(responses.block(foreign[0].gap - foreign[1].gap)[:, None])[:, 0]
        others = [nuisance, *(t[:, None] for t in known.values())]
        least = min(left_over(trace, [*others, c]) for variants in rivals.values() for c in variants)
        # A chi-square test of n blocks at 1 % has 95 % power where the excess is four of its deviations.
        seen = float(least**2 / (4 * np.sqrt(2 * len(trace))))
    return Sight(detectable, isolable, near, over, seen)


def left_over(own: Array, others: Sequence[Array]) -> float:
    """Norm of a whitened trace (n,) that columns (n, k) leave."""
    columns = np.concatenate(others, axis=1)
    norms = np.linalg.norm(columns, axis=0)
    basis, sizes, _ = np.linalg.svd(columns[:, norms > 0] / norms[norms > 0], full_matrices=False)
    basis = basis[:, sizes > 1e-7]
    return float(np.linalg.norm(own - basis @ (basis.T @ own)))


def over_scatter(trace: Array, zero: Array, drives: Array) -> float:
    """An effect's trace over the standard deviation of what individuals show in its direction, without the twist's
    zero, which is free."""
    zero = zero / np.linalg.norm(zero)
    own = trace - zero * (zero @ trace)
    return float(own @ own / max(np.std(drives @ own), 1e-300))
