"""The designs to evaluate: a Sobol sample, then the generations of NSGA-II from its best designs.

Both work in the unit cube. The search is a generator: it yields positions (n, n_parameters) and is sent their
`Evaluations`. It depends only on the study's seed and on the evaluations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import numpy as np

from ...errors import InputError, install_command
from ...numerics.arrays import Array
from ..definition.study import Study
from ..evaluation.evaluate import Evaluations
from .pareto import minimised_objectives, violations

WORST = 1e30
"""Takes the place of the objectives of a design that was not simulated, which its violation ranks last anyway."""


def sample(study: Study) -> Array:
    """The study's designs, (designs, n_parameters): the first points of a scrambled Sobol sequence.

    The first of a larger sample are those of a smaller one.

    >>> from ..definition.study_toml import load_study
    >>> points = sample(load_study("tolerance_field"))
    >>> points.shape, bool((abs(points.mean(axis=0) - 0.5) < 0.04).all())
    ((1024, 4), True)
    """
    from scipy.stats import qmc

    numbers, seed = study.numbers, np.random.SeedSequence(study.numbers.seed)
    # SciPy 1.15 renamed the argument to `rng` and takes both names; older ones take this one alone.
    make: Any = qmc.Sobol
    engine = make(len(study.parameters), seed=np.random.Generator(np.random.PCG64(seed)))
    points = engine.random_base2(math.ceil(math.log2(max(2, numbers.designs))))[: numbers.designs]
    return snap(study, points)


def snap(study: Study, positions: Array) -> Array:
    """Positions of discrete parameters at the middles of their cells."""
    return np.array([[p.snap(float(x)) for p, x in zip(study.parameters, row, strict=True)] for row in positions])


def search(study: Study) -> Generator[Array, Evaluations, None]:
    """The sample, then generation after generation.

    Raises `InputError` before the sample where generations are wanted and pymoo is missing.
    """
    start = _nsga2(study) if study.numbers.generations else None
    found = yield sample(study)
    if start is None:
        return
    optimiser, assign = start(found)
    for _ in range(study.numbers.generations):
        asked = optimiser.ask()
        if asked is None:
            # All neighbours in a small discrete space have been evaluated.
            return
        optimiser.tell(infills=assign(asked, (yield asked.get("X").astype(float))))


def _nsga2(study: Study) -> Callable[[Evaluations], tuple[Any, Callable[[Any, Evaluations], Any]]]:
    """A function that starts pymoo's NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002) from an evaluated sample.

    It returns the algorithm and a function that assigns evaluations to a population. Raises `InputError` without pymoo.
    """
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2, RankAndCrowding
        from pymoo.core.evaluator import Evaluator
        from pymoo.core.population import Population
        from pymoo.core.problem import Problem
        from pymoo.core.repair import Repair
        from pymoo.problems.static import StaticProblem
    except ImportError:
        raise InputError(
            f"generations: expected pymoo for the optimiser, got no such package: {install_command('explore')}, "
            "or set generations = 0 for the sample alone"
        ) from None
    count, numbers = len(study.parameters), study.numbers
    problem = Problem(n_var=count, n_obj=len(study.objectives), n_ieq_constr=1, xl=np.zeros(count), xu=np.ones(count))

    class Snap(Repair):
        """Puts equal designs at equal positions, so that the optimiser recognises duplicates."""

        def _do(self, problem: Any, X: Array, **_: Any) -> Array:
            return snap(study, X)

    def assign(population: Any, found: Evaluations) -> Any:
        values = minimised_objectives(study, found)
        known = StaticProblem(problem, F=np.where(np.isnan(values), WORST, values), G=violations(study, found)[:, None])
        return Evaluator().eval(known, population)

    def start(found: Evaluations) -> tuple[Any, Callable[[Any, Evaluations], Any]]:
        everything = assign(Population.new("X", found.positions), found)
        first, later = (int(x) for x in np.random.SeedSequence(numbers.seed, spawn_key=(1,)).generate_state(2))
        # Without a seed pymoo draws one from the system, at every call.
        best = RankAndCrowding().do(
            problem,
            everything,
            n_survive=min(numbers.population, len(everything)),
            random_state=np.random.default_rng(first),
        )
        optimiser: Any = NSGA2(pop_size=numbers.population, repair=Snap(), sampling=best)
        optimiser.setup(problem, termination=("n_gen", numbers.generations + 2), seed=later)
        optimiser.tell(infills=optimiser.ask())
        return optimiser, assign

    return start
