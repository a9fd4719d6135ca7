"""Graphs in layers, for the picture of the architecture: pure functions, the same everywhere.

An arrow goes from who imports to what is imported. The layer of a node is its longest way down.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

Graph = Mapping[str, frozenset[str]]
_SWEEPS = 6


@dataclass(frozen=True, slots=True)
class Layered:
    """A graph with an order in its layers.

    Attributes
    ----------
    layers
        From what imports nothing to what nobody imports. A name that ``graph`` does not have is
        the place where an arrow passes a layer.
    paths
        Every arrow from the importer to the imported, with the places that it passes.
    """

    layers: tuple[tuple[str, ...], ...]
    paths: tuple[tuple[str, ...], ...]


def reduced(graph: Graph) -> Graph:
    """Return the graph without arrows that follow from others (Aho, Garey and Ullman 1972)."""
    below = {name: _below(graph, name) for name in graph}
    return {
        name: frozenset(
            one for one in needs if not any(one in below[other] for other in needs - {one})
        )
        for name, needs in graph.items()
    }


def _below(graph: Graph, name: str) -> frozenset[str]:
    seen: set[str] = set()
    work = [name]
    while work:
        for one in graph[work.pop()] - seen:
            seen.add(one)
            work.append(one)
    return frozenset(seen)


def levels(graph: Graph) -> dict[str, int]:
    """Return the longest way down from each node; the graph has no circle."""
    found: dict[str, int] = {}

    def level(name: str) -> int:
        if name not in found:
            found[name] = 1 + max((level(one) for one in graph[name]), default=-1)
        return found[name]

    for name in sorted(graph):
        level(name)
    return found


def layered(graph: Graph) -> Layered:
    """Put the nodes into layers, and order each so that few arrows cross (Sugiyama 1981)."""
    of = levels(graph)
    layers: list[list[str]] = [[] for _ in range(1 + max(of.values(), default=-1))]
    for name in sorted(graph):
        layers[of[name]].append(name)
    paths = []
    for name in sorted(graph):
        for one in sorted(graph[name]):
            passed = []
            for level in range(of[name] - 1, of[one], -1):
                place = f"{name} > {one} @ {level}"
                layers[level].append(place)
                passed.append(place)
            paths.append((name, *passed, one))
    beside = _neighbours(paths)
    for sweep in range(_SWEEPS):
        upwards = sweep % 2 == 0
        order = range(1, len(layers)) if upwards else range(len(layers) - 2, -1, -1)
        for level in order:
            fixed = layers[level - 1 if upwards else level + 1]
            layers[level] = _ordered(layers[level], fixed, beside)
    return Layered(tuple(tuple(one) for one in layers), tuple(paths))


def _neighbours(paths: list[tuple[str, ...]]) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for path in paths:
        for one, other in pairwise(path):
            found.setdefault(one, set()).add(other)
            found.setdefault(other, set()).add(one)
    return found


def _ordered(layer: list[str], fixed: list[str], beside: Mapping[str, set[str]]) -> list[str]:
    """Order a layer by the mean place of each node's neighbours in the fixed layer."""

    def place(name: str) -> float:
        near = [i for i, one in enumerate(fixed) if one in beside.get(name, ())]
        # Relative places, because the layers are of different lengths and are centred.
        own = (layer.index(name) + 0.5) / len(layer)
        return sum((i + 0.5) / len(fixed) for i in near) / len(near) if near else own

    places = {name: place(name) for name in layer}
    return sorted(layer, key=lambda name: (places[name], layer.index(name)))
