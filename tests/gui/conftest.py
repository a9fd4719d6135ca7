"""A window on the real station of a virtual rig."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.composition import AcceptanceBench, BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow
from ocmm_sim.practice import Practice
from ocmm_sim.scene import WorldOptions
from tests.waiting import wait_until


@dataclass(frozen=True, slots=True)
class Bench:
    """A window and everything behind it."""

    built: BuiltStation
    bridge: StationBridge
    notices: NoticeCentre
    window: MainWindow

    def wait_complete(self, qtbot: QtBot) -> None:
        """Wait until the job is complete, and then until the window shows it.

        To paint every point meanwhile takes more of a processor than to measure it.
        """
        wait_until(lambda: self.built.station.job.view().complete)
        qtbot.waitUntil(lambda: self.bridge.shown.job.complete)


OpenWindow = Callable[..., Bench]


@pytest.fixture
def fresh_sides() -> None:
    """Start side processes as the program does, without a fork server: one test of each kind."""


@pytest.fixture(autouse=True)
def _sides_of_a_server(request: pytest.FixtureRequest) -> None:
    """Fork the window's side processes from a preloaded one; see `kept_sides`."""
    if not {"fresh_sides", "kept_sides"} & set(request.fixturenames):
        request.getfixturevalue("kept_sides")


@pytest.fixture
def open_window(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[OpenWindow]:
    """Return a function that opens a window on the short job; it is closed after the test."""
    opened: list[Bench] = []
    qapp.setStyle("Fusion")

    def make(
        *,
        speed: float = 0.0,
        stay: bool = False,
        world: WorldOptions | None = None,
        out: Path | None = None,
        plan: str = "quick.toml",
        probe: str = "standard.toml",
        reference: str = "",
        start: bool = True,
        led: bool = False,
        tests: bool = False,
        practice: bool = False,
    ) -> Bench:
        # A tenth of the frame rate: the same job for a tenth of the work.
        request = StationRequest(
            plan=resource("plans", plan),
            probe=resource("probes", probe),
            reference=resource("references", reference) if reference else None,
            out=tmp_path / "job",
            speed=speed,
            stay=stay,
            world=world or WorldOptions(),
            frame_rate_hz=800,
            serial="1",
        )
        built = build_station(request)
        notices = NoticeCentre()
        bridge = StationBridge(built.station)
        hand = built.hand if led else None
        acceptance = None
        if tests:
            acceptance = AcceptanceBench(
                request, folder=tmp_path / "tests", register=tmp_path / "artefacts"
            )
        room = Practice(request, tmp_path / "practice") if practice else None
        window = MainWindow(
            bridge, notices, out=out, hand=hand or (built.hand if practice else None),
            bench=acceptance, practice=room,
        )  # fmt: skip
        window.resize(1280, 720)
        # Keys go to the active window only.
        with qtbot.waitActive(window):
            window.show()
            window.activateWindow()
        # The content of the window is certain only before the start: nothing was measured yet.
        if start:
            bridge.start()
        opened.append(Bench(built, bridge, notices, window))
        return opened[-1]

    yield make
    for bench in opened:
        bench.window.close()
        bench.window.deleteLater()
        bench.bridge.deleteLater()
        bench.notices.deleteLater()
