"""Sizes that drawings, materials and rigs make plausible, and the forms that the hidden effects take.

Ranges are logarithmically uniform: of a fault one knows the order of magnitude. None depends on a record's noise.
"""

from __future__ import annotations

import functools

import numpy as np

from stiffness_model import Drive
from tests.validation.blind.drawings import DRAWINGS, load

from .contacts import MeanDrive, mean_drive
from .foreign import KINDS, Foreign
from .simulate import Shape

Rng = np.random.Generator

WEAR_TRAVEL = 6600.0
"""rad, the crank's way in the run of many turns, after which the wear's depth is stated."""
BASE_ECCENTRICITY, BASE_HARD = 0.0024, 0.01
"""Standard deviations, relative, of the eccentricity (IT7 of a throw of some 0.7 mm: a sixth of 10 um) and of the
modulus of hardened steel (data sheets: 205 to 213 GPa)."""
BASE_SOFT_STEEL, BASE_SOFT_PLASTIC = 0.01, 0.04
"""The same of gear and cage: of steel, and of printed PLA from one spool to another."""


@functools.lru_cache(maxsize=12)
def mean_of(drawing: int) -> MeanDrive:
    """The mean drive of a drawing of `blind.drawings.DRAWINGS`."""
    return mean_drive(load(drawing))


def tolerance_deviation(name: str, drawing: int) -> float | None:
    """One standard deviation, SI, of what a drawing's tolerances, a material or a sensor's class leave open of an
    effect's first size; None for effects that no tolerance makes."""
    drive = load(drawing)
    soft = BASE_SOFT_PLASTIC if DRAWINGS[drawing].plastic else BASE_SOFT_STEEL
    return {
        "backlash": drive.tolerances["gear"].sigma,
        "preload": drive.tolerances["gear"].sigma,
        "modulus_error": soft,
        "kinematic_error": drive.tolerances["crank"].sigma / drive.path.centre_distance,
        # A sensor of class 0.1, rated at full torque: its zero is good to a thousandth.
        "torque_sensor_offset": 1e-3 * mean_of(drawing).full_torque,
    }.get(name)


TOLERATED = ("backlash", "preload", "modulus_error", "kinematic_error", "torque_sensor_offset")
"""Effects that have a `tolerance_deviation`."""


def size_range(name: str, drawing: int) -> tuple[float, float]:
    """Least and greatest size of an effect, SI, without its sign."""
    drive, mean, plastic = load(drawing), mean_of(drawing), DRAWINGS[drawing].plastic
    full, twist = mean.full_torque, drive.max_twist
    radius = drive.path.centre_distance
    return {
        # The process of a lot may stand anywhere in the zone, which is three deviations to either side, and beyond.
        "backlash": (0.3 * drive.tolerances["gear"].sigma, 4.0 * drive.tolerances["gear"].sigma),
        "preload": (0.3 * drive.tolerances["gear"].sigma, 3.0 * drive.tolerances["gear"].sigma),
        # Part of the difference of expansion between gear and inner parts over the radius, 11.5e-6/K and 68e-6/K.
        "thermal_clearance": (0.05 * 11.5e-6 * radius, 0.5 * 11.5e-6 * radius)
        if not plastic
        else (0.1 * 56e-6 * radius, 56e-6 * radius),
        # Depth after the run of many turns, in deviations of the gear.
        "wear": (
            0.3 * drive.tolerances["gear"].sigma / WEAR_TRAVEL,
            3 * drive.tolerances["gear"].sigma / WEAR_TRAVEL,
        ),
        # Another alloy or another infill than drawn.
        "modulus_error": (0.04, 0.35) if not plastic else (0.08, 0.5),
        "missing_ball": (1.0, 1.0),
        # Of crank bearing, shafts and housing: 3 arcmin at 300 N.m beside the contacts' 8, and less and more.
        "structural_compliance": (0.02 * twist / full, 0.4 * twist / full),
        "creep": (0.005 * twist / full, 0.06 * twist / full)
        if not plastic
        else (0.03 * twist / full, 0.4 * twist / full),
        # Run-out of the crank: some micrometres on the radius, tenths of a millimetre where printed.
        "kinematic_error": (1.5e-6 / radius, 15e-6 / radius) if not plastic else (8e-6 / radius, 80e-6 / radius),
        "hysteresis": (0.003 * full, 0.04 * full),
        "load_dependent_hysteresis": (0.005, 0.08),
        # Relaxation times of grease and of plastics.
        "damping": (2e-3 * full / twist, 40e-3 * full / twist),
        "coulomb_friction": (0.003 * full, 0.04 * full),
        # Up to some per cent of full torque at the fastest rotation.
        "viscous_friction": (0.003 * full / 1.7, 0.06 * full / 1.7),
        "stribeck_friction": (0.003 * full, 0.03 * full),
        "torque_sensor_offset": (0.001 * full, 0.02 * full),
        # Over a record of three quarters of an hour.
        "torque_sensor_drift": (0.001 * full / 2700, 0.02 * full / 2700),
    }[name]


def draw_size(name: str, drawing: int, rng: Rng) -> float:
    """Size of an effect, SI, as `simulate.Hidden` has it."""
    low, high = size_range(name, drawing)
    sign = float(rng.choice([-1.0, 1.0]))
    size = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    if name in ("thermal_clearance", "torque_sensor_offset", "torque_sensor_drift"):
        return sign * size
    if name == "modulus_error":
        # Softer more often than stiffer.
        return size if sign > 0 and rng.uniform() < 0.7 else -size / (1 + size)
    return size


def draw_shape(drawing: int, rng: Rng) -> Shape:
    """The forms that the effects have in one case."""
    twist = load(drawing).max_twist

    def lengths(low: float, high: float) -> tuple[float, ...]:
        middle = np.exp(rng.uniform(np.log(low), np.log(high)))
        width = rng.uniform(0.1, 1.0)
        return tuple((middle * np.exp(width * np.array([-1.3, -0.5, 0.2, 0.8]))).tolist())

    times = np.exp(rng.uniform(np.log(4.0), np.log(40.0))) * np.exp(rng.uniform(0.0, 1.3) * np.array([-1.0, 0.0, 1.0]))
    weights = rng.dirichlet([4.0, 6.0, 4.0])
    orders = rng.choice([1, 2, 3, 4], 2, replace=False, p=[0.4, 0.3, 0.2, 0.1])
    strengths = (1.0, float(rng.uniform(0.1, 0.7)))
    return Shape(
        slip=lengths(0.008 * twist, 0.05 * twist),
        rubbing=lengths(0.004 * twist, 0.04 * twist),
        creep_times=tuple(times.tolist()),
        creep_weights=tuple(weights.tolist()),
        bearing=(float(rng.choice([2 / 3, 0.9, 1.0])), float(rng.uniform(0, 0.4))),
        orders=tuple((int(k), w, float(rng.uniform(0, 2 * np.pi))) for k, w in zip(orders, strengths, strict=True)),
        stribeck=(float(np.exp(rng.uniform(np.log(0.03), np.log(0.3)))), float(rng.choice([1.0, 2.0]))),
        settling=float(np.exp(rng.uniform(np.log(0.5), np.log(10.0)))),
        place=float(rng.uniform(-1.0, 1.0) * np.pi),
    )


def draw_foreign(kind: str, rng: Rng) -> Foreign:
    """An effect without a name."""
    low, high = KINDS[kind].low, KINDS[kind].high
    return Foreign(kind, float(np.exp(rng.uniform(np.log(low), np.log(high)))), float(rng.uniform()))


def base_factors(drive: Drive, rng: Rng, soft: float = 0.0) -> tuple[float, float, float]:
    """Factors of eccentricity and moduli (see `contacts.varied`) of one drive within its tolerances; soft: standard
    deviation of gear's and cage's, relative."""
    z = np.clip(rng.standard_normal(3), -2.5, 2.5)
    return 1 + BASE_ECCENTRICITY * z[0], 1 + BASE_HARD * z[1], 1 + soft * z[2]
