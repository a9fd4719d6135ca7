"""What was computed of a job, each result with all that it was computed from.

Results form a graph: features rest on points, frames on features, values on both. A node keeps its
latest result and its inputs, the very objects; it is good as long as these are the same objects,
which nobody changes: points, features, plans and options are frozen. So no number can outlive what
it rests on, and one more point computes anew what hangs on it and nothing else.

What a value asks of the features is not known beforehand: which way an axis runs may rest on any of
them. So a node may also read from a mapping, and what it has read is among its inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import is_
from typing import Generic, TypeVar, cast

T = TypeVar("T")
V = TypeVar("V")


class EvaluationCache:
    """Keep one result for every node; as many nodes as a plan has features and characteristics.

    Several threads may ask at once: what two of them compute from other points, both are given
    rightly, and one of the two is kept.
    """

    def __init__(self) -> None:
        self._nodes: dict[Hashable, _Node] = {}

    def known(self, key: Hashable, inputs: Sequence[object], make: Callable[[], T]) -> T:
        """Return the result of a node.

        Parameters
        ----------
        key
            Which one.
        inputs
            All that ``make`` computes from.
        make
            Computes it, where it is not known for these inputs; errors are not kept.
        """
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
        """Return the result of a node that also rests on what ``make`` reads of ``source``."""
        node = self._nodes.get(key)
        if node is None or not node.has(inputs) or not node.would_read(source):
            watch = _Watch(source)
            value = make(watch)
            node = self._nodes[key] = _Node(tuple(inputs), value, watch.read, watch.names)
        return cast("T", node.value)


@dataclass(frozen=True, slots=True)
class _Node:
    """A result and its inputs, what was read by name, and all names where they were asked for."""

    inputs: tuple[object, ...]
    value: object
    read: Mapping[str, object]
    names: tuple[str, ...] | None

    def has(self, inputs: Sequence[object]) -> bool:
        """Return whether the inputs are these very objects."""
        return len(inputs) == len(self.inputs) and all(map(is_, inputs, self.inputs))

    def would_read(self, source: Mapping[str, V]) -> bool:
        """Return whether reading from ``source`` finds the very objects that were found."""
        if self.names is not None and self.names != tuple(source):
            return False
        return all(source.get(name, _NOTHING) is value for name, value in self.read.items())


class _Watch(Mapping[str, V], Generic[V]):
    """A mapping that notes what is read from it; one of another one is noted in both."""

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
"""Stands for what a mapping does not have."""
