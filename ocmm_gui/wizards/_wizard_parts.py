"""Parts of a wizard: start page, rail of its steps, keys, and the question whether to accept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QAction, QColor, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QSizePolicy,
    QWidget,
)

from ocmm_core.calibration.guided import Step
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards._site import UnfinishedSession
from ocmm_gui.wizards.pages import Field, practice_title

_SESSION_PX = 58


class WizardStart(kit.Themed, QWidget):
    """Fields of a new session on the left, unfinished sessions on the right."""

    begun = Signal(object)
    """Emits the fields, ``dict[str, str]``."""
    resumed = Signal(object)
    """Emits the `Path` of the session to resume."""
    left = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._offers: tuple[UnfinishedSession, ...] = ()
        self._title = kit.dressed(kit.PlainLabel(), tr("Wizard"), font=kit.text_font(28, bold=True))
        self._purpose = kit.sentence_label(tr("Purpose"), 18)
        self.trouble = kit.sentence_label(tr("Why it cannot start"), 17, role="bad")
        self.fields: dict[str, QLineEdit | kit.ChoiceBox] = {}
        self._form = QGridLayout()
        self._form.setVerticalSpacing(5)
        self._form.setHorizontalSpacing(14)
        self.begin_button = kit.large_button(tr("Start  [Return]"), tr("Start a new session"))
        self.resume_button = kit.large_button(
            tr("Resume  [G]"), tr("Resume the selected session"), "G"
        )
        self.leave_button = kit.large_button(tr("Leave  [Esc]"), tr("Leave the wizard"), "Esc")
        self.begin_button.clicked.connect(self._start)
        self.resume_button.clicked.connect(self._resume)
        self.leave_button.clicked.connect(self.left)
        self.list = kit.dressed(QListWidget(), tr("Unfinished sessions"), font=kit.text_font(16))
        self.list.setWordWrap(True)
        self.list.currentRowChanged.connect(self._show_choice)
        self.list.itemActivated.connect(self._resume)
        self._note = kit.sentence_label(tr("Details of the selected session"), 15)
        layout = kit.vbox(
            self._title, self._purpose, parent=self, spacing=12, margins=(18, 12, 18, 12)
        )
        middle = kit.hbox((self._new_session(), 1), (self._unfinished(), 1), spacing=12)
        kit.fill(layout, (middle, 1), self.trouble)
        row = kit.hbox(self.leave_button)
        row.addStretch(1)
        layout.addLayout(row)

    def ask(
        self, title: str, purpose: str, fields: Sequence[Field],
        offers: Sequence[UnfinishedSession], *, practice: bool = False,
    ) -> None:  # fmt: skip
        """Show fields and unfinished sessions, which are proposed first."""
        self._title.setText(practice_title(tr(title)) if practice else tr(title))
        self._purpose.setText(tr(purpose))
        self.show_trouble("")
        self._fill_form(fields)
        self._offers = tuple(offers)
        self.list.clear()
        for offer in offers:
            item = QListWidgetItem(f"{'▲ ' if offer.blocker else ''}{offer.title}", self.list)
            item.setSizeHint(QSize(100, _SESSION_PX))
        self._offered.setVisible(bool(offers))
        if offers:
            self.list.setCurrentRow(0)
            self.list.setFocus()
        else:
            lines = [field for field in self.fields.values() if isinstance(field, QLineEdit)]
            empty = (field for field in lines if not field.text())
            next(empty, lines[0] if lines else self.leave_button).setFocus()
        self._show_choice()

    def show_trouble(self, text: str) -> None:
        """Show why a session could not be started or resumed; empty text hides it."""
        self.trouble.tell(text)

    def _fill_form(self, fields: Sequence[Field]) -> None:
        while (item := self._form.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self.fields = {}
        for one in fields:
            label = kit.dressed(kit.PlainLabel(tr(one.label)), font=kit.text_font(15), role="muted")
            field = self._choice(one) if one.choices else self._line(one)
            name, tip, font = tr(one.label), tr(one.tip), kit.text_font(16)
            kit.dressed(field, name, tip, font=font, high=36, key=one.key)
            label.setBuddy(field)
            row = len(self.fields)
            self._form.addWidget(label, row, 0)
            self._form.addWidget(field, row, 1)
            # Only visible widgets can have the focus.
            label.show()
            field.show()
            self.fields[one.key] = field

    def _line(self, one: Field) -> QLineEdit:
        field = kit.HintField(one.proposal)
        field.setPlaceholderText(tr(one.tip))
        field.returnPressed.connect(self._start)
        field.textEdited.connect(lambda _text: self.show_trouble(""))
        return field

    def _choice(self, one: Field) -> kit.ChoiceBox:
        words = dict(one.choices)
        field = kit.ChoiceBox(
            tr(one.label), tr(one.tip), tuple(words), lambda value: tr(words[value])
        )
        field.set_theme(self._theme)
        return field

    def _new_session(self) -> QWidget:
        column = kit.vbox(_heading(tr("New session")), self._form, spacing=8)
        column.addStretch(1)
        column.addWidget(self.begin_button)
        return kit.panel(column)

    def _unfinished(self) -> QWidget:
        column = kit.vbox(
            _heading(tr("Not finished")), (self.list, 1), self._note, self.resume_button, spacing=8
        )
        self._offered = kit.panel(column)
        return self._offered

    def _show_choice(self, _row: int = 0) -> None:
        offer = self._offer()
        self.resume_button.setEnabled(offer is not None and not offer.blocker)
        self._note.setText(
            "" if offer is None else kit.said(offer.blocker) or tr("Nothing was lost.")
        )
        new = offer is None or bool(offer.blocker)
        kit.use_role(self._note, "warn" if new else "muted")
        for button, primary in ((self.begin_button, new), (self.resume_button, not new)):
            kit.use_role(button, "primary" if primary else "plain")

    def _offer(self) -> UnfinishedSession | None:
        row = self.list.currentRow()
        return self._offers[row] if 0 <= row < len(self._offers) else None

    def values(self) -> dict[str, str]:
        return {
            key: field.text() if isinstance(field, QLineEdit) else field.choice()
            for key, field in self.fields.items()
        }

    def _start(self) -> None:
        self.begun.emit(self.values())

    def _resume(self) -> None:
        offer = self._offer()
        if offer is not None and not offer.blocker:
            self.resumed.emit(offer.path)


def _heading(text: str) -> QLabel:
    label = kit.dressed(kit.PlainLabel(text), font=kit.text_font(18, bold=True))
    label.setAlignment(Qt.AlignmentFlag.AlignLeft)
    return label


_WELCOME, _NEEDED = later("Reason, for the history"), later("A reason is required")


class DecisionBar(QFrame):
    """One line: question, reason, Yes, No; non-modal."""

    decided = Signal(bool, str)

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Decision"))
        self._accepts = False
        self._needs_reason = False
        self._question = kit.dressed(
            kit.PlainLabel(), tr("Decision"), font=kit.text_font(17, bold=True)
        )
        font = kit.text_font(16)
        self._reason = kit.dressed(kit.OwnKeysField(), tr("Reason"), font=font, key="reason")
        self._yes = kit.dressed(kit.NarrowButton(tr("Yes  [Return]")), tr("Yes"), role="primary")
        self._no = kit.dressed(kit.NarrowButton(tr("No  [Esc]")), tr("No"))
        layout = kit.hbox(
            self._question, (self._reason, 1), parent=self, spacing=10, margins=(14, 8, 10, 8)
        )
        for button in (self._yes, self._no):
            button.setFont(kit.text_font(16, bold=True))
            button.setMinimumHeight(46)
            layout.addWidget(button)
        self._yes.clicked.connect(self._confirm)
        self._no.clicked.connect(self.hide)
        self._reason.returnPressed.connect(self._confirm)
        self._reason.left.connect(self.hide)
        self.hide()

    def ask(self, question: str, reason: str, *, accepts: bool, needs_reason: bool = False) -> None:
        """Ask, with a proposed reason; if one is required, Yes is disabled until then."""
        self._accepts, self._needs_reason = accepts, needs_reason
        self._reason.setPlaceholderText(tr(_NEEDED if needs_reason else _WELCOME))
        self._question.setText(question)
        self._reason.setText(reason)
        self.show()
        self._reason.setFocus()
        self._reason.selectAll()

    def question(self) -> str:
        return self._question.text()

    def _confirm(self) -> None:
        if self._needs_reason and not self._reason.text().strip():
            self._reason.setFocus()
            return
        self.hide()
        self.decided.emit(self._accepts, self._reason.text().strip())


_PLOTS = (
    (later("Plot 1"), later("Show plot 1")),
    (later("Plot 2"), later("Show plot 2")),
    (later("Plot 3"), later("Show plot 3")),
    (later("Plot 4"), later("Show plot 4")),
)
WIZARD_ACTIONS = (
    kit.ActionInfo("take", later("Take"), later("Take an observation now"), kit.TAKE_KEYS, True),
    kit.ActionInfo(
        "drop", later("Undo"), later("Undo the last observation of this step"), kit.UNDO_KEYS, True
    ),
    kit.ActionInfo("next", later("Next"), later("Go to the next step"), kit.FINISH_KEYS, True),
    kit.ActionInfo(
        "back", later("Back"), later("Back to the previous step; nothing is lost"), ("PgUp",)
    ),
    kit.ActionInfo(
        "automatic", later("Automatic"), later("Turn automatic taking on or off"), ("Y",)
    ),
    kit.ActionInfo("skip", later("Skip"), later("Skip this point: no camera sees it"), ("S",)),
    kit.ActionInfo(
        "repeat", later("Repeat line"), later("Repeat a misplaced or failed line"), ("N",)
    ),
    kit.ActionInfo(
        "anew", later("Repeat sweep"), later("Discard this sweep and repeat it"), ("W",)
    ),
    kit.ActionInfo("calculate", later("Calculate"), later("Recalculate the result"), ("R",)),
    kit.ActionInfo("cancel", later("Cancel"), later("Cancel the calculation"), ("C",)),
    kit.ActionInfo("accept", later("Accept"), later("Activate the result"), ("A",)),
    kit.ActionInfo("keep", later("Keep the old"), later("End without changes"), ("K",)),
    kit.ActionInfo(
        "leave", later("Leave"), later("Back to Maintain; the session can be resumed"), ("Esc",)
    ),
    *(
        kit.ActionInfo(f"plot{number}", text, tip, (f"{number}",))
        for number, (text, tip) in enumerate(_PLOTS, start=1)
    ),
)


def make_wizard_actions(
    wizard: QWidget, calls: Mapping[str, Callable[[], None]]
) -> dict[str, QAction]:
    """Return the actions by key; shortcuts work while ``wizard`` has the focus."""
    actions: dict[str, QAction] = {}
    for info in WIZARD_ACTIONS:
        action = kit.make_action(info, wizard)
        action.setEnabled(False)
        call = calls[info.key]
        command = kit.DebouncedCommand(call) if info.is_trigger else call
        action.triggered.connect(lambda _checked, command=command: command())
        actions[info.key] = action
    return actions


_ROW_PX, _MARK_PX = 66.0, 30.0
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


class Rail(kit.PaintedWidget):
    """One row per step: mark, title and count."""

    def __init__(self) -> None:
        super().__init__(tr("Steps"), (180, round(5 * _ROW_PX)), (140, 160))
        self._steps: tuple[Step, ...] = ()
        self._current = 0
        self._ended = False
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)

    def show_steps(self, steps: Sequence[Step], current: int, *, ended: bool) -> None:
        """Show the steps; ``ended`` marks all of them as done."""
        shown = (tuple(steps), current, ended)
        if shown != (self._steps, self._current, self._ended):
            self._steps, self._current, self._ended = shown
            step = steps[current]
            self.setAccessibleDescription(
                tr("Step {current} of {count}: {title}").format(
                    current=current + 1, count=len(steps), title=kit.said_word(step.title)
                )
            )
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        theme = self._theme
        row = min(_ROW_PX, self.height() / max(len(self._steps), 1))
        for index, step in enumerate(self._steps):
            done = self._ended or index < self._current
            current = index == self._current and not self._ended
            top = index * row
            box = QRectF(3.0, top + 0.5 * (row - _MARK_PX), _MARK_PX, _MARK_PX)
            if index:
                painter.setPen(QPen(QColor(theme.border), 2.0))
                x = box.center().x()
                above = box.top() - (row - _MARK_PX) + 3.0
                painter.drawLine(QPointF(x, above), QPointF(x, box.top() - 3.0))
            colour = theme.good if done else theme.accent if current else theme.muted
            mark = kit.Mark.GOOD if done else kit.Mark.ACTIVE if current else kit.Mark.OPEN
            kit.paint_mark(painter, mark, box, colour, theme.background)
            text = QRectF(box.right() + 10.0, top, self.width() - box.right() - 12.0, row)
            title = f"{index + 1}  {kit.said_word(step.title)}"
            painter.setFont(
                kit.fitted(kit.text_font(17, bold=current), title, text.width(), 26.0, 17)
            )
            painter.setPen(QColor(theme.text if current or done else theme.muted))
            if step.wanted:
                head = QRectF(text.left(), text.center().y() - 25.0, text.width(), 26.0)
                painter.drawText(head, _LEFT, title)
                kit.ink(painter, QColor(theme.muted), font=kit.text_font(14))
                painter.drawText(
                    QRectF(text.left() + 18.0, text.center().y() + 1.0, text.width(), 20.0),
                    _LEFT,
                    tr("{done} of {wanted}").format(done=step.done, wanted=step.wanted),
                )
            else:
                painter.drawText(text, _LEFT, title)
