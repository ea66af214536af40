"""Which designs are evaluated, and which of them are best.

* `search`: the Sobol sample and the generations of NSGA-II; `run`: the evaluations over an executor, in kept chunks.
* `pareto`: violations of limits, the front of non-dominated designs, the chosen member.
"""
