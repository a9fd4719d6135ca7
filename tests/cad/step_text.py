"""The surfaces of a STEP file, counted in its text: no library and nothing of the import.

A face is an ADVANCED_FACE of a CLOSED_SHELL (those of open shells bound no material), its kind that
of its surface. Two faces are one surface if an EDGE_CURVE bounds both and their surfaces are the
same, untrimmed: cylinders of one axis line and radius; cones of one axis line, half angle
and way of opening. Planes are never joined: a face is a plane.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

KINDS = {"PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone"}
_SAME = 1e-6
"""Relative tolerance of a length in the file's unit, and of a direction: writers round to ten
digits."""

Surface = tuple[str, frozenset[int]]
"""Kind, and its faces by their places in the closed shells, from 1."""


def surfaces_in_text(path: Path) -> list[Surface]:
    """Return the planes, cylinders and cones of a file."""
    text = re.sub(r"\s+", "", path.read_text(encoding="utf-8", errors="replace"))
    rows = {key: (kind, rest) for key, kind, rest in re.findall(r"#(\d+)=(\w+)\((.*?)\);", text)}
    shells = [rest for kind, rest in rows.values() if kind == "CLOSED_SHELL"]
    faces = [face for shell in shells for face in _references(shell)]
    numbers: dict[str, list[int]] = {kind: [] for kind in KINDS.values()}
    surface, edges = {}, {}
    for number, face in enumerate(faces, start=1):
        *bounds, surface[number] = _references(rows[face][1])
        edges[number] = _edges(rows, bounds)
        kind = KINDS.get(rows[surface[number]][0])
        if kind:
            numbers[kind].append(number)
    found: list[Surface] = [("Plane", frozenset([number])) for number in numbers["Plane"]]
    for kind in ("Cylinder", "Cone"):
        groups: list[set[int]] = []
        for number in numbers[kind]:
            same = [
                group
                for group in groups
                if any(
                    edges[number] & edges[one] and _is_same(rows, surface[number], surface[one])
                    for one in group
                )
            ]
            groups = [group for group in groups if group not in same]
            groups.append({number}.union(*same))
        found += [(kind, frozenset(group)) for group in groups]
    return found


def _references(rest: str) -> list[str]:
    return re.findall(r"#(\d+)", rest)


def _edges(rows: dict[str, tuple[str, str]], bounds: list[str]) -> set[str]:
    """Return the EDGE_CURVEs of bounds: bound, loop, oriented edge, edge."""
    loops = [loop for bound in bounds for loop in _references(rows[bound][1])]
    ways = [way for loop in loops for way in _references(rows[loop][1])]
    return {edge for way in ways for edge in _references(rows[way][1])}


def _is_same(rows: dict[str, tuple[str, str]], one: str, other: str) -> bool:
    (point, axis, sizes), (beyond, axis_beyond, sizes_beyond) = (
        _placed(rows, one),
        _placed(rows, other),
    )
    if rows[one][0] == "CONICAL_SURFACE":
        # Stated radii differ with the place along the axis; the edge that both have decides that.
        sizes, sizes_beyond = sizes[1:], sizes_beyond[1:]
        turned = float(np.linalg.norm(axis - axis_beyond))
    else:
        turned = float(np.linalg.norm(np.cross(axis, axis_beyond)))
    aside = float(np.linalg.norm(np.cross(beyond - point, axis)))
    return turned < _SAME and aside < _SAME and float(np.abs(sizes - sizes_beyond).max()) < _SAME


def _placed(
    rows: dict[str, tuple[str, str]], key: str
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return point and axis of a surface, and its sizes: radius, and half angle of a cone."""
    rest = rows[key][1]
    place = _references(rest)[0]
    point, axis, *_ = _references(rows[place][1])
    sizes = np.array([float(word) for word in rest.split(",")[2:]])
    return _triple(rows, point), _triple(rows, axis), sizes


def _triple(rows: dict[str, tuple[str, str]], key: str) -> NDArray[np.float64]:
    words = rows[key][1].split("(")[1].rstrip(")").split(",")
    return np.array([float(word) for word in words])
