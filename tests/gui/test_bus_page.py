"""The bus page shows the report of the bus, and nothing old as new."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import msgspec
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.acquisition.frames import FrameRing
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.report import BusPhase, BusReport, Histogram
from ocmm_core.station import NO_BUS, NO_REPORT, BusView, BusWatch, bus_text
from ocmm_gui.kit import THEMES, use_language
from ocmm_gui.maintain import BusPage
from ocmm_gui.maintain._wire_view import WireView
from tests.gui.bus_reports import FOUR, IN_ORDER, MISSING, publish
from tests.host import HANG_MS
from tests.waiting import let_pass

_LOOK_S = 0.1
"""A watch decodes reports no more often than this."""


@dataclass
class Wire:
    """A page on a ring that the test writes reports into."""

    ring: FrameRing = field(default_factory=lambda: FrameRing.create(2, 16))
    ended: str = ""

    def __post_init__(self) -> None:
        self.watch = BusWatch(self.ring)
        self.page = BusPage(lambda: self.watch.view(self.ended))
        self.page.resize(1080, 620)
        self.page.show()

    def show(self, report: BusReport) -> None:
        publish(self.ring, report)
        let_pass(_LOOK_S)
        self.page.refresh()


@pytest.fixture
def wire(qtbot: QtBot, qapp: QApplication) -> Iterator[Wire]:
    made = Wire()
    yield made
    made.page.close()
    made.page.deleteLater()
    made.ring.close()


def test_without_a_bus_it_says_so_and_what_to_do(qtbot: QtBot) -> None:
    page = BusPage(lambda: None)
    qtbot.addWidget(page)
    page.show()
    assert NO_BUS in page.trouble()
    assert "Settings (Instrument, Cameras) ethercat:" in page.trouble()


def test_without_a_bus_it_says_so_in_the_language_of_the_window(
    qtbot: QtBot, qapp: QApplication
) -> None:
    try:
        assert use_language(qapp, "de")
        page = BusPage(lambda: None)
        qtbot.addWidget(page)
        page.show()
        assert page.trouble().startswith("Die Bilder dieses Auftrags kommen nicht von")
        assert "Choose" not in page.trouble()
    finally:
        use_language(qapp, "en")


def test_before_the_first_report_it_says_so(wire: Wire) -> None:
    assert NO_REPORT in wire.page.trouble()
    wire.ended = "There is no interface 'nope0'."
    wire.page.refresh()
    assert "nope0" in wire.page.trouble()


def test_a_bus_in_order(wire: Wire) -> None:
    wire.show(IN_ORDER)
    page = wire.page
    assert page.phase.text() == "IN OPERATION"
    assert page.wire.summary() == "2 of 2 cameras answer."
    # left, as in its report: serial, place, state, code, frames, lost, overruns, bad, ...
    assert page.cameras.cells(0) == (
        "left", "1001", "1", "OP", "no error", "4799912", "88", "1", "3", "0", "36.4", "2", "0",
        "17", "1.4.2",
    )  # fmt: skip
    facts = {name: label.text() for name, label in page.facts.items()}
    assert facts == {
        "Frames": "9599912", "Frames lost": "88", "Recoveries": "1", "Stray answers": "4",
        "Objects done": "54", "Objects failed": "1", "Cycle": "1 ms", "Exposure": "125 µs",
    }  # fmt: skip
    # 595,000 of 600,000 lie at most at 100 us, 599,716 at 200 us: 99.95 %.
    assert page.lateness.word() == "99.9 % ≤ 200, worst 6212"
    assert page.notes.text() == ""


def test_a_missing_camera_is_said_in_words_and_drawn(wire: Wire) -> None:
    wire.show(MISSING)
    page = wire.page
    assert page.phase.text() == "RECOVERING"
    assert page.trouble().startswith("Camera 'right' (serial 1002) is missing. Switch the camera")
    assert page.wire.summary() == "Broken behind 'left': 'right' does not answer."
    assert page.cameras.cells(1)[2:5] == ("not found", "NO ANSWER", "–")
    assert page.events.cells(0)[1:5] == (
        "right",
        "Camera 'right' (serial 1002) is missing.",
        "Switch the camera on and check the cable that leads to it.",
        "1000",
    )
    when = datetime.fromtimestamp(MISSING.events[-1].utc_ns * 1e-9).astimezone()
    assert page.events.cells(0)[0] == f"{when:%Y-%m-%d %H:%M:%S}.000"
    assert page.events.rowCount() == len(MISSING.events)
    assert "real-time priority" in page.notes.text()


def test_an_open_ring_and_a_state_are_shown(wire: Wire) -> None:
    wire.show(FOUR)
    assert "The ring to enp4s0 is open" in wire.page.wire.summary()
    assert wire.page.cameras.cells(3)[3:5] == ("SAFEOP", "0x001B sync manager watchdog")


def test_the_accounts_add_up_or_say_that_they_do_not(wire: Wire) -> None:
    wire.show(IN_ORDER)
    rows = {name: (count, share) for name, count, share in wire.page.accounts.rows()}
    assert rows["elapsed"] == ("600015", "100.000 %")
    verdicts = [rows[name] for name in ("good", "late", "lost", "bad")]
    assert sum(int(count) for count, _ in verdicts) == 600_015
    assert sum(int(share.removesuffix(" %").replace(".", "")) for _, share in verdicts) == 100_000
    wire.show(msgspec.structs.replace(IN_ORDER, elapsed=600_020))
    assert ("NO VERDICT", "5", "wrong") in wire.page.accounts.rows()


def test_a_report_that_is_old_is_not_shown_as_new(wire: Wire, qtbot: QtBot) -> None:
    wire.show(IN_ORDER)
    assert wire.page.phase.text() == "IN OPERATION"
    # The page polls four times a second.
    qtbot.waitUntil(lambda: wire.page.phase.text() == "NO REPORT", timeout=HANG_MS)
    assert "No report from the bus process" in wire.page.trouble()
    wire.show(IN_ORDER)
    assert wire.page.phase.text() == "IN OPERATION"
    wire.ended = "The bus process ended unexpectedly (code -9)."
    wire.page.refresh()
    assert wire.page.phase.text() == "ENDED"
    assert "code -9" in wire.page.trouble()


def test_it_asks_only_while_it_is_seen(qtbot: QtBot) -> None:
    asked: list[int] = []

    def pull() -> BusView | None:
        asked.append(1)
        return None

    page = BusPage(pull)
    qtbot.addWidget(page)
    qtbot.wait(600)
    assert not asked
    page.show()
    qtbot.waitUntil(lambda: len(asked) >= 3, timeout=HANG_MS)
    page.hide()
    seen = len(asked)
    qtbot.wait(600)
    assert len(asked) == seen


def test_the_trend_is_bounded_and_keeps_the_latest(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [1000.0]
    monkeypatch.setattr("ocmm_core.station._bus_watch.time.monotonic", lambda: now[0])
    for step in range(1500):
        now[0] += 0.25
        publish(wire.ring, msgspec.structs.replace(IN_ORDER, clock_phase_ns=step))
        wire.watch.report()
    trend = wire.watch.view("").trend
    # One sample in half a second, five minutes of them.
    assert len(trend) == 600
    assert trend[-1].phase_ns in (1498, 1499)
    assert trend[-1].time_s - trend[0].time_s == pytest.approx(299.5)
    assert trend[-1].offsets_ns == (0, -38)


def test_a_report_is_looked_at_ten_times_a_second_at_most(wire: Wire) -> None:
    publish(wire.ring, IN_ORDER)
    first = wire.watch.report()
    publish(wire.ring, MISSING)
    assert wire.watch.report() is first
    let_pass(_LOOK_S)
    assert wire.watch.report() == MISSING


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("report", [IN_ORDER, MISSING, FOUR], ids=["order", "missing", "four"])
def test_the_picture_of_the_wire_uses_the_colours_of_the_theme(
    report: BusReport, theme: str, qtbot: QtBot
) -> None:
    view = WireView()
    qtbot.addWidget(view)
    view.resize(630, 118)
    view.set_theme(THEMES[theme])
    view.show_report(report)
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    found = {
        image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())
    }
    assert THEMES[theme].good in found
    assert (THEMES[theme].bad in found) == (report is not IN_ORDER)


def test_histograms_of_nothing_and_of_everything_can_be_painted(wire: Wire) -> None:
    edges = IN_ORDER.lateness.edges_us
    for counts in ((0,) * 12, (0,) * 11 + (10**9,), (1,) * 12):
        shown = Histogram(edges_us=edges, counts=counts, worst_us=3e6)
        wire.show(msgspec.structs.replace(IN_ORDER, lateness=shown, round_trip=shown))
        assert not wire.page.grab().isNull()
    assert wire.page.lateness.word() == "worst 3000000"


@pytest.mark.parametrize("phase", BusPhase)
def test_every_phase_can_be_shown(phase: BusPhase, wire: Wire) -> None:
    wire.show(msgspec.structs.replace(MISSING, phase=phase, alarm="", message=""))
    assert wire.page.phase.text() == phase.value.upper()


def test_what_there_is_nothing_to_write_of_is_refused() -> None:
    with pytest.raises(InputError, match="do not come from a camera bus"):
        bus_text(None, "rig")
    ring = FrameRing.create(2, 16)
    try:
        with pytest.raises(InputError, match="No report"):
            bus_text(BusWatch(ring), "rig")
    finally:
        ring.close()


def test_a_saved_report_says_what_the_page_says(wire: Wire, tmp_path: Path) -> None:
    wire.show(MISSING)
    text = bus_text(wire.watch, "recommended")
    for part in (
        "recommended", "enp3s0", wire.page.wire.summary(),
        "Camera 'right' (serial 1002) is missing.",
        "Switch the camera on", "601015", "real-time priority",
    ):  # fmt: skip
        assert part in text
