"""Estimation: which sets of effects explain a record, how well, and with which parameters.

* `problem`: the record and what is known before any effect is named; `weighting`: the covariance of its residuals.
* `least_squares`, `score_test`, `search`: fits, first-order gains, and the search for sets; `worker_pool` shares them
  among processes.
* `residuals`, `held_out`, `intervals`: what a fit leaves, cross-validation, and confidence intervals.
"""
