"""The rolling element eccentric drive as a component: models, FMUs, joints, diagnosis, command line.

    stiffness_model -> model (with effects) -> simulate | fmu | joint | diagnosis -> commands, cli

* `effects`: what the contact model leaves out, one file each; `model`: lookup and effects as CasADi functions.
* `record`, `speed`: measured data; `simulate`: a model over a record or a signal.
* `fmu`: export, import and validation; `joint`: motor, drive and load under control.
* `diagnosis`: where a measured record and the model disagree, and why.
* `commands`, `cli`: the command line; `progress`, `interrupt`, `source_date`: what its commands share.
"""

__version__: str


def __getattr__(name: str) -> str:
    # Looked up when asked for: reading the package's metadata would slow down the command line's start.
    if name == "__version__":
        from importlib.metadata import version

        return version("reefmu")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
