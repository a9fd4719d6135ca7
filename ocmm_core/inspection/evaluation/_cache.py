"""Cache of a job's results, each with all its inputs.

Features depend on points, frames on features, values on both. A node's latest result is valid while
its inputs are the identical frozen objects: points, features, plans, options. So one more point
recomputes only its dependents. The direction of an axis may depend on any feature: a node may also
read from a mapping, and the entries read are among its inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import is_
from typing import Generic, TypeVar, cast

T = TypeVar("T")
V = TypeVar("V")


class EvaluationCache:
    """Keep one result per node, as many as features and characteristics; thread-safe.

    Concurrent callers with different points each get their correct result; one is kept.
    """

    def __init__(self) -> None:
        self._nodes: dict[Hashable, _Node] = {}

    def known(self, key: Hashable, inputs: Sequence[object], make: Callable[[], T]) -> T:
        """Return a node's result, by ``make`` if not cached for these inputs; errors are not."""
        node = self._nodes.get(key)
        if node is None or not node.has(inputs):
            node = self._nodes[key] = _Node(tuple(inputs), make(), {}, None)
        return cast("T", node.value)

    def watched(
        self,
        key: Hashable,
        inputs: Sequence[object],
        source: Mapping[str, V],
        make: Callable[[Mapping[str, V]], T],
    ) -> T:
        """Return the result of a node that also depends on what ``make`` reads of ``source``."""
        node = self._nodes.get(key)
        if node is None or not node.has(inputs) or not node.would_read(source):
            watch = _Watch(source)
            value = make(watch)
            node = self._nodes[key] = _Node(tuple(inputs), value, watch.read, watch.names)
        return cast("T", node.value)


@dataclass(frozen=True, slots=True)
class _Node:
    """A result and its inputs, the entries read by name, and all names if they were listed."""

    inputs: tuple[object, ...]
    value: object
    read: Mapping[str, object]
    names: tuple[str, ...] | None

    def has(self, inputs: Sequence[object]) -> bool:
        return len(inputs) == len(self.inputs) and all(map(is_, inputs, self.inputs))

    def would_read(self, source: Mapping[str, V]) -> bool:
        """Return whether reading from ``source`` gives the identical objects."""
        if self.names is not None and self.names != tuple(source):
            return False
        return all(source.get(name, _NOTHING) is value for name, value in self.read.items())


class _Watch(Mapping[str, V], Generic[V]):
    """A mapping that records reads; nested watches both record them."""

    def __init__(self, source: Mapping[str, V]) -> None:
        self._source = source
        self.read: dict[str, object] = {}
        self.names: tuple[str, ...] | None = None

    def __getitem__(self, name: str) -> V:
        try:
            value = self._source[name]
        except KeyError:
            self.read[name] = _NOTHING
            raise
        self.read[name] = value
        return value

    def __iter__(self) -> Iterator[str]:
        self.names = tuple(self._source)
        return iter(self.names)

    def __len__(self) -> int:
        return sum(1 for _ in self)


_NOTHING = object()
"""Marks a missing key of a mapping."""
