"""Painting a live chart: ours against pyqtgraph, written as its manual advises for speed.

Both show three curves of some minutes, taken anew twice a second and painted at once. pyqtgraph
gets one `PlotWidget` whose curves are kept and given new data (`setData`), without antialiasing
and with clipping and downsampling on, as its chapter on performance says; a second run of it has
antialiasing on, which ours has. Also what it costs to open a page of six such charts.

Run ``python -m benchmarks.charts``; it needs no screen.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
import pyqtgraph as pg
from PySide6.QtWidgets import QApplication, QWidget

from ocmm_core.geometry import Float
from ocmm_gui.charts import Curve, RecentChart

SIZE = (420, 180)
CURVES = 3
ROUNDS = 200
PAGE = 6


def main() -> None:
    """Print milliseconds a refresh, and the ratio to pyqtgraph."""
    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    for points in (120, 600, 6000):
        times = 0.5 * np.arange(float(points))
        waves = [np.sin(times / (3.0 + i)) + 0.01 * np.cos(7.0 * times) for i in range(CURVES)]
        ours = _refresh(app, *_ours(times, waves))
        print(f"{points:6} points a curve: ours {ours:6.2f} ms")
        for smooth in (False, True):
            theirs = _refresh(app, *_theirs(times, waves, smooth))
            word = "smooth" if smooth else "plain"
            print(f"{'':23} pyqtgraph, {word:6} {theirs:6.2f} ms, ours / its {ours / theirs:.2f}")
    times = 0.5 * np.arange(120.0)
    waves = [np.sin(times / (3.0 + i)) for i in range(CURVES)]
    opened = [_open(app, make, times, waves) for make in (_ours, lambda t, w: _theirs(t, w, True))]
    print(f"a page of {PAGE} charts opened: ours {opened[0]:.0f} ms, pyqtgraph {opened[1]:.0f} ms")


Chart = tuple[QWidget, Callable[[int], None]]


def _ours(times: Float, waves: list[Float]) -> Chart:
    chart = RecentChart("Drift, ppm", 0.5, float(times[-1]), "+.2f")

    def feed(turn: int) -> None:
        curves = [Curve(str(i), tuple(np.roll(w, turn).tolist())) for i, w in enumerate(waves)]
        chart.show_curves(times.tolist(), curves)

    return chart, feed


def _theirs(times: Float, waves: list[Float], smooth: bool) -> Chart:
    plot = pg.PlotWidget(title="Drift, ppm")
    plot.setClipToView(True)
    plot.setDownsampling(auto=True, mode="peak")
    curves = [plot.plot(pen=pg.mkPen(i, width=1), antialias=smooth) for i in range(len(waves))]

    def feed(turn: int) -> None:
        for curve, wave in zip(curves, waves, strict=True):
            curve.setData(times, np.roll(wave, turn))

    return plot, feed


def _refresh(app: QApplication, widget: QWidget, feed: Callable[[int], None]) -> float:
    """Return the median of the time from new data to painted pixels, ms."""
    widget.resize(*SIZE)
    widget.show()
    feed(0)
    app.processEvents()
    taken = []
    for turn in range(ROUNDS):
        begun = time.perf_counter()
        feed(turn)
        widget.grab()
        taken.append(1e3 * (time.perf_counter() - begun))
    widget.close()
    return statistics.median(taken)


def _open(
    app: QApplication, make: Callable[[Float, list[Float]], Chart], times: Float, waves: list[Float]
) -> float:
    begun = time.perf_counter()
    charts = [make(times, waves) for _ in range(PAGE)]
    for widget, feed in charts:
        widget.resize(*SIZE)
        feed(0)
        widget.show()
        widget.grab()
    taken = 1e3 * (time.perf_counter() - begun)
    for widget, _ in charts:
        widget.close()
    app.processEvents()
    return taken


if __name__ == "__main__":
    main()
