"""About OCMM: build, licences, and the places of its files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QHeaderView, QPlainTextEdit

from ocmm_core.support import DOCUMENTS, SupportSite, about_lines
from ocmm_gui.kit import (
    ActionInfo,
    NumberTable,
    Sheet,
    caption,
    dressed,
    fill,
    later,
    said,
    said_word,
    text_font,
    tr,
    tr_all,
)

_KEYS = (
    ActionInfo("copy", later("Copy"), later("Copy this table, for a message to support"), ("F6",)),
    ActionInfo("licence", later("Licence"), later("Show the licence of OCMM"), ("F7",)),
    ActionInfo(
        "third_party", later("Third-party"), later("Show the licences of the packages in OCMM"),
        ("F8",),
    ),
    ActionInfo("changes", later("Changes"), later("Show the changes of this version"), ("F9",)),
)  # fmt: skip
_COLUMNS = (
    (later("Name"), later("property of this program")),
    (later("Value"), later("version, licence or folder")),
)


class AboutSheet(Sheet):
    """A table of facts, and below it the licence, third-party licences, or changes."""

    def __init__(self, site: Callable[[], SupportSite]) -> None:
        super().__init__(tr("About OCMM"), _KEYS)
        self._site = site
        self.table = NumberTable(tr("About OCMM"), tr_all(_COLUMNS), font=text_font(14))
        self.text = dressed(QPlainTextEdit(), tr("Text of the licence"))
        self.text.setReadOnly(True)
        self.text.setTabChangesFocus(True)
        self.text.setFont(text_font(13))
        self._name = caption("", self.text)
        fill(self.body, self.table, self._name, (self.text, 1))
        shown = {info.key: partial(self._show, at) for at, info in enumerate(_KEYS[1:])}
        self.use_keys({"copy": self.copy, **shown}, primary="copy")
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)

    def open(self) -> None:
        self.table.show_rows(
            [(said_word(one.title), said(one.value)) for one in about_lines(self._site())]
        )
        self._show(0)
        self.table.setFocus()

    def copy(self) -> None:
        """Copy the table to the clipboard."""
        rows = (": ".join(self.table.words(row)) for row in range(self.table.rowCount()))
        QGuiApplication.clipboard().setText("\n".join(("OCMM", *rows)))
        self.say(tr("Copied. Paste it into a message to support."))

    def _show(self, number: int) -> None:
        document = DOCUMENTS[number]
        self._name.setText(said_word(document.title))
        self.text.setPlainText(document.text())
