"""The corrected model: the base curve with the missing effects, as `reefmu.simulate` and an FMU run it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stiffness_model.io.drawing_toml import drive_from_dict
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.numerics.arrays import Array

from ...model.chosen_effects import undiagnosed_effects
from ...model.drive_model import DriveModel, build_curve_model, build_model
from ...record import Record, make_record
from ...simulate import simulate_record
from ..estimation.held_out import NO_WEIGHT, held_out_blocks
from ..estimation.least_squares import HELD_SIZE, Fit, fit
from ..estimation.problem import Problem
from ..estimation.weighting import make_weighting
from ..fitted_values import CrankLosses
from ..forward.base_curve import BaseCurve, tabulate_base
from ..forward.parameter_layout import DELAY, ZERO
from ..preprocessing.trace import Trace


def written_fit(problem: Problem, found: Fit, *, held_out: bool = False) -> Fit:
    """A fit with the zero and the base curve of the model that is written; its effects are unchanged.

    A model has the effects and not the scatter of this one drive. Beside that scatter a fit hardly determines the zero
    of the twist and the shape of the base curve, because the scatter takes up what they miss: without it such a model
    may be farther from the record than one without effects. Here both are those of the least root mean square over the
    record, held_out: over the blocks that are not held out. Nor has a model the delay of the rig, which remains the one
    that was found. A fit without scatter is returned as it is.
    """
    n, n_base = len(problem.torque), problem.layout(()).n_base
    if not len(found.weighting.eigenvalues):
        return found
    low, high = found.bounds.low.copy(), found.bounds.high.copy()
    low[n_base:] = high[n_base:] = found.parameters[n_base:]
    low[DELAY] = high[DELAY] = 0.0
    variance = np.full(n, float(problem.variance.mean()))
    if held_out:
        variance[held_out_blocks(problem)] *= NO_WEIGHT
    closest = fit(
        problem.predictor(found.names),
        problem.torque,
        make_weighting(variance, np.zeros((0, n))),
        replace(found.bounds, low=low, high=high),
        found.parameters,
        HELD_SIZE,
    )
    parameters = closest.parameters.copy()
    parameters[DELAY] = found.parameters[DELAY]
    return replace(found, parameters=parameters, prediction=closest.prediction)


def corrected_model(
    problem: Problem, chosen: Fit, losses: CrankLosses | None = None, *, keeps_stated: bool = True
) -> DriveModel:
    """The drive model with the effects of a fit and the zero of the record's twist, as model.toml holds it.

    Effects that the drawing or the data sheet states and no record shows, such as friction at the crank, stay inside.
    losses: friction at the crank of a record that shows it, in place of what is stated. keeps_stated: see `Analysis`.
    """
    base, layout = problem.base, problem.layout(chosen.names)
    found = {} if losses is None else {"crank_friction": losses.effect_values()}
    stated = stated_effects(base) if keeps_stated else {}
    effects = {**stated, **found, **layout.by_effect(chosen.parameters)}
    table = tabulate_base(base, chosen.parameters[layout.shape])
    if isinstance(table, CurveLookup):
        model = build_curve_model(table, effects, assumed_ratio=problem.trace.crank_factor)
    else:
        assert base.drive is not None
        model = build_model(base.drive, effects, lookup=table, inherent=False)
    return replace(model, twist_zero=float(chosen.parameters[ZERO]))


def stated_effects(base: BaseCurve) -> dict[str, dict[str, float]]:
    """Parameter values of the effects that the drive of a base curve states and no record shows, by effect and name."""
    if base.drive is not None:
        return undiagnosed_effects(base.drive)
    # A data sheet's curve carries the sheet along; a curve file and a power law state nothing.
    sheet = base.lookup.drawing.get("drive") if isinstance(base.lookup, CurveLookup) else None
    return {} if sheet is None else undiagnosed_effects(drive_from_dict(sheet))


def denoised_record(trace: Trace, zero: float) -> tuple[Record, Array]:
    """The record as it was fitted, and the noise (n,), rad, that was removed from its twist.

    Angles and speeds are without their noise. zero: rad, arbitrary zero of the twist, which is removed at the output.
    The noise of the twist reaches the torque through the stiffness.
    """
    crank, output = trace.crank, trace.crank / trace.crank_factor - trace.smooth_twist
    if np.ptp(trace.output) == 0 and np.ptp(crank) > 0:
        # A locked output stands still, whatever was removed from its twist as noise.
        crank, output = trace.crank_factor * (trace.smooth_twist + trace.output), trace.output
    record = make_record(
        {
            "time": trace.time,
            "run": trace.run.astype(float),
            "crank_angle": crank,
            "output_angle": output + zero,
            "output_torque": trace.torque,
            "temperature": trace.temperature,
        },
        "conditioned record",
    )
    # No effect depends on the speed of the crank alone, so that it follows from those of twist and output as fitted.
    speeds = np.stack([trace.crank_factor * (trace.output_speed + trace.twist_rate), trace.output_speed], axis=1)
    return replace(record, speeds=speeds), trace.twist - trace.smooth_twist


def simulated_torque(model: DriveModel, trace: Trace, zero: float) -> Array:
    """Torque (n,), N.m, that the sensor would measure, from `reefmu.simulate` over the record; zero: rad, of the
    twist."""
    record, noise = denoised_record(trace, zero)
    response = simulate_record(model, record)
    return response["measured.tau"] + response["stiffness"] * noise
