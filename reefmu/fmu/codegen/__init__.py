"""The C sources and binaries of a native FMU.

* `functions`: the component's functions for which CasADi generates C; `stage_order`: the order of the drive's stages.
* `sources`: all C files, the generated ones and the handwritten ones of `native`; `compile`: binaries for a platform.
"""
