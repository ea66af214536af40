"""A mapping that does not change and can be hashed, so that a frozen dataclass that holds one is a value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class FrozenMapping(Mapping[K, V], Generic[K, V]):
    """A copy of `items`, in their order. It equals any mapping of equal items, and is hashable if all values are.

    >>> limits = FrozenMapping({"low": 0.0, "high": 1.0})
    >>> limits == {"high": 1.0, "low": 0.0}, hash(limits) == hash(FrozenMapping({"high": 1.0, "low": 0.0}))
    (True, True)
    """

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[K, V]) -> None:
        self._items = dict(items)

    def __getitem__(self, key: K) -> V:
        return self._items[key]

    def __iter__(self) -> Iterator[K]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


def freeze(value: Any) -> Any:
    """`value` with every mapping in it as a `FrozenMapping` and every list as a tuple, at any depth.

    >>> freeze({"choices": [1, 2]})
    {'choices': (1, 2)}
    """
    if isinstance(value, Mapping):
        return FrozenMapping({key: freeze(item) for key, item in value.items()})
    if isinstance(value, list):
        return tuple(freeze(item) for item in value)
    return value
