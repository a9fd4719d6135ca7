"""A measuring program measures with the running window: start, guidance, operator, stop."""

from __future__ import annotations

import json
import socket
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot
from websockets.sync.client import connect

from ocmm_core.inspection.session import CLIENT_EVENT
from ocmm_core.settings import SettingsStore
from ocmm_core.storage import JobFile
from tests.gui.conftest import OpenWindow
from tests.host import HANG_MS, HANG_S
from tests.serve.dme_bench import PlainClient
from tests.serve.second_screen import read_code


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as held:
        return int(held.getsockname()[1])


def test_a_program_measures_with_the_window(open_window: OpenWindow, qtbot: QtBot) -> None:
    port = _free_port()
    SettingsStore.of_this_user().change({"serve.port": port})
    # In real time: a touch of the virtual hand takes some seconds.
    bench = open_window(stay=True, led=True, speed=1.0)
    window, strip, station = bench.window, bench.window.service, bench.built.station
    before = station.job.plan.name
    assert strip.isHidden()
    window.actions_by_key["serve"].trigger()
    qtbot.waitUntil(lambda: not strip.isHidden(), timeout=HANG_MS)
    assert f"127.0.0.1:{port}" in strip.status.text()
    assert not strip.buttons["done"].isEnabled()
    assert station.job.plan.name == "POINTS" != before
    with PlainClient(("127.0.0.1", port)) as client:
        client.ask("00001 StartSession()")
        qtbot.waitUntil(strip.buttons["done"].isEnabled, timeout=HANG_MS)
        client.ask("00002 Home()")
        client.ask('00003 ChangeTool("standard")')
        client.send("00004 PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
        wanted = "Touch X 10.000 Y 20.000 Z 0.000 from I 0.000 J 0.000 K 1.000 (MachineCsy)."
        qtbot.waitUntil(lambda: window.desk.guidance.step.text() == wanted, timeout=HANG_MS)
        assert "PtMeas(X(10)" in strip.lines.text()
        window.show_far(True)
        qtbot.waitUntil(lambda: wanted in window.far.type_pixels(), timeout=HANG_MS)
        target = bench.bridge.shown.job.target
        assert target is not None
        np.testing.assert_allclose(target.ball_world, [10.0, 20.0, 3.0], atol=0.01)
        found = client.until("00004 %")
        assert found[1].startswith("00004 # X("), found
        qtbot.waitUntil(lambda: "→   00004 # X(" in strip.lines.text(), timeout=HANG_MS)
        # The nominal of the program is gone with its answer.
        qtbot.waitUntil(lambda: wanted not in window.far.type_pixels(), timeout=HANG_MS)
        client.ask("00005 EnableUser()")
        strip.buttons["done"].click()
        assert 'E0000 # KeyPress("Done")' in client.until('E0000 # KeyPress("Done")')
        job = station.job.path
        client.ask("00006 EndSession()")
    strip.stop_button.click()
    qtbot.waitUntil(strip.isHidden, timeout=HANG_MS)
    with JobFile.read(job, read_only=True) as file:
        assert len(file.points()) >= 1
        assert any(one.kind == CLIENT_EVENT for one in file.events())
    # The address is free again, and the window measures on.
    with socket.create_server(("127.0.0.1", port)):
        pass
    assert station.faults.measuring is None


def test_an_open_address_is_refused_in_a_sentence(open_window: OpenWindow, qtbot: QtBot) -> None:
    SettingsStore.of_this_user().change({"serve.host": "192.0.2.1"})
    bench = open_window(stay=True, led=True)
    plan = bench.built.station.job.plan
    told: list[object] = []
    bench.bridge.failed.connect(told.append)
    bench.window.actions_by_key["serve"].trigger()
    qtbot.waitUntil(lambda: bool(told), timeout=HANG_MS)
    assert "192.0.2.1" in str(told[0])
    assert bench.window.service.isHidden()
    # The job is the one before.
    assert bench.built.station.job.plan is plan


def pixels_of(image: QImage) -> NDArray[np.uint8]:
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(bytes(grey.constBits()), np.uint8).reshape(grey.height(), -1)
    return rows[:, : grey.width()]


def test_a_tablet_looks_at_the_job_of_the_window(open_window: OpenWindow, qtbot: QtBot) -> None:
    port = _free_port()
    SettingsStore.of_this_user().change({"screen.port": port})
    bench = open_window(stay=True, led=True)
    window, job = bench.window, bench.built.station.job
    window.actions_by_key["screen"].trigger()
    sheet = window.sheets.screen
    qtbot.waitUntil(lambda: sheet.address.text() != "", timeout=HANG_MS)
    page, _, token = sheet.address.text().partition("#")
    assert page == f"http://127.0.0.1:{port}/"
    assert "Only this computer" in sheet.doubt.text()
    assert read_code(pixels_of(sheet.code.pixmap().toImage())) == sheet.address.text()
    with connect(f"ws://127.0.0.1:{port}/live") as tablet:
        tablet.send(json.dumps({"token": token}))
        shown = json.loads(tablet.recv(timeout=HANG_S))
        assert shown["controls"] is False
        assert shown["live"]
        qtbot.waitUntil(lambda: sheet.readers.text() == "One page is open.", timeout=HANG_MS)
        # The page follows the window to the next part.
        before = job.path.stem
        header = replace(job.view().header, serial="0815")
        bench.bridge.jobs.next_part(header)
        names = {before}
        deadline = time.monotonic() + HANG_S
        while names == {before}:
            assert time.monotonic() < deadline
            qtbot.wait(20)
            tablet.send(json.dumps({"seen": shown["number"]}))
            shown = json.loads(tablet.recv(timeout=HANG_S))
            names |= {shown["job"]["job"]} if shown["job"] else set()
        assert names == {before, job.path.stem}
        assert "0815" in shown["job"]["title"]
    qtbot.waitUntil(lambda: sheet.readers.text() == "No page is open yet.", timeout=HANG_MS)
    sheet.keys["stop"].trigger()
    qtbot.waitUntil(lambda: sheet.readers.text() == "The second screen is off.", timeout=HANG_MS)
    with socket.create_server(("127.0.0.1", port)):
        pass
    # Opened again, it runs again; the job went on all the time.
    sheet.keys["start"].trigger()
    qtbot.waitUntil(lambda: sheet.address.text() != "", timeout=HANG_MS)
    assert sheet.address.text().partition("#")[2] != token
    assert bench.built.station.job is job
    assert bench.built.station.faults.measuring is None


def test_buttons_in_a_network_without_tls_are_refused(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    SettingsStore.of_this_user().change({"screen.host": "0.0.0.0", "screen.control": True})  # noqa: S104 - refused
    bench = open_window(stay=True, led=True)
    told: list[object] = []
    bench.bridge.failed.connect(told.append)
    bench.window.actions_by_key["screen"].trigger()
    qtbot.waitUntil(lambda: bool(told), timeout=HANG_MS)
    assert "Without TLS" in str(told[0])
    assert bench.window.sheets.screen.readers.text() == "The second screen is off."
