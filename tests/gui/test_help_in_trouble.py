"""The coach next to the readout, remedies, What to do if, and the page of the support bundle."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.coach import Hint, Turn, Way, help_when_lost, picture_of
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_core.measuring import Refusal, RefusalCode
from ocmm_core.station.coaching import NOTHING, CoachView
from ocmm_gui.help import answers
from ocmm_gui.help._what_to_do import told_by_code
from ocmm_gui.kit import DASHES
from ocmm_sim.scene import ScriptedOcclusion, WorldOptions
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

REFUSED = Refusal(RefusalCode.MOVING, "The probe moved by 0.12 mm.", "Hold still.", 0.0)


def test_the_coach_of_a_running_station_reaches_both_views(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    bench = open_window(speed=0.5)
    window = bench.window
    qtbot.waitUntil(lambda: window.desk.coach.message() != "", timeout=HANG_MS)
    assert window.far.coach.message() == window.desk.coach.message()
    assert bench.built.station.faults.beside == ()


def test_a_hidden_probe_is_lost_with_a_remedy_in_large_type(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    hidden = ScriptedOcclusion(1, (0, 1, 3, 4), 400, 10**9)
    bench = open_window(speed=0.5, world=WorldOptions(occlusions=(hidden,)))
    window = bench.window
    qtbot.waitUntil(
        lambda: window.desk.readout.trouble()[0] == "Clear the view of camera right",
        timeout=HANG_MS,
    )
    assert bench.built.station.looks.live().status is StatusWord.LOST
    assert window.desk.coach.is_trouble()
    assert "Camera left sees 6 LEDs." in window.desk.coach.accessibleDescription()
    assert "does not see LED" in window.desk.readout.trouble()[1]


def test_a_refusal_stands_for_a_while_and_goes_with_the_next_point(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    bench = open_window(speed=0.5)
    readout = bench.window.desk.readout
    qtbot.waitUntil(lambda: DASHES not in readout.values(), timeout=HANG_MS)
    assert readout.trouble() == ("", "")
    bench.bridge.point_refused.emit(REFUSED)
    assert readout.trouble() == ("Hold still.", "The probe moved by 0.12 mm.")
    # The digits are hidden, and still present in the readout.
    assert DASHES not in readout.values()
    qtbot.waitUntil(lambda: readout.trouble() == ("", ""), timeout=HANG_MS)


def test_a_hint_is_said_with_its_turns_and_both_numbers(open_window: OpenWindow) -> None:
    bench = open_window(start=False)
    instruments = bench.built.station.instruments
    seen = np.ones((2, 6), dtype=bool)
    hint = Hint((Turn(Way.TURN_LEFT, 15), Turn(Way.TILT_AWAY, 30)), 0.0312, 0.0178, 6)
    picture = picture_of(instruments.rig, instruments.body, None, seen, hint.turns[0])
    bench.bridge.coach_changed.emit(CoachView(None, hint, "", picture))
    words = "Turn 15° left, Tilt 30° away from you: U 31 → 18 µm"
    for view in (bench.window.desk, bench.window.far):
        assert view.coach.message() == words
        assert "as you face the cameras" in view.coach.toolTip()
    lost = help_when_lost(instruments.rig, instruments.body, None, None, seen & False)
    bench.bridge.coach_changed.emit(CoachView(remedy=lost.remedy, picture=lost.picture))
    assert bench.window.far.coach.is_trouble()
    bench.bridge.coach_changed.emit(NOTHING)
    assert not bench.window.far.coach.shows_probe()
    assert bench.window.desk.coach.message() == ""


@pytest.mark.parametrize("code", list(RefusalCode))
def test_every_refusal_has_an_answer_on_the_page(code: RefusalCode) -> None:
    found = answers(code.value)
    assert found, code
    assert any(code.value in one.codes.split(", ") for one in found), code


def test_symptoms_and_codes_are_found() -> None:
    assert answers("probe moved")[0].codes.startswith("moving")
    assert answers("BUS.open")
    assert not answers("zzzz nothing of the kind")
    codes = set(told_by_code())
    assert len(codes) > 500
    unknown = [code for code in sorted(codes) if not answers(code)]
    assert not unknown


def test_what_is_wrong_and_what_to_do_are_told_apart_by_the_sources() -> None:
    told = [one for said in told_by_code().values() for one in said]
    remedies = {one.sentence for one in told if one.is_remedy}
    others = {one.sentence for one in told if not one.is_remedy}
    # By its first word each would be taken for the other one.
    assert "Point {number} was not deleted, or is already restored." in others - remedies
    assert "Recalculate." in remedies - others


def test_the_support_page_shows_what_it_writes(
    open_window: OpenWindow, qtbot: QtBot, tmp_path: Path
) -> None:
    bench = open_window(speed=0.5)
    window = bench.window
    history = bench.built.station.history
    assert history is not None
    qtbot.waitUntil(lambda: history.seconds > 0.2, timeout=HANG_MS)
    window.actions_by_key["support"].trigger()
    page = window.sheets.support
    qtbot.waitUntil(page.is_ready, timeout=HANG_MS)
    names = [page.files.item(row).text().split("  ")[0] for row in range(page.files.count())]
    assert "recording/last_seconds.ocmr" in names
    assert "logs/window.log" in names or "logs/state.txt" in names
    page.parts["doctor"].setChecked(False)
    page.files.setCurrentRow(names.index("settings.txt"))
    shown = page.text.toPlainText()
    assert "instrument.rig" in shown
    page.keys["write"].trigger()
    assert not page.panel.isHidden()
    path = tmp_path / "support.zip"
    with qtbot.waitSignal(page.told, timeout=HANG_MS):
        page.panel.given.emit(path)
    with zipfile.ZipFile(path) as archive:
        assert archive.read("settings.txt").decode() == shown
        assert "doctor.json" not in archive.namelist()
        assert "Names of people were masked." in archive.read("CONTENTS.txt").decode()


def test_the_support_page_leads_to_the_page_about_the_program(open_window: OpenWindow) -> None:
    sheets = open_window(start=False).window.sheets
    sheets.show_sheet("support")
    sheets.support.keys["about"].trigger()
    assert sheets.about.isVisible()
    sheets.about.keys["leave"].trigger()
    assert sheets.support.isVisible()


def test_the_page_opens_with_what_was_refused(open_window: OpenWindow) -> None:
    window = open_window(start=False).window
    window.actions_by_key["what_to_do"].trigger()
    page = window.sheets.what_to_do
    assert page.table.rowCount() >= 20
    page.field.setText("lost")
    assert page.table.rowCount() > 0
    page.keys["support"].trigger()
    assert window.sheets.holds(window.centralWidget()) is False
