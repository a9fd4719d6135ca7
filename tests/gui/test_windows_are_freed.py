"""A closed window is freed with its station, after any page was opened in it.

A shift opens one window for job after job. A longer-living listener with a reference to the window
would keep all of it.
"""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.composition import AcceptanceBench, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.settings import SettingsStore
from ocmm_gui._start import let_go
from ocmm_gui.bridge import StationBridge
from ocmm_gui.home import StartWindow
from ocmm_gui.kit import NoticeCentre, RecentPlaces
from ocmm_gui.window import MainWindow
from tests.gui.window_pages import pages
from tests.host import HANG_MS

Watched = dict[str, "weakref.ref[object]"]


@pytest.fixture(scope="module", autouse=True)
def _freeze_again() -> Iterator[None]:
    """Set aside again what every later search for garbage would look through; see `conftest`."""
    yield
    gc.collect()
    gc.freeze()


def _open_and_close(folder: Path, qtbot: QtBot, *, tour: bool) -> Watched:
    """Measure in a window, open all its pages on a tour, and close it as the program does."""
    request = StationRequest(
        plan=resource("plans", "quick.toml"), probe=resource("probes", "standard.toml"),
        out=folder, stay=True, frame_rate_hz=800,
    )  # fmt: skip
    built = build_station(request)
    bridge, notices = StationBridge(built.station), NoticeCentre()
    bench = AcceptanceBench(request, folder=folder / "tests", register=folder / "artefacts")
    window = MainWindow(bridge, notices, bench=bench, hand=built.hand)
    with qtbot.waitActive(window, timeout=HANG_MS):
        window.show()
        window.activateWindow()
    gc.freeze()
    with qtbot.waitSignal(bridge.point_taken, timeout=HANG_MS):
        bridge.start()
    if tour:
        for _name, open_page in pages(window):
            open_page()
            QApplication.processEvents()
    window.close()
    for ended in (window, bridge, notices):
        ended.deleteLater()
    held = (window, bridge, notices, built.station)
    return {type(one).__name__: weakref.ref(one) for one in held}


def _alive(watched: Watched) -> list[str]:
    return [name for name, one in watched.items() if one() is not None]


@pytest.mark.usefixtures("qapp")
def test_every_page_of_a_closed_window_is_freed(qtbot: QtBot, tmp_path: Path) -> None:
    watched = _open_and_close(tmp_path / "job", qtbot, tour=True)
    let_go()
    assert not _alive(watched)
    assert not QApplication.allWidgets()


@pytest.mark.usefixtures("qapp")
def test_window_after_window_leaves_nothing(
    qtbot: QtBot, tmp_path: Path, repeats: Callable[..., int]
) -> None:
    n = repeats(3, 30)
    counts = []
    for number in range(1 + n):
        watched = _open_and_close(tmp_path / f"job {number}", qtbot, tour=False)
        let_go()
        assert not _alive(watched), number
        assert not QApplication.allWidgets(), number
        counts.append(len(gc.get_objects()))
    # A window is about 1500 objects of Python; modules loaded once came with the first.
    assert counts[-1] - counts[0] < 500 + 50 * n, counts


def test_the_start_page_is_freed(qapp: QApplication, qtbot: QtBot, tmp_path: Path) -> None:
    def come_and_go() -> weakref.ref[object]:
        store = SettingsStore.of_this_user()
        window = StartWindow(store, NoticeCentre(), RecentPlaces(tmp_path / "recent.json"))
        window.show()
        with qtbot.waitSignal(window.closed, timeout=HANG_MS):
            window.read()
            qapp.processEvents()
            window.close()
        window.deleteLater()
        return weakref.ref(window)

    watched = come_and_go()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    let_go()
    assert watched() is None
