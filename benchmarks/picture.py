"""How fast the part is painted without a graphics card: frames a second, and beside a peer.

A part of some 100,000 triangles fills a picture of 1920 x 1080 and is turned by two degrees a
frame: its whole mesh in all three modes, the coarser one that the window shows while a view moves,
then the 3-D view of the window with a whole job in it, alone and while the chain of the
demonstration runs at 8 kHz in the same process. The peer is the painter's algorithm as one writes
it with numpy and QPainter: projected and lit by numpy, what faces away left out, sorted by depth,
one polygon a triangle. Both are counted in processor time of the thread that paints.

Run ``python -m benchmarks.picture [--triangles N] [--seconds S]``; the exit code is 1 if the view
beside 8 kHz shows fewer than 30 frames a second.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPolygonF
from PySide6.QtWidgets import QWidget

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.part_model import ModelFace, PartModel, PlacedPart
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.rendering import (
    Canvas,
    Rendering,
    RenderMesh,
    RenderMode,
    RenderStyle,
    coarser,
    face_colours,
    mesh_of,
)
from ocmm_gui.views import PointView

SIZE = (1920, 1080)
LEAST_FRAMES = 30.0
_TURN = np.radians(2.0)
_RADIUS = 42.0
_MOVING = 50_000
_BASE = "#8795a3"
_STYLES = {mode: RenderStyle(mode, "#e8eef4", "#1d242a") for mode in RenderMode}


def part_of(triangles: int) -> PartModel:
    """Return a torus on a waved plate, with about this number of triangles, about 80 mm wide."""
    n = int(np.sqrt(triangles / 4.0))
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, n + 1), np.linspace(0.0, 2.0 * np.pi, n + 1))
    tube = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], axis=-1)
    ring = 28.0 * np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=-1) + [0.0, 0.0, 14.0]
    x, y = (u - np.pi) * 13.0, (v - np.pi) * 13.0
    plate = np.stack([x, y, 1.5 * np.sin(0.3 * x) * np.cos(0.3 * y)], axis=-1)
    slope_x = 0.45 * np.cos(0.3 * x) * np.cos(0.3 * y)
    slope_y = -0.45 * np.sin(0.3 * x) * np.sin(0.3 * y)
    upright = np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=-1)
    upright /= np.linalg.norm(upright, axis=-1, keepdims=True)
    row = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = row[:-1, :-1], row[:-1, 1:], row[1:, 1:], row[1:, :-1]
    one = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    rim = np.concatenate([plate[0], plate[:, -1], plate[-1, ::-1], plate[::-1, 0]])
    return PartModel(
        source_name="benchmark",
        source_sha256="0" * 64,
        vertices=np.concatenate([(ring + 9.0 * tube).reshape(-1, 3), plate.reshape(-1, 3)]),
        normals=np.concatenate([tube.reshape(-1, 3), upright.reshape(-1, 3)]),
        triangles=np.concatenate([one, one + (n + 1) ** 2]).astype(np.int32),
        triangle_faces=np.repeat(np.array([0, 1], dtype=np.int32), len(one)),
        faces=(ModelFace(1, "Torus"), ModelFace(2, "BSplineSurface")),
        edge_points=rim,
        edge_starts=np.array([0, len(rim)], dtype=np.int32),
        edge_faces=np.array([[1, -1]], dtype=np.int32),
        deflection_mm=0.01,
    )


def view_of(azimuth: float) -> tuple[Float, Float]:
    """Return matrix and offset of a view from 35 degrees above that the part fills."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(0.6), np.sin(0.6)
    outward = np.array([ce * ca, ce * sa, se])
    right = np.array([-sa, ca, 0.0])
    scale = 0.5 * SIZE[1] / _RADIUS
    up = np.cross(outward, right)
    matrix = np.stack([scale * right, -scale * up, outward], axis=1)
    return matrix, np.array([0.5 * SIZE[0], 0.5 * SIZE[1], 0.0])


def seconds_of(paint: Callable[[Float, Float], None], frames: int) -> float:
    """Return the processor time of a frame, the median of ``frames``, s."""
    paint(*view_of(0.0))
    times = []
    for number in range(frames):
        began = time.thread_time()
        paint(*view_of(number * _TURN))
        times.append(time.thread_time() - began)
    return float(np.median(times))


def ours(model: PartModel, mesh: RenderMesh, mode: RenderMode) -> Callable[[Float, Float], None]:
    """Return what paints a frame."""
    canvas, colours = Canvas(*SIZE), mesh.vertex_colours(face_colours(model, _BASE))

    def paint(matrix: Float, offset: Float) -> None:
        Rendering(mesh, matrix, offset, canvas, _STYLES[mode], colours).go_on()

    return paint


def peer(model: PartModel) -> Callable[[Float, Float], None]:
    """Return the painter's algorithm: numpy projects, lights and sorts, QPainter fills."""
    image = QImage(*SIZE, QImage.Format.Format_RGB32)
    brushes = [QBrush(QColor(k * 135 // 255, k * 149 // 255, k * 163 // 255)) for k in range(256)]

    def paint(matrix: Float, offset: Float) -> None:
        places = model.vertices @ matrix + offset
        corners = places[model.triangles]
        u, v = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
        faces_eye = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0.0
        light = np.abs((model.normals @ matrix[:, 2])[model.triangles[:, 0]])
        order = np.argsort(corners[:, :, 2].mean(axis=1))
        order = order[faces_eye[order]]
        shade = (60.0 + 195.0 * light[order]).astype(int).tolist()
        painter = QPainter(image)
        image.fill(0)
        painter.setPen(Qt.PenStyle.NoPen)
        for (a, b, c), level in zip(corners[order, :, :2].tolist(), shade, strict=True):
            painter.setBrush(brushes[level])
            painter.drawConvexPolygon(QPolygonF([QPointF(*a), QPointF(*b), QPointF(*c)]))
        painter.end()

    return paint


class Painted(QObject):
    """Counts how often a widget is painted: asking for it is not painting it."""

    def __init__(self, widget: QWidget) -> None:
        super().__init__(widget)
        self.count = 0
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 - of Qt
        """Count, and let everything pass."""
        del watched
        self.count += event.type() == QEvent.Type.Paint
        return False


def frames_of_view(model: PartModel, seconds: float, *, measuring: bool) -> tuple[float, float]:
    """Return frames a second of the 3-D view that turns, and processor time of each, s."""
    app = make_application()
    with tempfile.TemporaryDirectory(prefix="ocmm-picture-") as folder:
        request = StationRequest(
            plan=resource("plans", "demo.toml"), out=Path(folder), speed=1.0, stay=True
        )
        station = build_station(request).station
        bridge = StationBridge(station)
        view = PointView(station.instruments.rig, station.instruments.body)
        view.resize(*SIZE)
        view.show()
        middle = np.array([0.0, 0.0, -110.0])
        placed = PlacedPart(model, RigidTransform(np.eye(3), middle), is_rough=True)
        view.show_job(replace(station.job.view(), placed_part=placed))
        if measuring:
            bridge.live_changed.connect(view.show_live)
            bridge.start()
        _for(app.processEvents, 3.0)
        painted = Painted(view)

        def turn() -> None:
            view.turn(float(_TURN))
            app.processEvents()

        began, worked = time.perf_counter(), time.thread_time()
        _for(turn, seconds)
        rate = painted.count / (time.perf_counter() - began)
        own_s = (time.thread_time() - worked) / max(painted.count, 1)
        bridge.close()
        view.close()
    return rate, own_s


def _for(call: Callable[[], object], seconds: float) -> None:
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        call()


def main() -> int:
    """Print the table and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=int, default=100_000)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    model = part_of(options.triangles)
    mesh = mesh_of(model)
    few = coarser(mesh, _MOVING)
    print(f"{len(mesh.triangles)} triangles, {SIZE[0]} x {SIZE[1]}, processor time of one thread")
    whole = {}
    for mode in RenderMode:
        whole[mode] = seconds_of(ours(model, mesh, mode), 40)
        print(f"  {mode.value:<13} {1e3 * whole[mode]:8.1f} ms  {1.0 / whole[mode]:6.0f} frames/s")
    moving = seconds_of(ours(model, few, RenderMode.SHADED), 40)
    print(f"  while it moves {1e3 * moving:7.1f} ms  {1.0 / moving:6.0f} frames/s, "
          f"{len(few.triangles)} triangles")  # fmt: skip
    others = seconds_of(peer(model), 5)
    print(f"  numpy and QPainter {1e3 * others:.0f} ms, {1.0 / others:.1f} frames/s: "
          f"{others / whole[RenderMode.SHADED]:.1f} times ours")  # fmt: skip
    rates = {}
    for measuring in (False, True):
        rates[measuring], own = frames_of_view(model, options.seconds, measuring=measuring)
        print(f"  3-D view that turns, {'beside 8 kHz' if measuring else 'alone'}: "
              f"{rates[measuring]:.0f} frames/s, {1e3 * own:.1f} ms of its thread")  # fmt: skip
    return 0 if rates[True] >= LEAST_FRAMES else 1


if __name__ == "__main__":
    sys.exit(main())
