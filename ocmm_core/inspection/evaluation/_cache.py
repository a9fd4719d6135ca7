"""Cache of a job's results, each with all its inputs.

Features depend on points, frames on features, values on both. A node's latest result is valid while
its inputs are the identical frozen objects: points, features, plans, options. So one more point
recomputes only its dependents. The direction of an axis may depend on any feature: a node may also
read from a mapping, and the entries read are among its inputs.

Nodes of one kind form a table by name: comparing two mappings takes 50 ns an entry, asking each
node 1.5 us, which thousands of features would pay for every point. Tables share unchanged rows and,
if no row changed, are the same object, so that readers notice at once what changed.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import partial
from itertools import compress, count
from operator import is_, is_not
from types import MappingProxyType
from typing import Any, Generic, TypeVar, cast

from ocmm_core.measuring import MeasuredPoint

T = TypeVar("T")
V = TypeVar("V")


class EvaluationCache:
    """Keep one result per node, as many as features and characteristics; thread-safe.

    Concurrent callers with different points each get their correct result; one is kept.
    """

    def __init__(self) -> None:
        self._nodes: dict[Hashable, _Node] = {}
        self._tables: dict[str, _Table] = {}

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
        return cast("T", self._watched(key, inputs, source, make).value)

    def grown(self, key: Hashable, make: Callable[[T | None], T]) -> T:
        """Return the new result of a node, made of its previous one; None at first."""
        node = self._nodes.get(key)
        value = make(None if node is None else cast("T", node.value))
        self._nodes[key] = _Node((), value, {}, None)
        return value

    def appended(
        self,
        key: Hashable,
        inputs: Sequence[object],
        own: Sequence[Sequence[object]],
        make: Callable[[int], T],
        join: Callable[[T, T], T],
    ) -> T:
        """Return a node's result over parallel sequences ``own``.

        If they only grew, it is the previous one, joined with that from an index on by ``make``.
        """
        node, length = self._nodes.get(key), len(own[0])
        known = 0 if node is None or not node.has(inputs) else len(node.own[0])
        if node is None or not 0 < known < length or not all(map(_starts_with, own, node.own)):
            value = make(0)
        else:
            value = join(cast("T", node.value), make(known))
        self._nodes[key] = _Node(tuple(inputs), value, {}, None, tuple(own))
        return value

    def table(
        self,
        key: str,
        inputs: Sequence[object],
        own: Sequence[Mapping[str, object]],
        make: Callable[[str], T],
        *,
        names: Sequence[str] | None = None,
        reads: Mapping[str, Set[str]] = MappingProxyType({}),
        below: Sequence[Mapping[str, object]] = (),
    ) -> Mapping[str, T]:
        """Return the results of many nodes by name; made are those whose sources have changed.

        A node depends on ``inputs``, on its entries in ``own``, and on those of the names that it
        ``reads`` in ``below``. `names`: of the nodes, in order; None for those of the first of
        ``own``.
        """
        inputs, sources = (names, reads, *inputs), (*own, *below)
        before = self._tables.get(key)
        if before is None or not before.has(inputs, len(sources)):
            rows = {name: make(name) for name in (own[0] if names is None else names)}
        else:
            rows = before.rows
            count = len(own)
            changed = changed_names(before.sources[:count], own)
            moved = changed_names(before.sources[count:], below)
            if moved:
                changed |= {name for name, read in reads.items() if not read.isdisjoint(moved)}
            rows = _updated(rows, changed, make, own[0] if names is None else rows)
        self._tables[key] = _Table(inputs, sources, rows)
        return rows

    def watched_table(
        self,
        key: str,
        inputs: Sequence[object],
        source: Mapping[str, V],
        make: Callable[[str, Mapping[str, V]], T],
        names: Sequence[str],
    ) -> Mapping[str, T]:
        """Return the results of nodes that depend on what ``make`` reads of ``source``, by name."""
        inputs = (names, *inputs)
        before = self._tables.get(key)
        if before is None or not before.has(inputs, 1):
            nodes: dict[str, _Node] = {}
            changed: Set[str] = frozenset(names)
        else:
            nodes = dict(before.nodes)
            moved = changed_names(before.sources, (source,))
            same = tuple(before.sources[0]) == tuple(source) if moved else True
            changed = {
                name
                for name, node in nodes.items()
                if not node.read.keys().isdisjoint(moved) or (node.names is not None and not same)
            }
        for name in names if changed else ():
            if name in changed:
                nodes[name] = self._watched((key, name), inputs, source, partial(make, name))
        rows = {name: cast("T", node.value) for name, node in nodes.items()}
        if before is not None and not changed_names((before.rows,), (rows,)):
            rows = before.rows
        self._tables[key] = _Table(inputs, (source,), rows, nodes)
        return rows

    def _watched(
        self,
        key: Hashable,
        inputs: Sequence[object],
        source: Mapping[str, V],
        make: Callable[[Mapping[str, V]], object],
    ) -> _Node:
        node = self._nodes.get(key)
        if node is None or not node.has(inputs) or not node.would_read(source):
            watch = _Watch(source)
            value = make(watch)
            node = self._nodes[key] = _Node(tuple(inputs), value, watch.read, watch.names)
        return node


def changed_names(
    before: Sequence[Mapping[str, object]], after: Sequence[Mapping[str, object]]
) -> set[str]:
    """Return the names whose entries differ; objects by identity, texts by value."""
    changed: set[str] = set()
    for old, new in zip(before, after, strict=True):
        if old is not new:
            changed.update(
                name
                for name, value in new.items()
                if (other := old.get(name, _NOTHING)) is not value and not _is_equal(other, value)
            )
            changed |= old.keys() - new.keys()
    return changed


def _is_equal(one: object, other: object) -> bool:
    return one is other or (isinstance(one, str) and one == other)


def _updated(
    rows: dict[str, T], changed: Set[str], make: Callable[[str], T], names: Mapping[str, object]
) -> dict[str, T]:
    """Return the rows of ``names``; the same object if none has changed."""
    fresh = {name: make(name) for name in names if name in changed} if changed else {}
    gone = rows.keys() - names.keys() if rows is not names else ()
    if not gone and all(rows.get(name, _NOTHING) is value for name, value in fresh.items()):
        return rows
    merged = rows | fresh
    return {name: row for name, row in merged.items() if name not in gone} if gone else merged


@dataclass(frozen=True, slots=True)
class _Table:
    """Results by name, with their inputs and sources; nodes if they watch."""

    inputs: tuple[object, ...]
    sources: tuple[Mapping[str, object], ...]
    rows: dict[str, Any]
    nodes: Mapping[str, _Node] = field(default_factory=dict)

    def has(self, inputs: Sequence[object], n_sources: int) -> bool:
        return (
            len(inputs) == len(self.inputs)
            and len(self.sources) == n_sources
            and all(map(_is_equal, inputs, self.inputs))
        )


@dataclass(frozen=True, slots=True)
class Grouped(Generic[T]):
    """Values of points by feature, tuples that stay the same objects while their feature does."""

    points: Sequence[MeasuredPoint]
    values: Sequence[T]
    """`points`, `values`: of the job, in order."""
    by_feature: Mapping[str, tuple[T, ...]]
    owners: Mapping[int, str]
    """Feature of each point, by its number."""

    @classmethod
    def from_points(
        cls, points: Sequence[MeasuredPoint], values: Sequence[T], before: Grouped[T] | None
    ) -> Grouped[T]:
        """Return the values by feature; only those behind the first change are grouped anew."""
        old = cls((), (), {}, {}) if before is None else before
        first = _first_change(old.points, points)
        if values is not points:
            first = min(first, _first_change(old.values, values))
        gone: Counter[str] = Counter(point.feature for point in old.points[first:])
        new: defaultdict[str, list[T]] = defaultdict(list)
        owners = dict(old.owners)
        for point in old.points[first:]:
            owners.pop(point.number, None)
        for point, value in zip(points[first:], values[first:], strict=True):
            new[point.feature].append(value)
            owners[point.number] = point.feature
        if len(owners) < len(points):
            raise ValueError("two points have the same number")
        found = dict(old.by_feature)
        for name in gone.keys() | new.keys():
            known = found.get(name, ())
            own = (*known[: len(known) - gone[name]], *new[name])
            if not own:
                del found[name]
            elif len(own) != len(known) or not all(map(is_, own, known)):
                found[name] = own
        return cls(points, values, found, owners)


def _starts_with(new: Sequence[object], old: Sequence[object]) -> bool:
    return len(old) <= len(new) and all(map(is_, old, new))


def _first_change(old: Sequence[object], new: Sequence[object]) -> int:
    """Return the first index at which two sequences differ, or the length of the shorter one."""
    if _starts_with(new, old):
        return len(old)
    return next(compress(count(), map(is_not, old, new)), len(new))


@dataclass(frozen=True, slots=True)
class _Node:
    """A result and its inputs, the entries read by name, and all names if they were listed.

    `own`: sequences that it grew with, see `EvaluationCache.appended`.
    """

    inputs: tuple[object, ...]
    value: object
    read: Mapping[str, object]
    names: tuple[str, ...] | None
    own: tuple[Sequence[object], ...] = ()

    def has(self, inputs: Sequence[object]) -> bool:
        return len(inputs) == len(self.inputs) and all(map(_is_equal, inputs, self.inputs))

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
