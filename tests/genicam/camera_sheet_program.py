"""The page that sets up cameras, used with software cameras in a private network; run as a program.

``python -m tests.genicam.camera_sheet_program FOLDER [LANGUAGE THEME]`` prints what it saw as JSON,
and leaves pictures of the page in the folder.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from ocmm_boards import load_board
from ocmm_core.calibration.records import store_folder
from ocmm_core.documents import resource
from ocmm_core.fieldbus.wire import set_link
from ocmm_core.geometry import rotation_from_vector
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_gui.home import StartWindow
from ocmm_gui.kit import NoticeCentre, RecentPlaces, use_language
from ocmm_sim.genicam import Feature, GigeCamera, GigeConfig, packed
from tests.boards.board_scene import board_in
from tests.boards.test_detection import FACING, HEIGHT, WIDTH, picture_of, wide_cameras

_PERIOD_S, _VIEWS, _PATIENCE_S = 0.1, 9, 60.0
_LED = (120.0, 90.0)
_HOT = ((30, 31, 200), (41, 42, 60))
"""Rows and columns of hot pixels."""
_CONTROL = 0x0A00
"""Register of GigE Vision: who controls a camera."""


class Cameras:
    """Two cameras that show an LED as bright as they expose it, or given pictures."""

    def __init__(self) -> None:
        set_link("lo", up=True)
        self.cameras = [
            GigeCamera(GigeConfig(serial, f"127.0.0.{n}", WIDTH, HEIGHT, formats=("Mono12p",)), n)
            for n, serial in enumerate(("101", "102"), 2)
        ]
        self.pictures: list[NDArray[np.uint16]] = []
        self.lit = True
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._expose)
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        for one in self.cameras:
            one.close()

    def _expose(self) -> None:
        v, u = np.arange(HEIGHT)[:, None], np.arange(WIDTH)
        light = np.exp(-0.5 * ((v - _LED[1]) ** 2 + (u - _LED[0]) ** 2) / 1.5**2)
        sent: dict[tuple[int, float, bool, bool], NDArray[np.uint8]] = {}
        due = time.monotonic()
        for number in range(10**6):
            if self._ended.is_set():
                return
            for index, camera in enumerate(self.cameras):
                share = camera.memory.real(Feature.EXPOSURE) / 1000.0
                pictures, lit = self.pictures, self.lit
                key = (index, share, bool(pictures), lit)
                if key not in sent:
                    counts = np.minimum(100.0 + 4095.0 * share * lit * light, 4095.0)
                    counts = counts.astype(np.uint16)
                    counts[_HOT] = 900
                    sent[key] = packed(pictures[index] if pictures else counts)
                camera.send(sent[key].data.cast("B"), 10**18 + round(number * _PERIOD_S * 1e9))
            due = max(due + _PERIOD_S, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))


def _views(folder: Path, board: Path) -> list[NDArray[np.uint16]]:
    """Write views as the page does; return the pictures of one more, for cameras of 12 bits."""
    known, cameras, rng = load_board(board), wide_cameras(), np.random.default_rng(5)
    folder.mkdir()
    for number in range(1, _VIEWS + 2):
        turn = np.append(rng.uniform(-0.7, 0.7, 2), rng.uniform(-0.4, 0.4))
        at = rng.uniform([-90.0, -150.0, -70.0], [90.0, 250.0, 70.0])
        pictures = [
            picture_of(camera, known, FACING @ rotation_from_vector(turn), at)
            for camera in cameras
        ]  # fmt: skip
        if number <= _VIEWS:
            for serial, picture in zip(("101", "102"), pictures, strict=True):
                cv2.imwrite(str(folder / f"{number:03d}-{serial}.png"), picture)
    return [picture.astype(np.uint16) * 14 for picture in pictures]


def _rig(folder: Path) -> Path:
    text = resource("rigs", "recommended.toml").read_text(encoding="utf-8")
    for old, new in (
        ("frame_rate_hz = 8000", f"frame_rate_hz = {1.0 / _PERIOD_S:.0f}"),
        ("20600001", "101"), ("20600002", "102"),
        ("width_px = 2048", f"width_px = {WIDTH}"), ("height_px = 2048", f"height_px = {HEIGHT}"),
        ("pitch = 0.012", "pitch = 0.0307"), ("u0_px = 1024.0", f"u0_px = {WIDTH / 2}"),
        ("v0_px = 1023.5", f"v0_px = {HEIGHT / 2}"), ("u0_px = 1023.5", f"u0_px = {WIDTH / 2}"),
        ("v0_px = 1024.0", f"v0_px = {HEIGHT / 2}"),
    ):  # fmt: skip
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _is_good(brightness: str) -> bool:
    return "good" in brightness or "gut" in brightness


def main() -> None:
    folder = Path(sys.argv[1])
    language, theme = (*sys.argv[2:], "en", "light")[:2]
    app = QApplication([])
    use_language(app, language)
    board = board_in(folder, columns=8, rows=5, pitch=48.0)
    last = _views(folder / "views", board)
    store = SettingsStore(
        SettingsFile(folder / "station.toml"), SettingsFile(folder / "user.toml"),
        {
            "instrument.source": "genicam:101,102", "instrument.rig": _rig(folder),
            "instrument.calibrations": folder / "calibrations", "window.theme": theme,
        },
    )  # fmt: skip
    notices, told = NoticeCentre(), list[str]()
    notices.posted.connect(lambda notice: told.append(notice.what))
    cameras = Cameras()
    found: dict[str, Any] = {}
    window = StartWindow(store, notices, RecentPlaces(folder / "recent.json"))
    window.resize(1280, 720)
    window.show()
    window.activateWindow()
    QTest.qWaitForWindowActive(window)
    window.page.setFocus()

    def until(holds: Callable[[], bool]) -> None:
        deadline = time.monotonic() + _PATIENCE_S
        while not holds():
            assert time.monotonic() < deadline, (sheet.about(), told)
            QTest.qWait(20)

    def press(key: Qt.Key, at: QWidget | None = None) -> None:
        QTest.keyClick(at or sheet, key)

    try:
        press(Qt.Key.Key_F6, window.page)
        sheet = window.cameras
        until(lambda: bool(sheet.pictures))
        until(lambda: sheet.brightness[1].text() != "")
        found["first"] = [one.text() for one in sheet.brightness]
        for _ in range(5):
            # On a busy computer images may be incomplete: a person presses the key again.
            told.clear()
            until(sheet.keys["settle"].isEnabled)
            press(Qt.Key.Key_F2)
            until(lambda: _is_good(sheet.brightness[0].text()) or bool(told))
            if not told:
                break
        found["exposed"] = [one.text() for one in sheet.brightness]
        window.grab().save(str(folder / "exposed.png"))
        before = float(cameras.cameras[0].memory.real(Feature.EXPOSURE))
        press(Qt.Key.Key_F3)
        until(lambda: cameras.cameras[1].memory.real(Feature.EXPOSURE) < 0.9 * before)
        until(sheet.keys["keep"].isEnabled)
        press(Qt.Key.Key_F5)
        until(lambda: cameras.cameras[1].memory.integer(Feature.USER_SET_DEFAULT) == 1)
        until(sheet.keys["black"].isEnabled)
        press(Qt.Key.Key_F10)
        until(lambda: any("black image" in one for one in told))
        found["lit"] = told.pop()
        window.grab().save(str(folder / "black.png"))
        cameras.lit = False
        until(sheet.keys["black"].isEnabled)
        QTest.qWait(round(1e3 * 8 * _PERIOD_S))
        press(Qt.Key.Key_F10)
        folder_of_blacks = store_folder(folder / "calibrations", "recommended")
        until(lambda: len(list(folder_of_blacks.glob("black-*.ocmmblack"))) == 2 or bool(told))
        until(sheet.keys["view"].isEnabled)
        found["black"] = sheet.about()
        cameras.lit = True
        cameras.pictures = last
        until(sheet.keys["view"].isEnabled)
        press(Qt.Key.Key_F6)
        until(lambda: "'Board'" in sheet.about() or "Tafel" in sheet.about())
        found["asked"] = sheet.about()
        sheet.fields["board"].setText(str(board))
        sheet.fields["views"].setText(str(folder / "views"))
        sheet.fields["who"].setText("Ann")
        until(sheet.keys["view"].isEnabled)
        for _ in range(5):
            # On a busy computer images may be incomplete: a person presses the key again.
            told.clear()
            press(Qt.Key.Key_F6)
            until(lambda: "10: 40, 40" in sheet.wanted.text() or bool(told))
            if not told:
                break
            until(sheet.keys["view"].isEnabled)
        found["view"] = sheet.wanted.text()
        window.grab().save(str(folder / "view.png"))
        press(Qt.Key.Key_F7)
        window.grab().save(str(folder / "calibrating.png"))
        until(lambda: not sheet.is_working())
        found["refused"] = told[-1]
        found["accepts"] = sheet.keys["accept"].isEnabled()
        kept = list(store_folder(folder / "calibrations", "recommended").rglob("boards-*.json"))
        found["kept"] = len(kept)
        for _ in range(5):
            # The first ones take the notices away.
            if sheet.isVisible():
                press(Qt.Key.Key_Escape)
                QTest.qWait(50)
        until(lambda: not any(one.memory.u32(_CONTROL) for one in cameras.cameras))
        assert not sheet.isVisible()
        press(Qt.Key.Key_F6, window.page)
        until(lambda: bool(sheet.about()) and sheet.keys["settle"].isEnabled())
        window.close()
        found["left"] = len(multiprocessing.active_children())
        found["told"] = told
    finally:
        window.close()
        cameras.close()
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
