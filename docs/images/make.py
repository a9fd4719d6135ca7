"""Make the pictures of the window.

One seeded run on the virtual rig is stopped where it is worth a picture. With ``--bus`` there is a
second one, on a virtual bus, in which a camera is switched off; that needs a computer that is not
busy with anything else.

Run ``python docs/images/make.py [FOLDER] [--bus]``; without a folder the pictures beside this file
are made again.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import msgspec
from PySide6.QtTest import QTest  # the platform must be chosen before
from PySide6.QtWidgets import QApplication

from benchmarks.camera_faults import CameraDeed, FaultKind
from benchmarks.faulty_cameras import faulty_stations
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import FeatureState, JobView, LiveView, StatusWord
from ocmm_core.inspection.plan import load_plan
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import Mode, NoticeCentre, active_feature
from ocmm_gui.window import MainWindow
from ocmm_sim.scene import ScriptedOcclusion, WorldOptions
from ocmm_sim.sources import script_of

SIZE = (1920, 1080)
SMALL = (1280, 720)
PATIENCE_S = 400.0
SPEED = 3.0
FRAME_RATE_HZ = 800
HIDDEN = (0, 1, 3, 4)
"""LEDs that a hand covers for the picture of the lost probe."""

BUS_S = 40.0
"""So long the bus runs before its picture is taken: the trends have something to show."""

State = Callable[[LiveView, JobView], bool]


def main(folder: Path) -> None:
    """Make all pictures in ``folder``."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    app = make_application()
    _inspection(app, folder)
    if "--bus" in sys.argv:
        _bus(app, folder)


def _inspection(app: QApplication, folder: Path) -> None:
    # The pages show the place of the job: a short name in place of a path of this computer.
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        out = Path("jobs")
        request = _request(out)
        built = build_station(request)
        bridge = StationBridge(built.station)
        window = MainWindow(bridge, NoticeCentre(), out=out)
        window.resize(*SIZE)
        window.show()
        bridge.start()
        try:
            _wait(app, bridge, _is_measuring)
            _grab(app, window, bridge, folder, "measuring", ("dark", "light"))
            _grab(app, window, bridge, folder, "measuring_720p", ("light", "contrast"), size=SMALL)
            _grab(app, window, bridge, folder, "far", ("dark", "contrast"), far=True)
            _wait(app, bridge, _is_finished)
            window.show_far(False)
            _grab(app, window, bridge, folder, "feature_finished", ("dark", "light"))
            _grab(app, window, bridge, folder, "far_720p", ("light",), size=SMALL, far=True)
            _grab(app, window, bridge, folder, "far", ("light",), far=True)
            window.show_far(False)
            _wait(app, bridge, _is_lost)
            _grab(app, window, bridge, folder, "target_lost", ("dark", "light"))
            _grab(app, window, bridge, folder, "far_lost", ("light",), far=True)
            window.show_far(False)
            # The budgets of a job that goes on are computed again and again.
            bridge.job.toggle_pause()
            _sheets(app, window, folder)
        finally:
            window.close()


def _sheets(app: QApplication, window: MainWindow, folder: Path) -> None:
    """Picture every sheet in the three themes, the dark one large."""
    sheets = window.sheets
    sheets.show_sheet("results")
    detail = sheets.results.detail
    _until(app, lambda: not detail.is_busy())
    sheets.results.table.selectRow(0)
    detail.simulate()
    _until(app, lambda: not detail.is_busy())
    _grab_sheet(app, window, folder, "results")
    sheets.results.keys["report"].trigger()
    _grab_sheet(app, window, folder, "report")
    sheets.report.formats.setCurrentRow(sheets.report.formats.count() - 1)
    _grab_sheet(app, window, folder, "report_pages")
    sheets.show_sheet("plan")
    sheets.plan.items.setCurrentRow(5)
    _grab_sheet(app, window, folder, "plan")
    sheets.show_sheet("alignment")
    _until(app, lambda: not sheets.alignment.is_busy())
    _grab_sheet(app, window, folder, "alignment")
    sheets.open_job()
    _grab_sheet(app, window, folder, "job")
    sheets.show_sheet("keys")
    _grab_sheet(app, window, folder, "keys")


def _grab_sheet(app: QApplication, window: MainWindow, folder: Path, name: str) -> None:
    window.banner.hide()
    for theme, size in (("dark", SIZE), ("light", SMALL), ("contrast", SMALL)):
        window.resize(*size)
        window.use_theme(theme)
        for _ in range(20):
            app.processEvents()
            time.sleep(0.01)
        # Pages are drawn again for the room that there is now.
        _until(app, lambda: not window.sheets.report.is_previewing())
        path = folder / f"inspect_{name}_{theme}.png"
        window.grab().save(str(path))
        sys.stdout.write(f"{path}\n")


def _until(app: QApplication, state: Callable[[], bool]) -> None:
    until = time.monotonic() + PATIENCE_S
    while not state() and time.monotonic() < until:
        app.processEvents()
        time.sleep(0.01)


def _bus(app: QApplication, folder: Path) -> None:
    with tempfile.TemporaryDirectory() as out:
        control = f"{out}/cameras"
        request = StationRequest(
            plan=resource("plans", "demo.toml"), out=Path(out), source="ethercat:virtual"
        )
        with faulty_stations(control):
            built = build_station(request)
        bridge = StationBridge(built.station)
        window = MainWindow(bridge, NoticeCentre(), out=Path(out))
        window.resize(*SIZE)
        window.show()
        bridge.start()
        try:
            _wait(app, bridge, _is_trusted)
            _run_for(app, bridge, BUS_S)
            window.show_mode(Mode.MAINTAIN)
            _grab_bus(app, window, bridge, folder, "bus_in_order")
            _switch_off_second_camera(control)
            _wait(app, bridge, _is_not_ready)
            _run_for(app, bridge, 2.0)
            _grab_bus(app, window, bridge, folder, "bus_camera_missing")
            window.show_mode(Mode.INSPECT)
            _grab(app, window, bridge, folder, "far_not_ready", ("dark",), far=True)
        finally:
            window.close()


def _grab_bus(
    app: QApplication, window: MainWindow, bridge: StationBridge, folder: Path, name: str
) -> None:
    for themes, size in ((("dark", "light"), SIZE), (("contrast",), SMALL)):
        window.resize(*size)
        for theme in themes:
            window.use_theme(theme)
            _run_for(app, bridge, 0.6)
            suffix = "" if size == SIZE else f"_{size[1]}p"
            path = folder / f"window_{theme}_{name}{suffix}.png"
            window.grab().save(str(path))
            sys.stdout.write(f"{path}\n")


def _switch_off_second_camera(control: str) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ask:
        ask.sendto(msgspec.json.encode(CameraDeed(do=FaultKind.POWER_OFF, camera=1)), control)


def _run_for(app: QApplication, bridge: StationBridge, seconds: float) -> None:
    bridge.blockSignals(False)
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        app.processEvents()
        time.sleep(0.005)


def _request(out: Path) -> StationRequest:
    plain = StationRequest(
        plan=resource("plans", "gauge.toml"),
        part=resource("parts", "gauge.toml"),
        out=out,
        speed=SPEED,
        stay=True,
        frame_rate_hz=FRAME_RATE_HZ,
    )
    touches = script_of(plain, load_plan(plain.plan)).build().truth.touches
    pocket = [touch for touch in touches if touch.feature == "POCKET"]
    hidden = ScriptedOcclusion(1, HIDDEN, pocket[1].first_frame, pocket[4].last_frame)
    return replace(plain, world=WorldOptions(occlusions=(hidden,)))


def _is_measuring(live: LiveView, job: JobView) -> bool:
    feature = active_feature(job)
    return (
        feature is not None
        and feature.name == "BORE_B"
        and len(feature.points) == 5
        and live.status in (StatusWord.MEASURING, StatusWord.READY)
    )


def _is_finished(live: LiveView, job: JobView) -> bool:
    # On a busy computer the job may be ahead of the state to be shown.
    shown = job.shown
    done = shown is not None and shown.state is FeatureState.DONE
    return done and not job.complete and live.tip_world is not None


def _is_trusted(live: LiveView, job: JobView) -> bool:
    return live.tip_world is not None


def _is_not_ready(live: LiveView, job: JobView) -> bool:
    return live.status is StatusWord.NOT_READY


def _is_lost(live: LiveView, job: JobView) -> bool:
    return live.status is StatusWord.LOST


def _wait(app: QApplication, bridge: StationBridge, state: State) -> None:
    """Let the job continue to a state, then hold the window's content."""
    bridge.blockSignals(False)
    until = time.monotonic() + PATIENCE_S
    while not state(bridge.station.looks.live(), bridge.shown.job):
        if time.monotonic() > until:
            raise SystemExit(f"{state.__name__} did not come within {PATIENCE_S:.0f} s.")
        app.processEvents()
        time.sleep(0.002)
    # One more turn, so that the window shows this state.
    live = bridge.station.looks.live()
    bridge.live_changed.emit(live)
    bridge.blockSignals(True)


def _grab(
    app: QApplication,
    window: MainWindow,
    bridge: StationBridge,
    folder: Path,
    name: str,
    themes: Iterable[str],
    *,
    size: tuple[int, int] = SIZE,
    far: bool = False,
) -> None:
    window.resize(*size)
    window.show_far(far)
    for theme in themes:
        window.use_theme(theme)
        # Static layers are painted gradually.
        QTest.qWait(500)
        path = folder / (f"{name}_{theme}.png" if far else f"window_{theme}_{name}.png")
        window.grab().save(str(path))
        sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    given = [Path(word) for word in sys.argv[1:] if not word.startswith("--")]
    main(given[0] if given else Path(__file__).parent)
