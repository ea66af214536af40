"""Faults of pythonfmu 0.7, and the remedies that keep them from the host."""

from __future__ import annotations

import ctypes
import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar, cast
from urllib.parse import unquote

from stiffness_model.errors import InputError

_P = ParamSpec("_P")
_R = TypeVar("_R")
_Slave = TypeVar("_Slave")


def resource_folder(location: str) -> Path:
    """The folder that a host names: a path, or a file URI with escapes, a drive letter or localhost.

    >>> resource_folder("file:///tmp/a%20b/%C3%BC").as_posix()
    '/tmp/a b/ü'
    >>> resource_folder("file:///C:/fmu%23one").as_posix()
    'C:/fmu#one'
    >>> resource_folder("file://localhost/tmp/x").as_posix()
    '/tmp/x'
    """
    text = location
    if text[:5].lower() == "file:":
        text = text[5:]
        if text.startswith("//"):
            host, slash, rest = text[2:].partition("/")
            text = slash + rest if host.lower() in ("", "localhost") else f"//{host}{slash}{rest}"
        text = unquote(text)
    elif "%" in text and not os.path.isdir(text):
        text = unquote(text)  # pythonfmu removes "file://", but decodes only "%20"
    if len(text) > 2 and text[0] == "/" and text[1].isalpha() and text[2] == ":":
        text = text[1:]
    return Path(text)


def leak_reference(item: object) -> None:
    """Add a reference to `item` that is never released, so that it lives as long as the process.

    For each instantiation pythonfmu 0.7 runs the script once and then releases the script's namespace, of which it owns
    no reference. Without an additional reference the second instance of an FMU would use a freed namespace.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(item))


def guarded(method: Callable[Concatenate[_Slave, _P], _R]) -> Callable[Concatenate[_Slave, _P], _R]:
    """Decorate a method so that an exception in it does not end the host's process.

    After an exception pythonfmu 0.7 releases the instance, its log and its class, and releases them again when the
    instance is freed. One more reference to each makes the second release harmless.
    """

    @functools.wraps(method)
    def wrapper(self: _Slave, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        try:
            return method(self, *args, **kwargs)
        except Exception as error:
            slave = cast(Any, self)
            kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
            slave.log_problem(f"{kind}{error}")
            for item in (slave, slave.log_queue, type(slave)):
                leak_reference(item)
            raise

    return wrapper
