"""The version of the installed distribution, which contains `stiffness_model` and `reefmu`."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("reefmu")
except PackageNotFoundError:
    # The packages are imported from a folder on the path.
    __version__ = "unknown"
