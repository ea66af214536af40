"""The gap between model and record, before and after, over the whole record and over runs that were not fitted.

Every value is of the model that is written, run by `reefmu.simulate`, and independent of the predictor that fits. The
gap of the raw record is that of a plain simulation over the angles as measured, whose noise moves friction back and
forth; the other takes the angles without their noise, as they were fitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...record import Record, with_twist_zero
from ...simulate import simulate_record
from ..analysis import WrittenFits
from ..estimation.held_out import held_out_blocks
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import predicted_scatter
from ..forward.parameter_layout import ZERO
from ..preprocessing.trace import Trace
from ..schema import Gap
from .corrected_model import corrected_model, simulated_torque, written_fit


def measure_gap(problem: Problem, record: Record, trace: Trace, written: WrittenFits, held: Sequence[Fit]) -> Gap:
    """The gap over all samples of a record.

    trace: its signals as measured; that of the problem has the twist of the neighbours. held: the fits without and with
    the named effects to the runs that were not held out (`fits_without_held_out`), empty where no effect is named.
    """
    base, chosen = written.base, written.corrected
    samples = problem.blocks.spread(held_out_blocks(problem))
    slope = chosen.prediction.slope
    variance = problem.noise.variance(slope)
    if problem.cycle_scatter is not None:
        variance = variance + problem.cycle_scatter.variance
    noise = float(np.sqrt(np.average(variance, weights=problem.blocks.count)))
    before = after = simulated_residual(problem, trace, base)
    held_before = held_after = _rms(before[samples])
    if held:
        after = simulated_residual(problem, trace, chosen)
        held_before, held_after = (
            _rms(simulated_residual(problem, trace, written_fit(problem, found, held_out=True))[samples])
            for found in held
        )
    raw_before = raw_after = raw_residual(problem, record, base)
    if chosen.names:
        raw_after = raw_residual(problem, record, chosen)
    own = own_scatter(problem, chosen)
    return Gap(
        _rms(before),
        _rms(after),
        noise,
        held_before,
        held_after,
        after_own_scatter=None if own is None else _rms(after - own),
        raw_before=_rms(raw_before),
        raw_after=_rms(raw_after),
    )


def own_scatter(problem: Problem, found: Fit) -> Array | None:
    """The likeliest scatter (n,), N.m, of this one drive at all samples; None without a drawing."""
    if problem.scatter is None or not len(found.weighting.eigenvalues):
        return None
    rest = problem.torque - found.prediction.torque
    return problem.blocks.spread(predicted_scatter(problem, found, rest))


def simulated_residual(problem: Problem, trace: Trace, found: Fit) -> Array:
    """Measured less simulated torque (n,), N.m, at all samples of a trace."""
    return trace.torque - simulated_torque(corrected_model(problem, found), trace, float(found.parameters[ZERO]))


def raw_residual(problem: Problem, record: Record, found: Fit) -> Array:
    """Measured less simulated torque (n,), N.m, at all samples of a record, with the angles as measured."""
    model = corrected_model(problem, found)
    return record.output_torque - simulate_record(model, with_twist_zero(record, model.twist_zero))["measured.tau"]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
