from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtWidgets import QHeaderView

from ocmm_gui.kit import (
    ACTIONS,
    ActionInfo,
    NumberTable,
    Sheet,
    key_words,
    later,
    shortcuts_of,
    text_font,
    tr,
    tr_all,
)

_COLUMNS = (
    (later("Where"), later("mode in which the key works")),
    (later("Key"), later("any of them")),
    (later("Name"), later("on the button")),
    (later("What it does"), later("in a sentence")),
)
_ROW_PX = 28
_SIGNS = {".": later(". (full stop)"), ",": later(", (comma)")}


class KeysSheet(Sheet):
    """Table of `ACTIONS`, measuring first; `changed` returns the user's keys by action."""

    def __init__(self, changed: Callable[[], Mapping[str, Sequence[str]]]) -> None:
        super().__init__(tr("Keys"), ())
        self._changed = changed
        self.table = NumberTable(
            tr("Keys of the window"), tr_all(_COLUMNS), whole=False, font=text_font(15)
        )
        self.table.setWordWrap(True)
        self.table.verticalHeader().setMinimumSectionSize(_ROW_PX)
        self.table.setRowCount(len(ACTIONS))
        self._show()
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        self.body.addWidget(self.table, 1)
        self.say(
            tr(
                "F1 to F5, F11 and F12 mean the same everywhere; F6 to F10 belong to the page. "
                "Settings changes keys."
            )
        )
        self.use_keys({})

    def open(self) -> None:
        self._show()
        self.table.resizeRowsToContents()
        self.table.setFocus()

    def _show(self) -> None:
        changed = self._changed()
        for row, info in enumerate(ACTIONS):
            self.table.show_words(row, _row(info, shortcuts_of(info, changed)))


def _row(info: ActionInfo, shortcuts: Sequence[str]) -> tuple[str, ...]:
    where = tr("everywhere") if info.mode is None else tr(info.mode.value)
    keys = tr(" or ").join(tr(_SIGNS.get(key, key_words(key))) for key in shortcuts)
    return (where, keys, tr(info.text), f"{tr(info.tip)}.")
