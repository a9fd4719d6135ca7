"""Calls of the library that differ between its versions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

import numpy as np

from ocmm_core.geometry import Float


def static(owner: Any, name: str) -> Any:
    """Return a static method; versions of the library name it with and without a suffix."""
    return getattr(owner, f"{name}_s", None) or getattr(owner, name)


def explored(shape: Any, kind: str, but_in: str = "SHAPE") -> Iterator[Any]:
    """Return an iterator over the parts of a kind, except those inside parts of another kind."""
    make, cast, wanted, avoided = _explorer_of(kind, but_in)
    explorer = make(shape, wanted, avoided)
    while explorer.More():
        yield cast(explorer.Current())
        explorer.Next()


@cache
def _explorer_of(kind: str, but_in: str) -> tuple[Any, Any, Any, Any]:
    """Return the explorer, the cast, and the enum values of both kinds, cached."""
    import OCP.TopAbs as TopAbs
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    return (
        TopExp_Explorer,
        static(TopoDS, kind.capitalize()),
        getattr(TopAbs, f"TopAbs_{kind}"),
        getattr(TopAbs, f"TopAbs_{but_in}"),
    )


def kind_of(adaptor: Any) -> str:
    return _word_of(adaptor.GetType())


@cache
def _word_of(kind: Any) -> str:
    """Return the word of a kind, cached: it takes as long as a face."""
    return str(kind).rpartition("GeomAbs_")[2].rstrip(">: 0123456789")


def is_turned(face: Any) -> bool:
    """Return whether the material lies along d/du times d/dv: for a reversed or mirrored face."""
    from OCP.TopAbs import TopAbs_REVERSED

    reverse = bool(face.Orientation() == TopAbs_REVERSED)
    place = face.Location()
    return reverse != (not place.IsIdentity() and place.Transformation().IsNegative())


def vector(triple: Any) -> Float:
    return np.array([triple.X(), triple.Y(), triple.Z()])


def triangulation(face: Any) -> tuple[Any, Any]:
    """Return the mesh of a face kept by the library, or None, and its place."""
    from OCP.BRep import BRep_Tool
    from OCP.TopLoc import TopLoc_Location

    place = TopLoc_Location()
    return static(BRep_Tool, "Triangulation")(face, place), place


def compound_of(shapes: Iterable[Any]) -> Any:
    """Return shapes as one."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for one in shapes:
        builder.Add(compound, one)
    return compound


class SameShape:
    """A shape as a key, regardless of its orientation."""

    __slots__ = ("_hash", "_shape")

    def __init__(self, shape: Any) -> None:
        self._shape, self._hash = shape, hash(shape)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SameShape) and bool(self._shape.IsSame(other._shape))


def without_place(face: Any) -> SameShape:
    """Return the key of a face without its place in an assembly."""
    from OCP.TopLoc import TopLoc_Location

    return SameShape(face.Located(TopLoc_Location()))
