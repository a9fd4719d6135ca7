"""Strips: guidance (next step, last refusal), status with machine counters, and the server."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QPushButton, QSizePolicy

from ocmm_core.inspection.evaluation import JobView, LiveView, ReferenceView
from ocmm_core.station import ServiceState
from ocmm_gui import kit
from ocmm_gui.kit import later, said, tr
from ocmm_gui.operator._view_parts import show_machine

_COUNTERS = (
    (later("Cameras"), later("cameras that see the probe / in the rig")),
    (later("Targets"), later("LEDs that two cameras see / on the probe")),
    (later("Reference"), later("LEDs of the reference body that two cameras see / on it")),
    (later("U point"), later("expanded uncertainty of a point here, {unit}, k = 2")),
    (later("Frames/s"), later("frames tracked per second")),
    (later("Good"), later("bus cycles on time")),
    (later("Late"), later("late bus cycles")),
    (later("Lost"), later("lost bus cycles")),
    (later("Bad"), later("rejected bus cycles")),
    (later("Overruns"), later("frames dropped because reconstruction was too slow")),
)

_NEEDED = 3
"""Minimum LEDs for a pose of the reference body."""


class StatusStrip(QFrame):
    """Word and reason on the left, counters on the right."""

    def __init__(self, n_cameras: int, n_leds: int) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self._n_cameras = n_cameras
        self._n_leds = n_leds
        self._live: LiveView | None = None
        self._job: JobView | None = None
        self.status = kit.FitText(tr("Status"), limit=34, reserve=tr("INACCURATE"))
        self.status.setFixedSize(250, 46)
        self._reason = kit.sentence_label(tr("Reason for the status"), 14, middle=True)
        self._values: dict[str, QLabel] = {}
        self._reference: tuple[QLabel, ...] = ()
        layout = kit.hbox(
            self.status, (self._reason, 1), parent=self, spacing=12, margins=(12, 4, 12, 4)
        )
        grid = QGridLayout()
        grid.setHorizontalSpacing(16)
        grid.setVerticalSpacing(0)
        for column, (name, tip) in enumerate(_COUNTERS):
            said = tr(tip).replace("{unit}", kit.unit_word())
            caption = kit.dressed(kit.PlainLabel(tr(name)), font=kit.text_font(12), role="muted")
            value = kit.value_label(tr(name), said)
            value.setFont(kit.digit_font(16))
            for row, label in enumerate((caption, value)):
                label.setAlignment(Qt.AlignmentFlag.AlignRight)
                grid.addWidget(label, row, column)
            self._values[name] = value
            if name == "Reference":
                self._reference = (caption, value)
        self._show_reference(None)
        layout.addLayout(grid)

    def show_live(self, live: LiveView) -> None:
        self._live = live
        show_machine(self.status, self._job, live)
        words = tuple(map(said, (live.reason, *live.faults, live.acquisition.pace_words)))
        reason = " ".join(filter(None, words))
        if self._reason.text() != reason:
            self._reason.setText(reason)
            self._reason.setToolTip(kit.literal(reason))
        self._show_reference(live.reference)
        counts = live.acquisition
        for name, value in (
            ("Cameras", f"{kit.seen_cameras(live)}/{self._n_cameras}"),
            ("Targets", f"{kit.seen_targets(live)}/{self._n_leds}"),
            ("U point", kit.millimetres(live.tip_uncertainty)),
            ("Frames/s", f"{live.frames_per_second:.0f}"),
            ("Good", _short(counts.good)),
            ("Late", _short(counts.late)),
            ("Lost", _short(counts.lost)),
            ("Bad", _short(counts.bad)),
            ("Overruns", _short(counts.overrun)),
        ):
            self._values[name].setText(value)

    def show_job(self, job: JobView) -> None:
        self._job = job
        if self._live is not None:
            self.show_live(self._live)

    def _show_reference(self, reference: ReferenceView | None) -> None:
        """Show the counter of the reference body, if used; red if lost."""
        for label in self._reference:
            label.setVisible(reference is not None)
        if reference is not None:
            value = self._values["Reference"]
            value.setText(f"{reference.seen}/{reference.n_leds}")
            kit.use_role(value, "bad" if reference.seen < _NEEDED else "")

    def counter(self, name: str) -> str:
        """Return the text under a caption."""
        return self._values[name].text()


def _short(count: int) -> str:
    # Six digits fit for any length of shift.
    return f"{count}" if count < 1_000_000 else kit.localised(f"{count / 1e6:.2f}M")


class Guidance(kit.Themed, QFrame):
    """Next step, plan text, distance to the next point, and trouble."""

    def __init__(self, pixels: int = 16) -> None:
        super().__init__()
        self._pixels = pixels
        self._job: JobView | None = None
        self._live: LiveView | None = None
        self.step = _sentence(tr("Next step"))
        self._words = _sentence(tr("Instruction of the plan"))
        self.mode = _sentence(tr("Probing order and probe side"))
        self._approach = _sentence(tr("Approach to the next point"))
        self.trouble = _sentence(tr("Blocking reason"))
        layout = kit.vbox(parent=self, spacing=3, margins=0)
        for widget in (self.step, self._words, self._approach, self.mode):
            layout.addWidget(widget)
        layout.addWidget(self.trouble, 1)
        self._paint()

    def show_job(self, job: JobView) -> None:
        self._job = job
        self._show_step()
        self._words.tell(kit.step_text(job))
        self.mode.setText(kit.mode_words(job))
        self._show_approach()
        self._show_trouble()

    def show_live(self, live: LiveView) -> None:
        self._live = live
        self._show_step()
        self._show_approach()
        self._show_trouble()

    def _show_step(self) -> None:
        text = "" if self._job is None else kit.next_step(self._job, self._live)
        if text != self.step.text():
            self.step.setText(text)

    def _show_approach(self) -> None:
        text = kit.approach_words(self._job, self._live)
        if text != self._approach.text():
            self._approach.setText(text)
        self._approach.setVisible(bool(text))

    def _show_trouble(self) -> None:
        # The reason of a failure is long and shown above, instead of the digits.
        live = None if kit.has_failed(self._live) else self._live
        text = "\n".join(kit.trouble(live, self._job))
        if text != self.trouble.text():
            self.trouble.setText(text)

    def _paint(self) -> None:
        size = f"font-size: {self._pixels}px;"
        small = f"font-size: {round(0.85 * self._pixels)}px;"
        self.step.setStyleSheet(f"{size} font-weight: bold; color: {self._theme.text};")
        self._words.setStyleSheet(f"{size} color: {self._theme.text};")
        self._approach.setStyleSheet(f"{size} color: {self._theme.accent};")
        self.mode.setStyleSheet(f"{small} color: {self._theme.muted};")
        self.trouble.setStyleSheet(f"{size} color: {self._theme.bad};")


def _sentence(name: str) -> kit.PlainLabel:
    label = kit.sentence_label(name, 14)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
    return label


_BUTTON_PX = 36
_WORDS = (
    ("done", later("Done"), later("Report the element as complete")),
    ("del", later("Delete last"), later("Delete your last point, here and in the program")),
    ("goto", later("Clearance"), later("Send the present position as a clearance point")),
    ("cancel", later("No touch"), later("Report that this point cannot be touched")),
)
"""Words of the operator, with the text and the tip of their buttons."""


class ServiceStrip(kit.Themed, QFrame):
    """Address and program, last sentence, last command with its answer, and the operator's words.

    Hidden while no server runs.
    """

    pressed = Signal(str)
    """Emits a word of the operator."""
    stop_wanted = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("service")
        self.setAccessibleName(tr("Server for measuring programs"))
        self.status = kit.sentence_label(tr("Address and program"), 16)
        self.lines = kit.dressed(
            kit.PlainLabel(), tr("Last command and answer"), font=kit.text_font(13)
        )
        self.lines.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.buttons = {word: _button(tr(text), tr(tip)) for word, text, tip in _WORDS}
        for word, button in self.buttons.items():
            button.clicked.connect(lambda _checked=False, word=word: self.pressed.emit(word))
        self.stop_button = _button(
            tr("Stop server"), tr("Disconnect the program and end the server")
        )
        self.stop_button.clicked.connect(self.stop_wanted)
        row = kit.hbox(
            (self.lines, 1), *self.buttons.values(), self.stop_button, spacing=8, margins=0
        )
        kit.vbox(self.status, row, parent=self, spacing=2, margins=(14, 4, 14, 4))
        self._paint()
        self.hide()

    def show_state(self, state: ServiceState | None) -> None:
        self.setVisible(state is not None)
        if state is None:
            return
        where = tr("{title} at {address}.").format(title=state.title, address=state.address)
        program = tr("No program is connected.")
        if state.client:
            program = tr("Program at {client}.").format(client=state.client)
        self.status.setText(f"{where} {program} {kit.said(state.sentence)}".strip())
        self.lines.setText(f"{state.command}   →   {state.answer}" if state.command else "")
        self.lines.setToolTip(kit.literal(self.lines.text()))
        for button in self.buttons.values():
            button.setEnabled(bool(state.client))

    def _paint(self) -> None:
        theme = self._theme
        self.setStyleSheet(
            f"#service {{ background: {theme.panel}; border-bottom: 3px solid {theme.accent}; }}"
            f" #service QLabel {{ color: {theme.text}; }}"
        )


def _button(text: str, tip: str) -> QPushButton:
    font = kit.text_font(15, bold=True)
    button = kit.dressed(kit.NarrowButton(text), tip, font=font, high=_BUTTON_PX)
    button.setToolTip(kit.literal(tip))
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button
