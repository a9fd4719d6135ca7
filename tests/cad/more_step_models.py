"""More models made with the library, and by hand what surfaces each has."""

from __future__ import annotations

from typing import Any

from ocmm_cad.step.brep._library import static
from tests.cad.step_models import Make, bent_pocket, block
from tests.cad.step_models import _moved as moved
from tests.cad.step_models import _rod as rod
from tests.cad.step_models import _with as with_
from tests.cad.step_models import _without as without

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def _cone_at(z: float, first: float, last: float, height: float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone

    return moved(BRepPrimAPI_MakeCone(first, last, height).Shape(), 50.0, 30.0, z)


def _threaded() -> Any:
    """Return a shaft with six grooves of two cones each, as a thread is often drawn."""
    body = rod((50, 30, 0), Z, 12, 60)
    for step in range(6):
        low = 10.0 + 5.0 * step
        ring = without(
            moved(rod((0, 0, 0), Z, 14, 4), 50, 30, low),
            with_(_cone_at(low, 12.0, 9.0, 2.0), _cone_at(low + 2.0, 9.0, 12.0, 2.0)),
        )
        body = without(body, ring)
    return body


def _rounded(chamfer: bool) -> Any:
    """Return a block with its four upright edges rounded by 8 mm, or cut by 1.5 mm."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS

    body = block()
    make = BRepFilletAPI_MakeChamfer(body) if chamfer else BRepFilletAPI_MakeFillet(body)
    edges = TopExp_Explorer(body, TopAbs_EDGE)
    seen: list[Any] = []
    while edges.More():
        edge = static(TopoDS, "Edge")(edges.Current())
        point = static(BRep_Tool, "Pnt")
        first = point(static(TopExp, "FirstVertex")(edge))
        last = point(static(TopExp, "LastVertex")(edge))
        upright = abs(first.Z() - last.Z()) > 1.0
        if upright and not any(edge.IsSame(one) for one in seen):
            seen.append(edge)
            make.Add(1.5 if chamfer else 8.0, edge)
        edges.Next()
    return make.Shape()


def _dome() -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    return without(block(), moved(BRepPrimAPI_MakeSphere(20.0).Shape(), 50.0, 30.0, 25.0))


def _groove() -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    ring = moved(BRepPrimAPI_MakeTorus(30.0, 6.0).Shape(), 50.0, 50.0, 20.0)
    return without(block(100, 100, 20), ring)


def _through(*holes: Any) -> Any:
    return without(block(), *holes)


Counts = tuple[int, int, int, int, int]
"""Planes, cylinders, cones, spheres, tori."""
MORE: dict[str, tuple[Make, Counts]] = {
    "counterbore": (lambda: _through(rod((50, 30, -1), Z, 6, 30), rod((50, 30, 12), Z, 12, 9)),
                    (7, 2, 0, 0, 0)),
    "countersink": (lambda: _through(rod((50, 30, -1), Z, 6, 30), _cone_at(10, 6, 16, 10)),
                    (6, 1, 1, 0, 0)),
    "blind bore": (lambda: _through(rod((50, 30, 5), Z, 10, 20)), (7, 1, 0, 0, 0)),
    "drilled end": (lambda: _through(with_(rod((50, 30, 8), Z, 10, 20), _cone_at(2, 0.01, 10, 6))),
                    (7, 1, 1, 0, 0)),
    # Two bores of one axis and radius, 1 mm apart: a slot between them.
    "bores beside a slit": (lambda: without(block(), rod((-1, 30, 10), X, 6, 102),
                                            moved(block(1, 60, 20), 50, 0, 0)),
                            (12, 2, 0, 0, 0)),
    # The wall between them is taken away by a wider chamber.
    "bores beside a chamber": (lambda: without(block(100, 60, 60), rod((-1, 30, 30), X, 8, 102),
                                               rod((40, 30, 30), X, 20, 20)),
                               (8, 3, 0, 0, 0)),
    "four bores": (lambda: _through(*(rod((x, y, -1), Z, 5, 30) for x in (20, 80)
                                      for y in (15, 45))), (6, 4, 0, 0, 0)),
    "bores from both sides": (lambda: without(block(100, 60, 40), rod((-1, 30, 20), X, 8, 41),
                                              rod((60, 30, 20), X, 8, 41)), (8, 2, 0, 0, 0)),
    "slit": (lambda: without(block(100, 60, 40), moved(block(5, 60, 30), 47, 0, 10)),
             (10, 0, 0, 0, 0)),
    "keyway": (lambda: without(rod((0, 30, 20), X, 20, 100), moved(block(60, 8, 20), 20, 26, 32)),
               (7, 1, 0, 0, 0)),
    "thread": (_threaded, (2, 7, 12, 0, 0)),
    "rounded block": (lambda: _rounded(False), (6, 4, 0, 0, 0)),
    "cut block": (lambda: _rounded(True), (10, 0, 0, 0, 0)),
    "bowl": (_dome, (6, 0, 0, 1, 0)),
    "ring groove": (_groove, (7, 0, 0, 0, 1)),
    "spline pocket": (bent_pocket, (7, 0, 0, 0, 0)),
}  # fmt: skip
