"""Start page: choices, recent jobs, and station status."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QGridLayout, QLabel, QPushButton, QWidget

from ocmm_gui import kit
from ocmm_gui.home._start_lists import JobCards
from ocmm_gui.kit import later, tr

if TYPE_CHECKING:
    from ocmm_core.composition import StateLine, StationState
    from ocmm_core.inspection.finished import LastJob

START_ACTIONS = (
    kit.ActionInfo("new", later("New job"), later("Choose a plan and measure a part"), ("F2",)),
    kit.ActionInfo("continue", later("Continue"), later("Go on with the selected job"), ("F7",)),
    kit.ActionInfo("open", later("Open"), later("Look at a job, or measure by a plan file"),
                   ("F3",)),
    kit.ActionInfo("plans", later("Plans"), later("Create or edit a plan"), ("F4",)),
    kit.ActionInfo(
        "calibrate", later("Calibrate"), later("Cameras, probe and tip: state and procedures"),
        ("M",),
    ),
    kit.ActionInfo(
        "cameras", later("Cameras"),
        later("GigE Vision cameras: live pictures, exposure, calibration by a board"), ("F6",),
    ),
    kit.ActionInfo(
        "archive", later("Archive"),
        later("What was measured where, when, by whom and with what; trends over stations"),
        ("F8",),
    ),
    kit.ActionInfo(
        "demo", later("Demo"),
        later("SIMULATED: a robot hand measures a virtual part; take over and try"), ("F9",),
    ),
    kit.ActionInfo(
        "settings", later("Settings"),
        later("Cameras, probe, folders, temperatures, language, units, sounds, keys"),
        ("Ctrl+,",),
    ),
    kit.ActionInfo(
        "manual", later("Manual"), later("Read about this page, and search the manual"), ("F1",),
    ),
    kit.ActionInfo("about", later("About"), later("Version, licences and folders of OCMM"),
                   ("F10",)),
    kit.ActionInfo("theme", later("Theme"), later("Switch between dark, light and high contrast"),
                   ("T",)),
    kit.ActionInfo("quit", later("Quit"), later("Close OCMM"), ("Ctrl+Q",)),
)  # fmt: skip
_SMALL = ("archive", "manual", "about", "theme", "quit")
_ROWS = (("calibrate", "cameras"), ("settings", "about"))
"""Buttons beside each other, the first one wider."""
_BUTTON_PX = 61


class StartPage(QWidget):
    """Buttons left, station and last jobs right; ``calls`` by key, ``continue`` as `chosen_job`."""

    job_chosen = Signal(object)
    """Emits the `Path` of a job activated in the list."""

    def __init__(self, calls: dict[str, Callable[[], None]]) -> None:
        super().__init__()
        self.setAccessibleName(tr("Start page"))
        self.keys: dict[str, QAction] = {}
        self._simulated = False
        title = kit.dressed(kit.PlainLabel("OCMM"), font=kit.text_font(34, bold=True))
        self.hint = kit.sentence_label(tr("What to do first"), 17, middle=True)
        buttons = kit.vbox(spacing=8)
        rows = {names: kit.hbox(spacing=8) for names in _ROWS}
        small = kit.hbox(spacing=4)
        for info in START_ACTIONS:
            button = self._button(info, calls[info.key])
            shared = next((names for names in _ROWS if info.key in names), None)
            if shared is not None:
                first = info.key == shared[0]
                rows[shared].addWidget(button, 1 if first else 0)
                if first:
                    buttons.addLayout(rows[shared])
            elif info.key in _SMALL:
                small.addWidget(button)
            else:
                buttons.addWidget(button)
        kit.fill(buttons, 1, small)
        self.state = QGridLayout()
        self.state.setHorizontalSpacing(14)
        self.state.setVerticalSpacing(4)
        self.state.setColumnStretch(1, 1)
        self.state_words: list[QLabel] = []
        self._tell_state(tr("Reading the records of cameras and tip"))
        self.hand_over = kit.sentence_label(tr("Hand-over to the archive"), 15, role="muted")
        self.hand_over.hide()
        heading = kit.PlainLabel(tr("Last jobs"))
        self.heading = kit.dressed(heading, font=kit.text_font(18, bold=True))
        self.jobs = JobCards()
        self.jobs.itemActivated.connect(lambda _item: self.job_chosen.emit(self.jobs.chosen()))
        self.first_steps = kit.sentence_label(
            tr("First steps"),
            17,
            tr(
                "1. Demo (F9): a robot hand measures a virtual part; take over and try.\n"
                "2. Settings (Ctrl+,): choose cameras, probe and folders of this station.\n"
                "3. Calibrate (M): cameras, then probe and tip, each with a guided procedure.\n"
                "4. New job (F2): choose a plan and measure the first part."
            ),
        )
        jobs = kit.vbox(self.heading, (self.jobs, 1), (self.first_steps, 1))
        right = kit.vbox(kit.panel(self.state), self.hand_over, (kit.panel(jobs), 1), spacing=12)
        head = kit.hbox(title, (self.hint, 1), spacing=18)
        both = kit.hbox((buttons, 2), (right, 5), spacing=18)
        kit.vbox(head, (both, 1), parent=self, spacing=12, margins=(22, 14, 22, 16))

    def chosen_job(self) -> Path | None:
        return self.jobs.chosen()

    def show_state(self, state: StationState) -> None:
        self._clear_state()
        for row, line in enumerate(state.lines):
            what = kit.PlainLabel(kit.said_word(line.what))
            kit.dressed(what, font=kit.text_font(18, bold=True))
            word = _word(line, simulated=state.simulated)
            about = tr("About {what}").format(what=kit.said_word(line.what))
            sentence = kit.sentence_label(about, 16, _sentence(line))
            sentence.setToolTip(kit.literal(sentence.text()))
            for column, label in enumerate((what, sentence, word)):
                self.state.addWidget(label, row, column)
            self.state_words += [what, sentence, word]
        self._simulated = state.simulated
        self._lead()
        usable = all(line.usable for line in state.lines)
        if state.simulated:
            self.hint.setText(
                tr(
                    "The measurements are SIMULATED. New here? Press Demo (F9) and touch a "
                    "virtual part."
                )
            )
        elif usable:
            self.hint.setText(tr("Ready. New job begins with the plan; Continue goes on."))
        else:
            self.hint.setText(tr("No points can be taken yet: Calibrate shows what is missing."))

    def show_hand_over(self, line: str) -> None:
        """Show the core's note on pending archive uploads; empty if none."""
        self.hand_over.tell(kit.said(line))

    def show_jobs(self, jobs: tuple[LastJob, ...], folder: Path) -> None:
        """List jobs, newest first; unreadable ones are marked but selectable."""
        self.jobs.show_jobs(jobs)
        self.jobs.setVisible(bool(jobs))
        self.first_steps.setVisible(not jobs)
        self._lead()
        self.keys["continue"].setEnabled(bool(jobs))
        self.heading.setText(
            tr("Last jobs") if jobs else tr("No jobs in {folder} yet").format(folder=folder)
        )

    def _lead(self) -> None:
        """Lead newcomers to the demo: simulated cameras, and no job yet."""
        is_new = self._simulated and not self.jobs.count()
        for key in ("new", "demo"):
            button = self.findChild(QPushButton, f"button_{key}")
            if button is not None:
                kit.use_role(button, "primary" if is_new is (key == "demo") else "plain")

    def _tell_state(self, text: str) -> None:
        self._clear_state()
        label = kit.sentence_label(tr("Station"), 16, text)
        self.state.addWidget(label, 0, 0, 1, 3)
        self.state_words = [label]

    def _clear_state(self) -> None:
        for label in self.state_words:
            self.state.removeWidget(label)
            label.deleteLater()
        self.state_words = []

    def _button(self, info: kit.ActionInfo, call: Callable[[], None]) -> QPushButton:
        action = kit.make_action(info, self)
        action.triggered.connect(lambda _checked: call())
        self.keys[info.key] = action
        button = kit.make_button(action, primary=info.key == "new")
        button.setObjectName(f"button_{info.key}")
        high, pixels = (57, 15) if info.key in _SMALL else (_BUTTON_PX, 20)
        return kit.dressed(button, font=kit.text_font(pixels, bold=info.key == "new"), high=high)


def _word(line: StateLine, *, simulated: bool) -> QLabel:
    word = kit.PlainLabel(tr("SIMULATED") if simulated else kit.said_word(line.word))
    word.setFont(kit.text_font(18, bold=True))
    good = line.usable and not line.soon and not simulated
    word.setProperty("role", "good" if good else "warn" if line.usable else "bad")
    word.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop)
    return word


def _sentence(line: StateLine) -> str:
    if not line.due_utc:
        return kit.said(line.sentence)
    return tr("{sentence} Due on {date}.").format(
        sentence=kit.said(line.sentence), date=kit.day_words(line.due_utc)
    )
