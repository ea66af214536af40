"""The drive as a Functional Mock-up Unit (FMI 2.0, co-simulation).

* `interface.py` declares every variable once; `description.py` writes the declaration as XML, with `units.py`.
* `build.py` exports; `archive.py` knows the file.
* `slave.py` is what runs inside the FMU: the model's functions in `kernel.py`, behind pythonfmu, whose faults
  are met in `workarounds.py`.
* `host.py` drives an FMU from Python, with `calls.py`.
* `check.py` holds an FMU against the Python model, over the signal in `trial.py`.

Nothing is imported here: fmpy, pythonfmu and casadi are loaded by the part that needs them.
"""
