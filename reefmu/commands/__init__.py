"""The commands of the command line: one module each, with `run(args) -> int`, which returns the exit status.

The rooms are named after what their commands take:

* `drawings`: new, curve, compare, draw; `fmus`: export, check; `records`: record, diagnose; `plans`: plan;
  `studies`: explore; `reference`: effects, materials, gears, which list what comes with the package.
* `demo`: all steps for one drive; `terminal`: reading drawings, notes, tables and worker processes, for all of them.
"""
