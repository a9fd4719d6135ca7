"""All keys of the window and what they do, on one page."""

from __future__ import annotations

from PySide6.QtWidgets import QHeaderView

from ocmm_gui.kit import ACTIONS, ActionInfo, NumberTable, Sheet, text_font

_COLUMNS = (
    ("Where", "mode in which the key works"),
    ("Key", "any of them"),
    ("Name", "on the button"),
    ("What it does", "in a sentence"),
)
_ROW_PX = 28
_SIGNS = {".": ". (full stop)", ",": ", (comma)"}


class KeysSheet(Sheet):
    """A table of `ACTIONS`: what belongs to measuring first."""

    def __init__(self) -> None:
        super().__init__("Keys", ())
        self.table = NumberTable("Keys of the window", _COLUMNS, whole=False)
        self.table.setFont(text_font(15))
        self.table.verticalHeader().setDefaultSectionSize(_ROW_PX)
        self.table.setRowCount(len(ACTIONS))
        for row, info in enumerate(ACTIONS):
            self.table.show_words(row, _row(info))
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        self.body.addWidget(self.table, 1)
        self.say("Other pages show their keys on their buttons.")
        self.use_keys({})

    def open(self) -> None:
        """Give the table the keyboard."""
        self.table.setFocus()


def _row(info: ActionInfo) -> tuple[str, ...]:
    where = "everywhere" if info.mode is None else info.mode.value
    keys = " or ".join(_SIGNS.get(key, key) for key in info.shortcuts)
    return (where, keys, info.text, f"{info.tip}.")
