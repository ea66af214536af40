"""The rolling element eccentric drive as a component: models, FMUs, joints, diagnosis and the command line."""

__version__: str


def __getattr__(name: str) -> str:
    # Looked up when asked for: reading the package's metadata would slow down every start of the command line.
    if name == "__version__":
        from importlib.metadata import version

        return version("reefmu")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
