"""How well the noise of a record is estimated before anything is fitted, beside what is missing in it.

Run as `python tests/benchmarks/diagnosis/bench_noise.py --seed 14 --count 90`, on records of the second generator,
which knows their noise: a first-order autoregression of the torque. The noise of the encoders, which is in the estimate
times the stiffness, is not counted in the truth, so that ratios are a few per cent above 1.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.preparation import BaseCurveSource, guess_stiffness  # noqa: E402
from reefmu.diagnosis.preprocessing.noise import estimate_noise  # noqa: E402
from reefmu.diagnosis.preprocessing.trace import make_trace  # noqa: E402
from tests.benchmarks.probabilities.observed_records import second_record  # noqa: E402

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


def ratios(seed: int, number: int) -> tuple[float, float]:
    """Estimated over true standard deviation, of samples and of sums over many of them."""
    record, drive, truth = second_record(number, seed)
    trace = make_trace(record, drive.ratio)
    slope = guess_stiffness(trace, BaseCurveSource(drive).base_curve(trace))
    found, rho = estimate_noise(trace, slope), truth["correlation"]
    single = float(np.sqrt(np.mean(found.variance(slope)))) / truth["noise"]
    return single, single * float(np.sqrt(found.correlation.correlation_time * (1 - rho) / (1 + rho)))


def main() -> None:
    """Print quantiles of both ratios."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--seed", type=int, default=14, help="of the catalogue")
    parser.add_argument("--count", type=int, default=90, help="records")
    arguments = parser.parse_args()
    found = np.array([ratios(arguments.seed, number) for number in range(arguments.count)])
    print("quantiles     ", "  ".join(f"{q:5.2f}" for q in QUANTILES), " rms of the logarithm")
    for name, values in zip(("samples", "sums"), found.T, strict=True):
        spread = float(np.sqrt(np.mean(np.log(values) ** 2)))
        print(f"{name:14}", "  ".join(f"{v:5.2f}" for v in np.quantile(values, QUANTILES)), f" {spread:.3f}")


if __name__ == "__main__":
    main()
