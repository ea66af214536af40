"""The rolling element eccentric drive as a component: models, FMUs, joints, diagnosis, command line."""

__version__: str


def __getattr__(name: str) -> str:
    # Looked up when asked for: reading the package's metadata would slow down the command line's start.
    if name == "__version__":
        from importlib.metadata import version

        return version("reefmu")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
