"""The Start page: possible actions, the last jobs, and the station in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QColor, QDragEnterEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.build import this_build
from ocmm_core.calibration.records import CalibrationStore, store_folder
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.finished import LastJob
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_core.tolerances.decisions import PartWord, RequirementCount
from ocmm_gui.home import SettingsPage, StartChoice, StartPurpose, StartWindow
from ocmm_gui.home._start_lists import JobCardData, JobCards, card_words
from ocmm_gui.kit import DEFAULT_THEME, THEMES, NoticeCentre, RecentPlaces, Theme, counted_line
from tests.core.calibration.made_records import make_record
from tests.generated_jobs import generated_job
from tests.host import HANG_MS

MakeStart = Callable[..., StartWindow]


@pytest.fixture
def make_start(qtbot: QtBot, tmp_path: Path) -> Iterator[MakeStart]:
    made: list[StartWindow] = []

    def make(source: str = "simulated", size: tuple[int, int] = (1280, 720)) -> StartWindow:
        store = SettingsStore(
            SettingsFile(tmp_path / "station" / "settings.toml"),
            SettingsFile(tmp_path / "user" / "settings.toml"),
            {
                "instrument.source": source,
                "job.folder": tmp_path / "jobs",
                "instrument.calibrations": tmp_path / "calibrations",
            },
        )
        window = StartWindow(store, NoticeCentre(), RecentPlaces(tmp_path / "recent.json"))
        qtbot.addWidget(window)
        window.resize(*size)
        with qtbot.waitActive(window):
            window.show()
            window.activateWindow()
        window.read()
        qtbot.waitUntil(lambda: "Reading" not in window.page.hint.text(), timeout=HANG_MS)
        made.append(window)
        return window

    yield make
    for window in made:
        window.close()


def _words(window: StartWindow) -> str:
    return " ".join(label.text() for label in window.page.state_words)


def test_recent_places_are_bounded_and_never_in_the_way(tmp_path: Path) -> None:
    recent = RecentPlaces(tmp_path / "state" / "recent.json")
    assert recent.plans() == ()
    plans = [tmp_path / f"plan{number}.toml" for number in range(30)]
    for plan in plans:
        plan.write_text("")
        recent.note_plan(plan)
    recent.note_plan(plans[20])
    recent.note_plan(resource("plans", "demo.toml"))
    assert recent.plans()[:2] == (plans[20], plans[29])
    assert len(recent.plans()) == 20
    assert recent.folders() == (tmp_path,)
    plans[20].unlink()
    assert recent.plans()[0] == plans[29]
    (tmp_path / "state" / "recent.json").write_bytes(b'{"schema": "ocmm.recent/1", "plans": 3}')
    assert recent.plans() == ()
    recent.note_job(tmp_path / "a.ocmm")
    assert recent.jobs() == ()


def test_a_newcomer_is_told_that_cameras_are_simulated(make_start: MakeStart, qtbot: QtBot) -> None:
    window = make_start()
    qtbot.waitUntil(lambda: "SIMULATED" in window.page.hint.text(), timeout=HANG_MS)
    assert "Camera rig recommended." in _words(window)
    assert not window.page.keys["continue"].isEnabled()
    assert "No jobs" in window.page.heading.text()


def test_cameras_that_were_never_calibrated_say_what_to_do(
    make_start: MakeStart, qtbot: QtBot, tmp_path: Path
) -> None:
    window = make_start("ethercat:lo")
    qtbot.waitUntil(lambda: "Calibrate" in _words(window), timeout=HANG_MS)
    assert "NONE" in _words(window)
    assert "No points can be taken yet" in window.page.hint.text()
    # Another program may correct it, or make it suspect, while the page is open.
    now = datetime.now(UTC)
    record = make_record(
        made_utc=(now - timedelta(hours=1)).isoformat(),
        valid_until_utc=(now + timedelta(days=365)).isoformat(),
    )
    store = CalibrationStore(store_folder(tmp_path / "calibrations", "recommended"))
    store.accept(record, "technician", "new", now)
    window.read_state()
    qtbot.waitUntil(lambda: window.page.state_words[2].text() != "NONE", timeout=HANG_MS)


def test_the_last_jobs_are_listed_and_a_damaged_one_is_named(
    make_start: MakeStart, qtbot: QtBot, tmp_path: Path
) -> None:
    built = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"), out=tmp_path / "jobs", operator="anna",
            serial="SN-7", frame_rate_hz=800,
        )
    )  # fmt: skip
    built.station.close()
    (tmp_path / "jobs" / "BROKEN-001.ocmm").write_bytes(b"no job")
    window = make_start()
    qtbot.waitUntil(lambda: window.page.jobs.count() == 2, timeout=HANG_MS)
    texts = [window.page.jobs.item(row).text() for row in range(2)]
    sound = next(text for text in texts if "SN-7" in text)
    assert "no points yet" in sound
    assert "anna" in sound
    assert any("BROKEN-001.ocmm: cannot be read" in text for text in texts)
    assert window.page.chosen_job() == built.job_path.absolute()
    window.page.keys["continue"].trigger()
    assert window.choice == StartChoice(StartPurpose.CONTINUE, built.job_path.absolute())


@pytest.mark.usefixtures("qapp")
def test_no_card_is_greener_than_its_job() -> None:
    """N = 100 generated jobs; a verdict that is not computed yet is not named."""
    for seed in range(100):
        view = generated_job(seed)[0]
        listed = LastJob(
            Path("A.ocmm"), "P", "S", "anna", 9, len(view.features), len(view.features),
            simulated=view.simulated,
        )  # fmt: skip
        before, after = card_words(listed), card_words(listed, JobCardData(listed.path, view))
        assert "CONFORM" not in before, seed
        assert counted_line(view) in after, seed
        for text in (before, after):
            assert ("SIMULATED" in text) == view.simulated, seed
            # Local time with its zone.
            assert str(datetime.fromtimestamp(0).astimezone().tzname()) in text


def test_a_card_without_any_requirement_of_the_model_is_not_green(qtbot: QtBot) -> None:
    """A part that conforms by a plan with 0 of 52 requirements is no good part."""
    views = [generated_job(seed)[0] for seed in range(100)]
    view = next(one for one in views if one.part_verdict.word is PartWord.CONFORMS)
    listed = LastJob(
        Path("A.ocmm"), "P", "S", "anna", 9, len(view.features), len(view.features),
        simulated=view.simulated,
    )  # fmt: skip
    cards = JobCards()
    qtbot.addWidget(cards)
    cards.show_jobs((listed,))
    colours = []
    for count in (None, RequirementCount(0, 52, 0, "model")):
        cards.show_verdict(JobCardData(listed.path, replace(view, requirements=count)))
        colours.append(cards.item(0).foreground().color().name())
    theme = THEMES[DEFAULT_THEME]
    assert colours == [QColor(one).name() for one in (theme.good, theme.warn)]


def test_a_newcomer_is_led_to_the_demo_and_no_panel_is_empty(
    make_start: MakeStart, qtbot: QtBot
) -> None:
    window = make_start()
    demo, new = (window.page.findChild(QPushButton, f"button_{key}") for key in ("demo", "new"))
    assert demo is not None
    assert new is not None
    qtbot.waitUntil(lambda: demo.property("role") == "primary", timeout=HANG_MS)
    assert new.property("role") == "plain"
    assert window.page.first_steps.isVisible()
    window.page.show_jobs((LastJob(Path("A.ocmm"), "P", "S", "anna"),), Path())
    assert new.property("role") == "primary"
    assert not window.page.first_steps.isVisible()


@pytest.mark.parametrize(
    ("key", "errand"),
    [
        ("plans", StartPurpose.PLANS), ("calibrate", StartPurpose.CALIBRATE),
        ("demo", StartPurpose.DEMO),
    ],
)  # fmt: skip
def test_a_key_does_its_errand(make_start: MakeStart, key: str, errand: StartPurpose) -> None:
    window = make_start()
    window.page.keys[key].trigger()
    assert window.choice == StartChoice(errand)
    assert not window.isVisible()


def test_a_new_job_begins_with_a_plan(make_start: MakeStart, qtbot: QtBot, tmp_path: Path) -> None:
    own = tmp_path / "mine.toml"
    own.write_bytes(resource("plans", "quick.toml").read_bytes())
    RecentPlaces(tmp_path / "recent.json").note_plan(own)
    window = make_start()
    QTest.keyClick(window.page, Qt.Key.Key_F2)
    qtbot.waitUntil(lambda: window.plans.list.count() > 1, timeout=HANG_MS)
    # The last used plan is first, and Return selects it.
    QTest.keyClick(window.plans.list, Qt.Key.Key_Return)
    assert window.choice == StartChoice(StartPurpose.NEW, own.absolute())


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_every_button_is_whole_and_15_mm_high(
    make_start: MakeStart, theme: str, size: tuple[int, int]
) -> None:
    window = make_start(size=size)
    window.settings.change("window.theme", theme)
    # Borders of another theme are laid out by the next events.
    QApplication.processEvents()
    for button in window.page.findChildren(QPushButton):
        assert button.height() >= 57
        assert button.width() >= button.sizeHint().width(), button.text()
        assert button.accessibleName()


def test_settings_are_made_when_somebody_looks_at_them(make_start: MakeStart) -> None:
    window = make_start()

    def next_theme() -> str:
        before = window.loaded.settings.window_theme
        window.page.keys["theme"].trigger()
        after = window.loaded.settings.window_theme
        assert after != before
        return after

    theme = next_theme()
    assert window.findChildren(SettingsPage) == []
    window.page.keys["settings"].trigger()
    page = window.settings
    assert window.findChildren(SettingsPage) == [page]
    assert page.isVisible()
    worn = {
        one.name
        for widget in page.findChildren(QWidget)
        for one in [vars(widget).get("_theme")]
        if isinstance(one, Theme)
    }
    assert worn == {theme}
    # A change by a key appears there as well.
    page.left.emit()
    assert window.page.isVisible()
    assert page.loaded.settings.window_theme == theme != next_theme()
    assert page.loaded.settings.window_theme == window.loaded.settings.window_theme


def test_a_dropped_plan_or_job_is_opened_and_nothing_else(
    make_start: MakeStart, tmp_path: Path
) -> None:
    for name, errand in (
        ("a.toml", StartPurpose.NEW),
        ("a.ocmm", StartPurpose.LOOK),
        ("a.txt", None),
    ):
        window = make_start()
        dragged = QMimeData()
        dragged.setUrls([QUrl.fromLocalFile(str(tmp_path / name))])
        buttons, keys = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
        enter = QDragEnterEvent(
            QPointF(9, 9).toPoint(), Qt.DropAction.CopyAction, dragged, buttons, keys
        )
        window.dragEnterEvent(enter)
        window.dropEvent(
            QDropEvent(QPointF(9, 9), Qt.DropAction.CopyAction, dragged, buttons, keys)
        )
        assert window.choice == (None if errand is None else StartChoice(errand, tmp_path / name))


def test_the_browser_lists_folders_beside_the_work_and_gives_a_file(
    make_start: MakeStart, qtbot: QtBot, tmp_path: Path
) -> None:
    (tmp_path / "jobs" / "deep").mkdir(parents=True)
    (tmp_path / "jobs" / "a.ocmm").write_bytes(b"")
    (tmp_path / "jobs" / "a.txt").write_bytes(b"")
    window = make_start()
    window.page.keys["open"].trigger()
    files = window.browser.files
    qtbot.waitUntil(lambda: files.count() == 3, timeout=HANG_MS)
    assert [files.item(row).text() for row in range(3)] == ["↑ Folder above", "deep/", "a.ocmm"]
    window.browser.path.setText(str(tmp_path / "none.ocmm"))
    QTest.keyClick(window.browser.path, Qt.Key.Key_Return)
    assert "not there" in window.browser.told.text()
    files.itemActivated.emit(files.item(2))
    assert window.choice == StartChoice(StartPurpose.LOOK, tmp_path / "jobs" / "a.ocmm")


def test_the_page_about_the_program_copies_build_and_folders(
    make_start: MakeStart, tmp_path: Path
) -> None:
    window = make_start()
    window.page.keys["about"].trigger()
    assert window.about.isVisible()
    assert "MIT License" in window.about.text.toPlainText()
    window.about.keys["third_party"].trigger()
    assert "| numpy |" in window.about.text.toPlainText()
    window.about.keys["changes"].trigger()
    assert "## [" in window.about.text.toPlainText()
    window.about.keys["copy"].trigger()
    build = this_build()
    copied = QApplication.clipboard().text().splitlines()
    for line in (
        f"Version: {build.version}", f"Commit: {build.commit}", f"Jobs: {tmp_path / 'jobs'}",
        f"Your settings: {tmp_path / 'user' / 'settings.toml'}",
    ):  # fmt: skip
        assert line in copied
    window.about.keys["leave"].trigger()
    assert window.page.isVisible()
