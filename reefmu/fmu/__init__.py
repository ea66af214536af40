"""The drive as a Functional Mock-up Unit (FMI 2.0 and 3.0).

    model -> xml, codegen or python_backend -> export -> importer -> validation

* `model`: the functions of an FMU and the declaration of its variables; `xml`: its descriptions and the archive.
* `codegen` and `native`: the generated C and the handwritten C around it; `python_backend`: what runs in pythonfmu.
* `export`, with `metadata`, `documentation`, `related_files` and `export_fmi3`: from a drive model to an FMU.
* `ssp`: from a drive model to a system of FMUs.
* `importer`: runs an FMU from Python; `validation`: compares it with the standard and with the Python model.

Nothing is imported here, because fmpy, pythonfmu and casadi are needed by single rooms only.
"""
