"""Fits: which sets of effects explain a record, and how well.

* `problem`: the record and all that is known of it before any effect is named; `weighting`: its covariance.
* `score_test`, `least_squares`, `search`: from first-order gains to fitted sets; `worker_pool` shares them among
  processes.
* `held_out`, `overdispersion`, `remainder`, `intervals`: what a fit leaves, and how sure its sizes are.
"""
