"""The external dependencies of an FMU of the Python back end, in the files that FMI 2.0.4, section 2.3, names."""

from __future__ import annotations

from html import escape

_TEXT = """This FMU is not self-contained: it runs in the Python interpreter of its host.

Required in the host's process:
  Python 3.11 or newer. A host written in Python provides it. A host in another language must load libpython before the
  FMU's library, which does not name it: on Linux by linking it, or by LD_PRELOAD=libpython3.X.so; on Windows
  python3.dll must be on the search path.
Required in that Python (pip install . in a clone of reefmu installs all of them):
  reefmu {version}, with the same equations as at export: a package with other equations is refused
  CasADi {casadi} or newer, NumPy, pythonfmu {pythonfmu}

`reefmu export --backend native` makes an FMU of the same model that requires none of this.
"""


def external_dependencies(version: str, casadi: str, pythonfmu: str) -> dict[str, bytes]:
    """The members of the archive, as text and as HTML; the versions are those at export.

    >>> sorted(external_dependencies("1.0", "3.8.2", "0.7.0"))
    ['documentation/externalDependencies.html', 'documentation/externalDependencies.txt']
    """
    text = _TEXT.format(version=version, casadi=casadi, pythonfmu=pythonfmu)
    page = (
        '<!DOCTYPE html>\n<html lang="en"><meta charset="utf-8"><title>External dependencies</title>\n'
        f"<pre>\n{escape(text)}</pre>\n</html>\n"
    )
    return {
        "documentation/externalDependencies.txt": text.encode(),
        "documentation/externalDependencies.html": page.encode(),
    }
