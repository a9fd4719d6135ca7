"""Packages of the product, read from its imports, for docs/developer/architecture.md."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.house_files import read_product
from benchmarks.house_measures import room_graph
from benchmarks.house_tree import ROOTS, House, is_single, parent
from docs.images.architecture_layers import Graph, levels, reduced

BEGIN = "<!-- rooms: made by docs/images/make_architecture.py -->\n"
END = "<!-- end of rooms -->\n"


@dataclass(frozen=True, slots=True)
class Rooms:
    """What is drawn and listed.

    Attributes
    ----------
    houses
        Which house needs which: the packages of the core, and the window as a whole.
    inside
        For each house its rooms that hold files, without arrows that follow from others.
    summaries
        The first line of the face of every package.
    common
        Rooms of one file in the core; everybody may use them, so they have no arrows.
    """

    houses: Graph
    inside: Mapping[str, Graph]
    summaries: Mapping[str, str]
    common: tuple[str, ...]


def read_rooms(root: Path) -> Rooms:
    """Read the rooms of the repository at ``root``; nothing of the product is imported."""
    product = read_product(root)
    graph = room_graph(product)
    houses = _houses(product, graph)
    faces = [one for one in product.product.values() if one.is_package]
    return Rooms(
        houses,
        {name: _inside(product, graph, name) for name in houses},
        {one.module: _first_line(one.tree) for one in faces},
        tuple(sorted(name for name in product.product if _is_common(product, name))),
    )


def with_table(page: str, rooms: Rooms) -> str:
    """Return the page with the table of the rooms between its marks made again."""
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    order = levels(rooms.houses)
    listed = [room for room in rooms.summaries if room not in ROOTS]
    listed.sort(key=lambda room: (order[house_of(room)], house_of(room), room))
    rows = [f"| `{room}` | {rooms.summaries[room]} |" for room in listed]
    table = "\n".join(["| room | what it holds |", "|---|---|", *rows, ""])
    return f"{before}{BEGIN}{table}{END}{after}"


def house_of(room: str) -> str:
    """Return the house of a room: the package below ocmm_core, or the window as a whole."""
    parts = room.split(".")
    return ".".join(parts[:2]) if parts[0] == "ocmm_core" else parts[0]


def _first_line(tree: ast.Module) -> str:
    return (ast.get_docstring(tree) or "").partition("\n")[0].rstrip(".").replace("``", "`")


def _houses(product: House, graph: Graph) -> Graph:
    found: defaultdict[str, set[str]] = defaultdict(set)
    for room, needs in graph.items():
        if room != "ocmm_core" and not _is_common(product, room):
            others = {house_of(one) for one in needs if not _is_common(product, one)}
            found[house_of(room)] |= others - {house_of(room)}
    return {name: frozenset(needs) for name, needs in found.items()}


def _is_common(product: House, room: str) -> bool:
    in_core = parent(room) == "ocmm_core" and is_single(room)
    return in_core and not product.product[room].is_package


def _inside(product: House, graph: Graph, name: str) -> Graph:
    # A root package may have files in addition to its packages; they count as one.
    files = (one for one in product.product.values() if not one.is_package)
    filled = {product.room(one.module) for one in files} - set(ROOTS)
    rooms = {room for room in filled if house_of(room) == name}
    return reduced({room: frozenset(graph[room] & rooms) for room in rooms})
