"""Large STEP models: how long an import takes, how much memory its process has, how soon it stops.

Models are made with the library: a plate with many bores, an assembly of many different parts, a
skin of free forms, and one face with 900 holes. The first three are made as long as they have to be
for the size that is asked for. Of each the import with a part, as the window does it, is timed, the
greatest memory of the reading process is read from the system, what it says of progress is
counted, and then it is begun anew and cancelled. Beside it stands how long the library alone takes
for the file, as it reads it by itself: no import is quicker. Needs the extra ``step``:

    python -m benchmarks.large_models --size 20 [model.stp ...]
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import re
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_cad.step import read_model, usual_request
from ocmm_core.errors import OcmmError

SEED = 18
_MOST_S, _MOST_BYTES = 15.0, 1.5e9
_ALONE_S = 60.0
"""The library alone is ended after so long."""
_CANCEL_S = 3.0
"""The import is cancelled after so long."""


def main(arguments: list[str] | None = None) -> int:
    """Print the cost of each import; code 1 if one exceeds its limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", type=Path)
    parser.add_argument("--size", type=float, default=20.0, help="of those that are made, MB")
    parser.add_argument("--only", choices=tuple(MAKERS), help="one of those that are made")
    parser.add_argument("--stages", action="store_true", help="print what took how long")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        paths = options.models or [
            written(Path(folder) / f"{name}.step", make, options.size)
            for name, make in MAKERS.items()
            if options.only in (None, name)
        ]
        return max([_imported(path, stages=options.stages) for path in paths])


def _imported(path: Path, *, stages: bool) -> int:
    size = path.stat().st_size / 1e6
    told: list[tuple[float, str]] = []
    begun, worked = time.perf_counter(), _children_s()

    def progress(what: str) -> None:
        told.append((time.perf_counter() - begun, what))

    with Memory() as memory:
        try:
            model = read_model(path, request=usual_request(), with_part=True, progress=progress)
            said = f"{len(model.features)} features, {len(model.left_out)} left out. {model.remark}"
        except OcmmError as error:
            said = f"REFUSED: {error.what} {error.remedy}"
    took, worked = time.perf_counter() - begun, _children_s() - worked
    silent = max(np.diff([0.0, *(at for at, _ in told), took]))
    work = f"{took:.1f} s, {worked:.1f} s of processors, {memory.most / 1e6:.0f} MB"
    print(f"{path.stem}, {size:.1f} MB: {work}, {said}")
    print(f"  {len(told)} words of progress, the longest silence {silent:.1f} s", flush=True)
    alone = _library_alone(path)
    print(f"  the library alone {alone}", flush=True)
    if stages:
        _print_stages([*told, (took, "")])
    print(f"  cancelled after {_CANCEL_S:g} s, it ended in {_cancelled(path):.2f} s", flush=True)
    return int(took > _MOST_S or memory.most > _MOST_BYTES or said.startswith("REFUSED"))


def _children_s() -> float:
    """Return how long processes that have ended, and theirs, worked for this one, s."""
    times = os.times()
    return times.children_user + times.children_system


def _library_alone(path: Path) -> str:
    """Return the time of the library alone for a file, in a process with our limits."""
    process = multiprocessing.get_context("spawn").Process(target=_read_alone, args=(str(path),))
    before = _children_s()
    process.start()
    process.join(_ALONE_S)
    is_done = not process.is_alive()
    process.kill()
    process.join()
    worked = _children_s() - before
    return f"{worked:.1f} s of processors" + ("" if is_done else ", and was ended then")


def _read_alone(path: str) -> None:
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(path)
    reader.TransferRoots()


def _print_stages(told: list[tuple[float, str]]) -> None:
    stages: dict[str, float] = {}
    for (at, what), (until, _) in pairwise(told):
        # "the shapes of the file (4 s)" is the same stage, which takes long.
        named = re.sub(r" \(\d+ s\)$", "", what)
        words = " ".join(word for word in named.split() if not word.isdigit())
        stages[words] = stages.get(words, 0.0) + until - at
    for words, took in stages.items():
        print(f"  {took:7.2f} s {words}")


def _cancelled(path: Path) -> float:
    until = time.perf_counter() + _CANCEL_S
    with suppress(OcmmError):
        read_model(path, request=usual_request(), given_up=lambda: time.perf_counter() > until)
    return max(0.0, time.perf_counter() - until)


class Memory:
    """The greatest memory that a process of this one had, bytes."""

    def __init__(self) -> None:
        self.most = 0.0
        self._done = threading.Event()
        self._watch = threading.Thread(target=self._watched)

    def __enter__(self) -> Memory:
        self._watch.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._watch.join()

    def _watched(self) -> None:
        while not self._done.wait(0.1):
            for child in multiprocessing.active_children():
                self.most = max(self.most, _peak_bytes(child.pid))


def _peak_bytes(pid: int | None) -> float:
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:
        return 0.0
    of_it = [line for line in text.splitlines() if line.startswith("VmHWM")]
    return 1024.0 * float(of_it[0].split()[1]) if of_it else 0.0


def written(path: Path, make: Callable[[int], Any], size: float) -> Path:
    """Write a model of the requested length, MB."""
    _write(path, make(1))
    first = path.stat().st_size
    _write(path, make(4))
    each = (path.stat().st_size - first) / 3.0
    count = max(1, round((1e6 * size - first) / each) + 1) if each > 0.0 else 1
    _write(path, make(count))
    return path


def _write(path: Path, shape: Any) -> None:
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    Message.DefaultMessenger_s().Printers().Clear()
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))


def holed_plate(rows: int, columns: int, radius: float = 4.0, pitch: float = 20.0) -> Any:
    """Return a plate with bores in a grid, drawn up from one face: no cut is needed."""
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
        BRepBuilderAPI_MakeWire,
    )
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt, gp_Vec
    from OCP.TopoDS import TopoDS

    outline = BRepBuilderAPI_MakePolygon()
    across, along = pitch * columns, pitch * rows
    for x, y in ((0.0, 0.0), (across, 0.0), (across, along), (0.0, along)):
        outline.Add(gp_Pnt(x, y, 0.0))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire())
    for row in range(rows):
        for column in range(columns):
            centre = gp_Pnt(pitch * (column + 0.5), pitch * (row + 0.5), 0.0)
            ring = gp_Circ(gp_Ax2(centre, gp_Dir(0.0, 0.0, 1.0)), radius)
            wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(ring).Edge()).Wire()
            face.Add(TopoDS.Wire(wire.Reversed()))
    return BRepPrimAPI_MakePrism(face.Face(), gp_Vec(0.0, 0.0, 20.0)).Shape()


def nine_hundred_holes(count: int) -> Any:
    """Return a plate of 600 mm with 900 bores."""
    return holed_plate(30, 30)


def plates(count: int) -> Any:
    """Return an assembly of different plates with 24 bores each, in rows and layers."""
    rng = np.random.default_rng(SEED)
    shapes = []
    for number in range(count):
        shape = holed_plate(4, 6, float(rng.uniform(3.5, 6.0)), float(rng.uniform(18.0, 22.0)))
        shapes.append(_moved(shape, 150.0 * (number % 5), 110.0 * (number // 5 % 5),
                             60.0 * (number // 25)))  # fmt: skip
    return _together(shapes)


def skins(count: int) -> Any:
    """Return blocks whose upper faces are free forms of 24 by 24 poles."""
    rng = np.random.default_rng(SEED)
    return _together([
        _moved(_skin(rng), 90.0 * (number % 8), 90.0 * (number // 8), 0.0)
        for number in range(count)
    ])  # fmt: skip


def _skin(rng: np.random.Generator) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.collections import Array2_gp_Pnt
    from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
    from OCP.gp import gp_Pnt, gp_Vec

    side = np.linspace(0.0, 80.0, 24)
    x, y = np.meshgrid(side, side, indexing="ij")
    first, second = rng.uniform(0.0, 2.0 * np.pi, 2)
    z = 4.0 * np.sin(x / 15.0 + first) + 3.0 * np.cos(y / 12.0 + second)
    points = Array2_gp_Pnt(1, 24, 1, 24)
    for i in range(24):
        for j in range(24):
            points.SetValue(i + 1, j + 1, gp_Pnt(*map(float, (x[i, j], y[i, j], z[i, j]))))
    surface = GeomAPI_PointsToBSplineSurface(points).Surface()
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, -30.0)).Shape()


def one_plate(count: int) -> Any:
    """Return a plate with rows of 40 bores."""
    return holed_plate(count, 40)


def _moved(shape: Any, x: float, y: float, z: float) -> Any:
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    move = gp_Trsf()
    move.SetTranslation(gp_Vec(x, y, z))
    return shape.Moved(TopLoc_Location(move))


def _together(shapes: list[Any]) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for one in shapes:
        builder.Add(compound, one)
    return compound


MAKERS: dict[str, Callable[[int], Any]] = {
    "900_holes": nine_hundred_holes,
    "plates": plates,
    "skins": skins,
    "one_plate": one_plate,
}

if __name__ == "__main__":
    sys.exit(main())
