"""One picture-guided job of twelve features, done by keyboard alone in the real window.

The operator of the virtual rig probes; everything else is keys: the header of the job, pause, flip,
undo, a point that is deleted with a reason and put back, a feature that is skipped and measured
later, alignment, results, and the report.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import msgspec
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan, save_plan
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import DEBOUNCE_S, Level, Notice, NoticeCentre, counted_line
from ocmm_gui.window import MainWindow
from tests.host import HANG_MS, long_form
from tests.waiting import let_pass

# Half a minute on two cores that have nothing else to do.
pytestmark = pytest.mark.slow

KEY = Qt.Key
PATIENCE_MS = HANG_MS
AGAIN_MS = 5_000
MOST_ESCAPES = 2 + 20
"""A trigger key that comes sooner after itself is a bouncing contact."""


class Keyboard:
    """A window that is reached by its keys only."""

    def __init__(
        self, qtbot: QtBot, bridge: StationBridge, window: MainWindow, notices: NoticeCentre
    ) -> None:
        self.qtbot, self.bridge, self.window = qtbot, bridge, window
        self.errors: list[Notice] = []
        notices.posted.connect(self._keep)

    def _keep(self, notice: Notice) -> None:
        if notice.level is Level.ERROR:
            self.errors.append(notice)

    def press(self, *keys: Qt.Key) -> None:
        """Press keys at the widget with the focus."""
        for key in keys:
            widget = QApplication.focusWidget() or self.window
            QTest.keyClick(widget, key)

    def write(self, text: str) -> None:
        """Replace the text of the field with the focus."""
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, KEY.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClicks(widget, text)

    def look_at(self, feature: str, key: Qt.Key) -> None:
        """Press a key until the view shows a feature, or it is being probed."""

        def seen() -> str:
            job = self.bridge.shown.job
            return job.looked_at or job.active

        while (before := seen()) != feature:
            self.press(key)
            # A touch refused meanwhile turns the view back to the next target before it was seen
            # elsewhere: then the key is pressed again.
            with contextlib.suppress(self.qtbot.TimeoutError):
                self.qtbot.waitUntil(partial(_differs, seen, before), timeout=AGAIN_MS)

    def until(self, state: Callable[[JobView], bool]) -> JobView:
        """Wait until the job is in a state, and return it."""
        self.qtbot.waitUntil(lambda: state(self.bridge.shown.job), timeout=PATIENCE_MS)
        return self.bridge.shown.job


def _differs(seen: Callable[[], str], before: str) -> bool:
    return seen() != before


@pytest.fixture
def keyboard(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[Keyboard]:
    """Return the keyboard of a window on the job of twelve features; nothing runs yet."""
    qapp.setStyle("Fusion")
    plan = tmp_path / "gauge.toml"
    shipped = load_plan(resource("plans", "gauge.toml"))
    features = [
        # One point more than the shape needs is enough for keys; half of them in the long form.
        msgspec.structs.replace(
            feature,
            picture="step.png",
            points=max(MINIMUM_POINTS[feature.shape] + 1, long_form() * feature.points // 2),
        )
        for feature in shipped.features
    ]
    save_plan(msgspec.structs.replace(shipped, features=features), plan)
    picture = QImage(320, 200, QImage.Format.Format_RGB32)
    picture.fill(Qt.GlobalColor.darkCyan)
    assert picture.save(str(tmp_path / "step.png"))
    built = build_station(
        StationRequest(
            plan=plan,
            part=resource("parts", "gauge.toml"),
            out=tmp_path / "job",
            stay=True,
            frame_rate_hz=500 if long_form() else 250,
        )
    )
    notices = NoticeCentre()
    bridge = StationBridge(built.station)
    window = MainWindow(bridge, notices, out=tmp_path / "report")
    window.resize(1280, 720)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    yield Keyboard(qtbot, bridge, window, notices)
    window.close()
    for item in (window, bridge, notices):
        item.deleteLater()


def _last_touched(job: JobView) -> FeatureView:
    return max(job.features, key=lambda item: max((p.number for p in item.points), default=0))


@pytest.mark.usefixtures("kept_sides")
def test_a_job_of_twelve_features_by_keyboard_alone(
    keyboard: Keyboard, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    begun = time.monotonic()
    window, bridge = keyboard.window, keyboard.bridge
    keyboard.press(KEY.Key_J)
    keyboard.write("Ada Lovelace")
    keyboard.press(KEY.Key_Return)
    for words in ("G-0007", "order 12", "first"):
        keyboard.write(words)
        keyboard.press(KEY.Key_Return)
    bridge.start()
    job = keyboard.until(lambda job: job.header.serial == "G-0007")
    assert (job.header.operator, job.header.batch) == ("Ada Lovelace", "first")
    assert len(job.features) == 12

    # Pause, so that the next steps concern a fixed point.
    keyboard.until(lambda job: len(job.feature("PLATE_TOP").points) >= 4)
    assert window.desk.picture.has_picture()
    keyboard.press(KEY.Key_Z)
    job = keyboard.until(lambda job: job.paused)
    feature = _last_touched(job)
    last = feature.points[-1]
    keyboard.press(KEY.Key_X)
    job = keyboard.until(lambda job: job.feature(feature.name).points[-1].approach == "flipped")
    keyboard.press(KEY.Key_Backspace)
    job = keyboard.until(lambda job: job.feature(feature.name).points[-1].approach != "flipped")
    assert (job.feature(feature.name).points[-1].direction == last.direction).all()

    keyboard.press(KEY.Key_Period)
    chosen = window.choice.chosen
    assert chosen in {point.number for point in job.feature(feature.name).points}
    keyboard.press(KEY.Key_Delete)
    keyboard.write("a burr")
    keyboard.press(KEY.Key_Return)
    job = keyboard.until(lambda job: len(job.feature(feature.name).deleted) == 1)
    assert job.feature(feature.name).deleted[0].reason == "a burr"
    keyboard.press(KEY.Key_Insert)
    keyboard.until(lambda job: not job.feature(feature.name).deleted)

    # A feature is left out; later it is chosen with the keys and measured.
    keyboard.look_at("RING", KEY.Key_PageDown)
    keyboard.press(KEY.Key_S)
    job = keyboard.until(lambda job: job.feature("RING").state is FeatureState.SKIPPED)
    keyboard.press(KEY.Key_V, KEY.Key_T)
    assert window.is_far()
    keyboard.press(KEY.Key_Z)
    job = keyboard.until(lambda job: job.complete)
    keyboard.press(KEY.Key_V)
    if job.feature("RING").skipped:
        # Script touches of a skipped feature count; if one came during the pause, the feature is
        # reopened.
        keyboard.look_at("RING", KEY.Key_PageUp)
        keyboard.press(KEY.Key_F6)
        keyboard.until(lambda job: job.active == "RING")
        job = keyboard.until(lambda job: job.complete)
    odd = [
        (item.name, item.state, item.note, item.taken)
        for item in job.features
        if item.state is not FeatureState.DONE or item.fit is None
    ]
    assert not odd

    # Undo removes the last point; Return accepts the feature with the remaining ones.
    keyboard.press(KEY.Key_Z)
    job = keyboard.until(lambda job: job.paused)
    name = _last_touched(job).name
    count = len(job.feature(name).points)
    let_pass(DEBOUNCE_S)
    keyboard.press(KEY.Key_Backspace)
    keyboard.until(lambda job: len(job.feature(name).points) == count - 1)
    keyboard.press(KEY.Key_Return)
    job = keyboard.until(lambda job: job.complete)

    keyboard.press(KEY.Key_F5)
    alignment = window.sheets.alignment
    keyboard.qtbot.waitUntil(
        lambda: bool(alignment.state.text() or keyboard.errors), timeout=PATIENCE_MS
    )
    assert (alignment.state.text(), keyboard.errors) == ("Fully constrained", [])
    keyboard.press(KEY.Key_F8)
    keyboard.press(KEY.Key_F3, KEY.Key_Down)
    results = window.sheets.results
    assert results.summary.text() == counted_line(job)
    # A feature accepted with one point less may have no form, and characteristics with it as a
    # datum may have no value; the last touched feature depends on the moment of the pause. Nothing
    # else is missing.
    plan = bridge.station.job.plan
    below = {item.name: plan.rests_on(item) for item in plan.characteristics}
    lacking = [r for r in job.characteristics if r.verdict is Verdict.NOT_MEASURED]
    assert [(r.name, r.note) for r in lacking if name not in below[r.name]] == []
    # The row that decides is chosen first; Down goes to the one below it.
    names = [item.name for item in job.characteristics]
    next_row = names.index(job.part_verdict.summary.deciding) + 1
    assert results.table.chosen() == names[min(next_row, len(names) - 1)]
    keyboard.press(KEY.Key_F8)
    with keyboard.qtbot.waitSignal(window.output.exported, timeout=PATIENCE_MS) as written:
        keyboard.press(KEY.Key_F8)
        if not job.part_verdict.complete:
            keyboard.press(KEY.Key_Return)
    paths: tuple[Path, ...] = written.args[0]
    assert len(paths) >= 4
    assert all(path.is_file() and path.parent == tmp_path / "report" for path in paths)
    # Esc puts away warnings before it leaves a page; two pages, and how many warn is chance.
    for _ in range(MOST_ESCAPES):
        if not window.desk.isVisible():
            keyboard.press(KEY.Key_Escape)
    assert window.desk.isVisible()
    assert keyboard.errors == []

    path = bridge.station.job.path
    window.close()
    again = reopen_job(path)
    assert again.doubts == ()
    assert (again.head.operator, again.head.serial) == ("Ada Lovelace", "G-0007")
    assert {"alignment", "paused", "skipped"} <= {event.kind for event in again.events}
    assert [item.verdict for item in again.view.characteristics] == [
        item.verdict for item in job.characteristics
    ]
    record_property("seconds", f"{time.monotonic() - begun:.1f}")
