"""Choice of the plan of a new job: recent, in the plan folder, or shipped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from ocmm_core.settings import is_shipped
from ocmm_gui.kit import ActionInfo, Sheet, later, literal, said, text_font, tr

if TYPE_CHECKING:
    from ocmm_core.inspection.plan import PlanSummary

_KEYS = (
    ActionInfo("other", later("Other file"), later("Look for another plan file"), ("F9",)),
    ActionInfo("begin", later("Next"), later("Go on with this plan: who measures which part"),
               ("F8",)),
)  # fmt: skip
_PATH = Qt.ItemDataRole.UserRole
_ROW_PX = 60


class PlanList(Sheet):
    """Plans, newest first."""

    chosen = Signal(object)
    other_wanted = Signal()
    """Browse for another file."""

    def __init__(self) -> None:
        super().__init__(tr("New job: choose the plan"), _KEYS)
        self.list = QListWidget()
        self.list.setAccessibleName(tr("Plans"))
        self.list.setFont(text_font(18))
        self.list.itemActivated.connect(lambda _item: self._begin())
        self.body.addWidget(self.list, 1)
        self.use_keys({"other": self.other_wanted.emit, "begin": self._begin}, primary="begin")

    def open(self) -> None:
        """Show that plans are being read; `show_plans` follows."""
        self.list.clear()
        self.say(tr("Reading the plans"))
        self.list.setFocus()

    def show_plans(self, plans: tuple[PlanSummary, ...]) -> None:
        self.list.clear()
        for plan in plans:
            remarks = tuple(map(said, plan.remarks))
            where = tr("shipped with OCMM") if is_shipped(plan.path) else str(plan.path)
            item = QListWidgetItem(
                tr("{name}, part {part}; {release}\n{where}").format(
                    name=plan.name, part=plan.part, release=", ".join(remarks), where=where
                ),
                self.list,
            )
            item.setData(_PATH, plan.path)
            item.setToolTip(literal("\n".join((str(plan.path), *remarks))))
            item.setSizeHint(QSize(200, _ROW_PX))
        self.say(tr("Return or F8 goes on with the selected plan."))
        if plans:
            self.list.setCurrentRow(0)
        self.list.setFocus()

    def _begin(self) -> None:
        item = self.list.currentItem()
        if item is not None:
            path: Path = item.data(_PATH)
            self.chosen.emit(path)
