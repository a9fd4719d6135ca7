"""Start page: choices, recent jobs, and station status."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from ocmm_gui.kit import (
    ActionInfo,
    PlainLabel,
    day_words,
    key_words,
    later,
    literal,
    make_button,
    panel,
    said,
    said_word,
    sentence_label,
    text_font,
    time_words,
    tr,
)

if TYPE_CHECKING:
    from ocmm_core.composition import StateLine, StationState
    from ocmm_core.inspection.archive import LastJob

START_ACTIONS = (
    ActionInfo("new", later("New job"), later("Choose a plan and measure a part"), ("F2",)),
    ActionInfo("continue", later("Continue"), later("Go on with the selected job"), ("F7",)),
    ActionInfo("open", later("Open"), later("Look at a job, or measure by a plan file"), ("F3",)),
    ActionInfo("plans", later("Plans"), later("Create or edit a plan"), ("F4",)),
    ActionInfo(
        "calibrate", later("Calibrate"), later("Cameras, probe and tip: state and procedures"),
        ("M",),
    ),
    ActionInfo(
        "archive", later("Archive"),
        later("What was measured where, when, by whom and with what; trends over stations"),
        ("F8",),
    ),
    ActionInfo(
        "demo", later("Demo"),
        later("SIMULATED: a robot hand measures a virtual part; take over and try"), ("F9",),
    ),
    ActionInfo(
        "settings", later("Settings"),
        later("Cameras, probe, folders, temperatures, language, units, sounds, keys"),
        ("Ctrl+,",),
    ),
    ActionInfo(
        "manual", later("Manual"), later("Read about this page, and search the manual"), ("F1",),
    ),
    ActionInfo("theme", later("Theme"), later("Switch between dark, light and high contrast"),
               ("T",)),
    ActionInfo("quit", later("Quit"), later("Close OCMM"), ("Ctrl+Q",)),
)  # fmt: skip
_SMALL = ("archive", "manual", "theme", "quit")
_BUTTON_PX = 64
_ROW_PX = 60
_PATH = Qt.ItemDataRole.UserRole


class StartPage(QWidget):
    """Buttons at the left, the station and the last jobs at the right.

    `calls`: Commands of `START_ACTIONS`, by key; ``continue`` uses `chosen_job`.
    """

    job_chosen = Signal(object)
    """Emits the `Path` of a job activated in the list."""

    def __init__(self, calls: dict[str, Callable[[], None]]) -> None:
        super().__init__()
        self.setAccessibleName(tr("Start page"))
        self.keys: dict[str, QAction] = {}
        title = PlainLabel("OCMM")
        title.setFont(text_font(34, bold=True))
        self.hint = sentence_label(tr("What to do first"), 17)
        self.hint.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        buttons = QVBoxLayout()
        buttons.setSpacing(8)
        small = QHBoxLayout()
        small.setSpacing(4)
        for info in START_ACTIONS:
            button = self._button(info, calls[info.key])
            if info.key in _SMALL:
                small.addWidget(button)
            else:
                buttons.addWidget(button)
        buttons.addStretch(1)
        buttons.addLayout(small)
        self.state = QGridLayout()
        self.state.setHorizontalSpacing(14)
        self.state.setVerticalSpacing(4)
        self.state.setColumnStretch(1, 1)
        self.state_words: list[QLabel] = []
        self._tell_state(tr("Reading the records of cameras and tip"))
        self.hand_over = sentence_label(tr("Hand-over to the archive"), 15)
        self.hand_over.setProperty("role", "muted")
        self.hand_over.hide()
        self.heading = PlainLabel(tr("Last jobs"))
        self.heading.setFont(text_font(18, bold=True))
        self.jobs = QListWidget()
        self.jobs.setAccessibleName(tr("Last jobs"))
        self.jobs.setAccessibleDescription(tr("Up and down select a job; Return goes on with it"))
        self.jobs.setFont(text_font(17))
        self.jobs.itemActivated.connect(lambda item: self.job_chosen.emit(item.data(_PATH)))
        jobs = QVBoxLayout()
        jobs.addWidget(self.heading)
        jobs.addWidget(self.jobs, 1)
        right = QVBoxLayout()
        right.setSpacing(12)
        right.addWidget(panel(self.state))
        right.addWidget(self.hand_over)
        right.addWidget(panel(jobs), 1)
        head = QHBoxLayout()
        head.setSpacing(18)
        head.addWidget(title)
        head.addWidget(self.hint, 1)
        both = QHBoxLayout()
        both.setSpacing(18)
        both.addLayout(buttons, 2)
        both.addLayout(right, 5)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(22, 14, 22, 16)
        layout.setSpacing(12)
        layout.addLayout(head)
        layout.addLayout(both, 1)

    def chosen_job(self) -> Path | None:
        """Return the selected job, or None."""
        items = self.jobs.selectedItems()
        path: Path | None = items[0].data(_PATH) if items else None
        return path

    def show_state(self, state: StationState) -> None:
        """Show the status of cameras and tip."""
        self._clear_state()
        for row, line in enumerate(state.lines):
            what = PlainLabel(said_word(line.what))
            what.setFont(text_font(18, bold=True))
            word = _word(line, simulated=state.simulated)
            sentence = sentence_label(tr("About {what}").format(what=said_word(line.what)), 16)
            sentence.setText(_sentence(line))
            sentence.setToolTip(literal(sentence.text()))
            for column, label in enumerate((what, sentence, word)):
                self.state.addWidget(label, row, column)
            self.state_words += [what, sentence, word]
        usable = all(line.usable for line in state.lines)
        if state.simulated:
            self.hint.setText(
                tr("Cameras are SIMULATED. New here? Press Demo (F9) and touch a virtual part.")
            )
        elif usable:
            self.hint.setText(tr("Ready. New job begins with the plan; Continue goes on."))
        else:
            self.hint.setText(tr("No points can be taken yet: Calibrate shows what is missing."))

    def show_hand_over(self, line: str) -> None:
        """Show the core's note on pending archive uploads; empty if none."""
        self.hand_over.setText(said(line))
        self.hand_over.setVisible(bool(line))

    def show_jobs(self, jobs: tuple[LastJob, ...], folder: Path) -> None:
        """List jobs, newest first; unreadable ones are marked but selectable."""
        self.jobs.clear()
        for job in jobs:
            item = QListWidgetItem(job_words(job), self.jobs)
            item.setData(_PATH, job.path)
            item.setToolTip(literal(str(job.path)))
            item.setSizeHint(QSize(200, _ROW_PX))
        sound = [row for row, job in enumerate(jobs) if job.fault is None]
        if jobs:
            self.jobs.setCurrentRow(sound[0] if sound else 0)
        self.keys["continue"].setEnabled(bool(jobs))
        self.heading.setText(
            tr("Last jobs") if jobs else tr("No jobs in {folder} yet").format(folder=folder)
        )

    def _tell_state(self, text: str) -> None:
        self._clear_state()
        label = sentence_label(tr("Station"), 16)
        label.setText(text)
        self.state.addWidget(label, 0, 0, 1, 3)
        self.state_words = [label]

    def _clear_state(self) -> None:
        for label in self.state_words:
            self.state.removeWidget(label)
            label.deleteLater()
        self.state_words = []

    def _button(self, info: ActionInfo, call: Callable[[], None]) -> QPushButton:
        action = QAction(tr(info.text), self)
        action.setObjectName(info.key)
        action.setToolTip(literal(f"{tr(info.tip)} ({', '.join(map(key_words, info.shortcuts))})"))
        action.setShortcuts([QKeySequence(keys) for keys in info.shortcuts])
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.setAutoRepeat(False)
        action.triggered.connect(lambda _checked: call())
        self.addAction(action)
        self.keys[info.key] = action
        button = make_button(action, primary=info.key == "new")
        button.setObjectName(f"button_{info.key}")
        small = info.key in _SMALL
        button.setMinimumHeight(57 if small else _BUTTON_PX)
        button.setFont(text_font(15 if small else 20, bold=info.key == "new"))
        return button


def _word(line: StateLine, *, simulated: bool) -> QLabel:
    word = PlainLabel(tr("SIMULATED") if simulated else said_word(line.word))
    word.setFont(text_font(18, bold=True))
    good = line.usable and not line.soon and not simulated
    word.setProperty("role", "good" if good else "warn" if line.usable else "bad")
    word.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop)
    return word


def _sentence(line: StateLine) -> str:
    if not line.due_utc:
        return said(line.sentence)
    return tr("{sentence} Due on {date}.").format(
        sentence=said(line.sentence), date=day_words(line.due_utc)
    )


def job_words(job: LastJob) -> str:
    """Return the two lines of a job in the list."""
    when = time_words(datetime.fromtimestamp(job.changed_s).astimezone())
    if job.fault is not None:
        return tr("{name}: cannot be read, {when}\n{why}").format(
            name=job.path.name, when=when, why=said(job.fault.what)
        )
    if job.complete:
        state = tr("all features finished")
    elif job.points == 0:
        state = tr("no points yet")
    elif job.paused:
        state = tr(
            "paused, {done} of %n features", "paused, {done} of 1 feature", job.features
        ).format(done=job.finished)
    else:
        state = tr("{done} of %n features", "{done} of 1 feature", job.features).format(
            done=job.finished
        )
    return tr(
        "{part}, serial {serial}: {state}\n{when}, {operator}, {points}, {name}"
    ).format(
        part=job.part, serial=job.serial, state=state, when=when, operator=job.operator,
        points=tr("%n points", "1 point", job.points), name=job.path.name,
    )  # fmt: skip
