"""What an FMU of the Python back end needs, told as FMI 2.0.4, section 2.3, wants it: externalDependencies."""

from __future__ import annotations

from html import escape

_TEXT = """This FMU does not stand alone: it runs in the Python of its host.

Needed in the host's process:
  Python 3.11 or newer. A host in Python is one. A host in another language must have libpython loaded before it loads
  the FMU's library, which does not name it: on Linux by linking it, or by LD_PRELOAD=libpython3.X.so; on Windows
  python3.dll must be found.
Needed in that Python (pip install reefmu brings all of them):
  reefmu {version}, with the same equations as at export: another code is refused
  CasADi {casadi} or newer, NumPy, pythonfmu {pythonfmu}

`reefmu export --backend native` makes an FMU of the same model that needs none of this.
"""


def external_dependencies(version: str, casadi: str, pythonfmu: str) -> dict[str, bytes]:
    """The members of the archive, as text and as a page; the versions are those of the export.

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
