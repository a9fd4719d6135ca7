"""Parts of a running procedure: rail of its steps, keys, and the question whether to accept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QAction, QColor, QKeySequence, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QSizePolicy, QWidget

from ocmm_core.calibration.guided import Step
from ocmm_gui import kit
from ocmm_gui.kit import later, tr

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
        self._reason = kit.OwnKeysField()
        self._reason.setObjectName("reason")
        self._reason.setAccessibleName(tr("Reason"))
        self._reason.setFont(kit.text_font(16))
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
        action = QAction(tr(info.text), wizard)
        action.setObjectName(info.key)
        action.setToolTip(
            kit.literal(f"{tr(info.tip)} ({', '.join(map(kit.key_words, info.shortcuts))})")
        )
        action.setShortcuts([QKeySequence(keys) for keys in info.shortcuts])
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.setAutoRepeat(False)
        action.setEnabled(False)
        call = calls[info.key]
        command = kit.DebouncedCommand(call) if info.is_trigger else call
        action.triggered.connect(lambda _checked, command=command: command())
        wizard.addAction(action)
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
                count = QRectF(text.left() + 18.0, text.center().y() + 1.0, text.width(), 20.0)
                painter.drawText(
                    count,
                    _LEFT,
                    tr("{done} of {wanted}").format(done=step.done, wanted=step.wanted),
                )
            else:
                painter.drawText(text, _LEFT, title)
