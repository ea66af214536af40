"""The drive as a Functional Mock-up Unit (FMI 2.0 and 3.0).

    model -> xml, codegen or python_backend -> export -> importer -> validation

* `model`: what an FMU computes and declares; `xml`: its descriptions and its file.
* `codegen` and `native`: generated C and the wrapper around it; `python_backend`: what runs behind pythonfmu.
* `export`, `export_fmi3`: a drive model becomes an FMU.
* `importer`: drives an FMU from Python; `validation`: holds it against the standard and the model.

Nothing is imported here: fmpy, pythonfmu and casadi are loaded by the part that needs them.
"""
