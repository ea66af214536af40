"""Errors and warnings about the input, checks that raise them, and what their messages suggest."""

from __future__ import annotations

import difflib
import math
import numbers
import warnings
from collections.abc import Iterable


class InputError(ValueError):
    """The input is unusable; the message states what was expected, what was given, and where."""


class UnknownNameError(InputError):
    """An unknown name of a field, preset, effect, unit or the like."""


class DoesNotFitWarning(UserWarning):
    """The drawing can be computed but not built, since the bores of its elements overlap."""


class NotConvergedWarning(UserWarning):
    """Some elements found no equilibrium; their forces count as zero, and results state their number."""


def warn_not_converged(count: int, total: int, where: str, stacklevel: int = 3) -> None:
    """Issue one `NotConvergedWarning` if `count` of `total` cases found no equilibrium.

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_not_converged(3, 200, "drive_1")
    >>> print(caught[0].message)
    drive_1: 3 of 200 cases (an element at a twist) found no equilibrium and count as no force; the torque is too low; \
reduce twists, interferences or compliances
    """
    if count:
        warnings.warn(
            f"{where}: {count} of {total} cases (an element at a twist) found no equilibrium and count as no "
            "force; the torque is too low; reduce twists, interferences or compliances",
            NotConvergedWarning,
            stacklevel=stacklevel,
        )


def unknown_name(kind: str, name: object, known: Iterable[str], where: str = "") -> UnknownNameError:
    """An error for an unknown name, with the closest known ones, whatever their capitals.

    >>> str(unknown_name("field", "lobe", ["lobes", "crank_radius"], "drive.toml"))
    "drive.toml: unknown field 'lobe'; did you mean 'lobes'?"
    >>> str(unknown_name("drive", "rv42", ["RV-42N", "drive_1"]))
    "unknown drive 'rv42'; did you mean 'RV-42N'?"
    """
    names = sorted(known)
    spelt: dict[str, list[str]] = {}
    for one in names:
        spelt.setdefault(one.lower(), []).append(one)
    close = [one for low in difflib.get_close_matches(str(name).lower(), spelt, n=3) for one in spelt[low]]
    prefix = f"{where}: " if where else ""
    if close:
        hint = "did you mean " + " or ".join(repr(c) for c in close) + "?"
    else:
        hint = "expected one of " + ", ".join(names)
    return UnknownNameError(f"{prefix}unknown {kind} {name!r}; {hint}")


def install_command(extra: str) -> str:
    """How to install one of the extras of pyproject.toml, for messages about a missing package.

    The package is on no index, so that the command is one for the folder of its sources.

    >>> install_command("dxf")
    "pip install '.[dxf]' in a clone of reefmu"
    """
    return f"pip install '.[{extra}]' in a clone of reefmu"


def refuse_unknown(kind: str, given: Iterable[str], known: Iterable[str], where: str = "") -> None:
    """Raise `UnknownNameError` for the first of `given` that is not among `known`."""
    names = list(known)
    for name in given:
        if name not in names:
            raise unknown_name(kind, name, names, where)


def expect(condition: bool, expected: str, given: object, where: str) -> None:
    """Raise `InputError` with what was expected and what was given, unless `condition` holds.

    >>> expect(False, "a positive length", -1.0, "crank_radius")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: crank_radius: expected a positive length, got -1.0
    """
    if not condition:
        raise InputError(f"{where}: expected {expected}, got {given!r}")


def expect_number(value: object, expected: str, where: str, *, low: float = -math.inf, high: float = math.inf) -> float:
    """The value as a finite float strictly between `low` and `high`. Raises `InputError` for others.

    >>> expect_number(3, "a positive number", "lobes", low=0)
    3.0
    """
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    expect(is_number and math.isfinite(value) and low < value < high, expected, value, where)  # type: ignore[operator,arg-type]
    return float(value)  # type: ignore[arg-type]


def expect_integer(value: object, expected: str, where: str, *, low: int = 1) -> int:
    """The value as an int of at least `low`; NumPy's integers are accepted, booleans are not. Raises `InputError`.

    >>> expect_integer(30, "a whole number of at least 1", "lobes")
    30
    """
    whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    expect(whole and int(value) >= low, expected, value, where)  # type: ignore[call-overload]
    return int(value)  # type: ignore[call-overload]
