"""Design studies: parameters with ranges, limits and objectives, to a Pareto front and a chosen drawing.

* `definition`: what a study varies, limits and optimises, read from its TOML file; from parameter values to a drive.
* `evaluation`: the metrics of one design from its virtual drives at the study's torque.
* `optimisation`: Sobol sample and NSGA-II, run over an executor in chunks that are kept; feasibility and Pareto front.
* `report`: the designs as a table, main effects, figures and the chosen drawing.
"""
