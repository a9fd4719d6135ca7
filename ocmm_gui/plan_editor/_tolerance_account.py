"""Account of a model's tolerances, shown for confirmation."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QHBoxLayout, QHeaderView, QVBoxLayout, QWidget

from ocmm_cad.drawing import Account, AccountItem
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    AnswerPanel,
    DataTable,
    NarrowButton,
    Theme,
    later,
    said,
    sentence_label,
    tr,
)

_STATUS = {"taken": later("✔ taken"), "partly": later("▲ in part"), "refused": later("✖ refused")}
_ORDER = ("refused", "partly", "taken")
_GROUPS = {
    "dimension": later("dimensions"),
    "tolerance": later("tolerances"),
    "datum reference": later("datum references"),
    "datum": later("datums"),
    "datum target": later("datum targets"),
    "annotation": later("labels and notes"),
    "general": later("others"),
}


class ToleranceAccount(QWidget):
    """Number of imported items, and each with its reason: refused ones first.

    Datum references and labels are counted; they follow their items. Return accepts features and
    tolerances, Esc nothing; a button the features alone.
    """

    agreed = Signal()
    """Accept the features with the imported tolerances."""
    without = Signal()
    """Accept the features alone."""
    declined = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Tolerances of the model"))
        self._theme = THEMES[DEFAULT_THEME]
        self._items: list[AccountItem] = []
        self.summary = sentence_label(tr("What became of the tolerances of the model"), 14)
        self.table = DataTable(
            tr("Every item of the model"),
            (
                (tr("Status"), tr("Whether it is in the plan")),
                (tr("Label"), tr("Its name in the model")),
                (tr("Says"), tr("What the model says")),
                (tr("In the plan, or why not"), tr("Characteristics, datums, or the reason")),
            ),
        )
        self.table.setWordWrap(True)
        self.table.horizontalHeader().setSectionResizeMode(3, QHeaderView.ResizeMode.Stretch)
        for column, width in enumerate((110, 230, 300)):
            self.table.setColumnWidth(column, width)
        self.question = AnswerPanel(tr("Take over the tolerances"), tr("Take over"))
        self.question.agreed.connect(self.agreed)
        self.question.declined.connect(self.declined)
        self.features_only = NarrowButton(tr("Features only"))
        self.features_only.setAccessibleName(tr("Take over the features without tolerances"))
        self.features_only.clicked.connect(self.without)
        line = QHBoxLayout()
        line.addWidget(self.question, 1)
        line.addWidget(self.features_only)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.summary)
        layout.addWidget(self.table, 1)
        layout.addLayout(line)
        self.hide()

    def show_account(self, account: Account, characteristics: int) -> None:
        """Show an account, and ask whether to add its characteristics, given their number."""
        told = []
        for group, counts in account.counts().items():
            told.append(
                tr("{taken} of {count} {group}").format(
                    taken=counts["taken"], count=sum(counts.values()), group=tr(_GROUPS[group])
                )
            )
        taken = tr("Taken as a whole: {counts}.").format(counts=", ".join(told))
        self.summary.setText("\n".join((taken, *account.remarks)))
        self._items = sorted(account.by_itself(), key=lambda item: _ORDER.index(item.status))
        self._fill()
        self.show()
        self.table.resizeRowsToContents()
        self.question.ask(
            tr(
                "%n characteristics will be added.",
                "1 characteristic will be added.",
                characteristics,
            )
        )

    def close_account(self) -> None:
        self.question.hide()
        self.hide()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self.question.set_theme(theme)
        self._fill()

    def _fill(self) -> None:
        self.table.setRowCount(len(self._items))
        for row, item in enumerate(self._items):
            became = ", ".join(item.became)
            words = "; ".join(part for part in (became, said(item.why), said(item.remark)) if part)
            self.table.show_words(row, (tr(_STATUS[item.status]), item.name, item.kind, words))
            cell = self.table.item(row, 0)
            if cell is not None:
                colours = {"taken": self._theme.good, "partly": self._theme.warn}
                cell.setForeground(QColor(colours.get(item.status, self._theme.bad)))
