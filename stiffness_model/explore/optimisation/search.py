"""Which designs to evaluate: a Sobol sample, then the generations of NSGA-II from the best of it.

Both see the unit cube. The search is a generator: it yields positions (n, n_parameters) and is sent their
`Evaluations`. It depends on the study's seed and on what it is sent, on nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import numpy as np

from ...errors import InputError
from ...numerics.arrays import Array
from ..definition.study import Study
from ..evaluation.evaluate import Evaluations
from .pareto import minimised_objectives, violations

WORST = 1e30
"""Stands for the objectives of a design that was not simulated; its violation ranks it last anyway."""


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
    optimiser, rate = start(found)
    for _ in range(study.numbers.generations):
        asked = optimiser.ask()
        if asked is None:
            # Every neighbour of a small discrete space has been tried.
            return
        optimiser.tell(infills=rate(asked, (yield asked.get("X").astype(float))))


def _nsga2(study: Study) -> Callable[[Evaluations], tuple[Any, Callable[[Any, Evaluations], Any]]]:
    """pymoo's NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002), to be started from an evaluated sample.

    Started, it is the algorithm and a function that gives a population its evaluations.
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
            "generations: expected pymoo for the optimiser, got none: pip install 'reefmu[explore]', "
            "or set generations = 0 for the sample alone"
        ) from None
    count, numbers = len(study.parameters), study.numbers
    problem = Problem(n_var=count, n_obj=len(study.objectives), n_ieq_constr=1, xl=np.zeros(count), xu=np.ones(count))

    class Snap(Repair):
        """Equal designs at equal positions, so that the optimiser sees what it has tried."""

        def _do(self, problem: Any, X: Array, **_: Any) -> Array:
            return snap(study, X)

    def rate(population: Any, found: Evaluations) -> Any:
        values = minimised_objectives(study, found)
        known = StaticProblem(problem, F=np.where(np.isnan(values), WORST, values), G=violations(study, found)[:, None])
        return Evaluator().eval(known, population)

    def start(found: Evaluations) -> tuple[Any, Callable[[Any, Evaluations], Any]]:
        everyone = rate(Population.new("X", found.positions), found)
        first, later = (int(x) for x in np.random.SeedSequence(numbers.seed, spawn_key=(1,)).generate_state(2))
        # Every call of pymoo that is not given a seed takes one from the system.
        best = RankAndCrowding().do(
            problem,
            everyone,
            n_survive=min(numbers.population, len(everyone)),
            random_state=np.random.default_rng(first),
        )
        optimiser: Any = NSGA2(pop_size=numbers.population, repair=Snap(), sampling=best)
        optimiser.setup(problem, termination=("n_gen", numbers.generations + 2), seed=later)
        optimiser.tell(infills=optimiser.ask())
        return optimiser, rate

    return start
