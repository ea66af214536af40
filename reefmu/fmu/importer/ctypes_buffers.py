"""Arrays and callbacks in the form in which the C functions of an FMU take them."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

from stiffness_model.errors import unknown_name

_MAX_MESSAGES = 20
"""Number of messages that are kept; a failure is explained by the last ones."""
_PYTHONFMU_FATAL = "Fatal py exception"
"""Start of the message that pythonfmu adds after an exception; it says nothing about the cause."""


class VariableBlock:
    """Named Real variables as the arrays that fmi2GetReal and fmi2SetReal take, allocated once."""

    def __init__(self, references: Mapping[str, int], names: tuple[str, ...]) -> None:
        """references: value references by name. Errors: `UnknownNameError` for a name without one."""
        for name in names:
            if name not in references:
                raise unknown_name("variable", name, references)
        self.names = names
        self.position = {name: index for index, name in enumerate(names)}
        self.references = (ctypes.c_uint * len(names))(*(references[name] for name in names))
        self.values = (ctypes.c_double * len(names))()

    def write(self, name: str, value: float) -> None:
        """Set one value in the array."""
        self.values[self.position[name]] = value


def keep_message(messages: list[str], message: bytes | None) -> None:
    """Append a message of the FMU to the latest ones."""
    messages.append((message or b"").decode("utf-8", "replace"))
    del messages[:-_MAX_MESSAGES]


def take_messages(messages: list[str]) -> str:
    """The messages without repetitions, to be appended to an error of one line; `messages` is emptied.

    >>> take_messages(["no torque", "step discarded: no torque"])
    ': step discarded: no torque'
    """
    distinct = list(dict.fromkeys(one_line(message) for message in messages))
    messages.clear()
    kept = [message for message in distinct if not message.startswith(_PYTHONFMU_FATAL)] or distinct
    kept = [message for message in kept if not any(message in other for other in kept if other != message)]
    return f": {'; '.join(kept)}" if kept else ""


def one_line(error: object) -> str:
    """The text of an error or message, on one line."""
    return " ".join(str(error).split())


def make_callbacks(messages: list[str]) -> Any:
    """FMI 2.0 callbacks whose logger keeps the latest messages with a status worse than fmi2Warning.

    fmpy's logger proxy, which expands format specifiers such as "%s", is not used: there is one logger per process, so
    a second instance would receive the messages of the first, and the process would crash once it is freed.
    """
    import fmpy
    from fmpy import fmi2

    def log(_environment: Any, _name: Any, status: int, _category: Any, message: bytes | None) -> None:
        if status > fmi2.fmi2Warning:
            keep_message(messages, message)

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    return callbacks
