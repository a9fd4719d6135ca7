"""About OCMM: build, licences, and the places of its files."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QHeaderView, QPlainTextEdit

from ocmm_core.support import DOCUMENTS, SupportSite, about_lines
from ocmm_gui import kit
from ocmm_gui.kit import later, tr

_KEYS = (
    kit.ActionInfo("copy", later("Copy"), later("Copy this table, for a message to support"),
                   ("F6",)),
    kit.ActionInfo("licence", later("Licence"), later("Show the licence of OCMM"), ("F7",)),
    kit.ActionInfo(
        "third_party", later("Third-party"), later("Show the licences of the packages in OCMM"),
        ("F8",),
    ),
    kit.ActionInfo("changes", later("Changes"), later("Show the changes of this version"), ("F9",)),
)  # fmt: skip
_COLUMNS = (
    (later("Name"), later("property of this program")),
    (later("Value"), later("version, licence or folder")),
)


class AboutSheet(kit.Sheet):
    """A table of facts, and below it the licence, third-party licences, or changes."""

    def __init__(self, site: Callable[[], SupportSite]) -> None:
        super().__init__(tr("About OCMM"), _KEYS)
        self._site = site
        self.table = kit.NumberTable(tr("About OCMM"), kit.tr_all(_COLUMNS), font=kit.text_font(14))
        self.text = kit.dressed(QPlainTextEdit(), tr("Text of the licence"))
        self.text.setReadOnly(True)
        self.text.setTabChangesFocus(True)
        self.text.setFont(kit.text_font(13))
        self._name = kit.caption("", self.text)
        kit.fill(self.body, self.table, self._name, (self.text, 1))
        shown = {info.key: partial(self._show, at) for at, info in enumerate(_KEYS[1:])}
        self.use_keys({"copy": self.copy, **shown}, primary="copy")
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)

    def open(self) -> None:
        self.table.show_rows(
            [(kit.said_word(one.title), kit.said(one.value)) for one in about_lines(self._site())]
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
        self._name.setText(kit.said_word(document.title))
        self.text.setPlainText(document.text())
