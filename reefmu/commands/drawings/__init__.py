"""Commands that take or make a drawing: `curve`, `compare`, `draw`, `new`.

* `population_run`: the virtual drives that a call asks for; `load_ratings`: pressures, losses and lives.
* `turning_individual`, `turning_files`: one virtual drive while it turns, for `curve --individual`.
"""
