"""Sheets of help: support bundle with its contents, all keys, about OCMM, the second screen."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QImage, QPixmap
from PySide6.QtWidgets import QCheckBox, QLabel, QListWidget, QPlainTextEdit

from ocmm_core import support
from ocmm_core.errors import OcmmError
from ocmm_core.station import ServiceState
from ocmm_core.support import DOCUMENTS, SupportSite, about_lines
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.work import Worker

_KEYS = (
    kit.ActionInfo("write", later("Write"), later("Write the support bundle to a file"), ("F8",)),
    kit.ActionInfo(
        "names", later("Mask names"), later("Take names of people out, or keep them"), ("F6",)
    ),
    kit.ActionInfo(
        "part", later("Leave out"), later("Leave the selected part out, or not"), ("F7",)
    ),
    kit.ActionInfo("again", later("Gather again"), later("Look again at everything"), ("F9",)),
    kit.ActionInfo(
        "about", later("About"), later("Version, licences and folders of OCMM"), ("F10",)
    ),
)
_CLOSE_S = 1.0
_SHOWN = 200_000
"""Characters of a preview; longer files are complete in the bundle, as the list states."""


class SupportSheet(kit.Sheet):
    """Parts with check boxes, their files, and the selected file's content."""

    def __init__(
        self, site: Callable[[], support.SupportSite], folder: Callable[[], Path],
        about: Callable[[], None],
    ) -> None:  # fmt: skip
        super().__init__(tr("Support bundle"), _KEYS)
        self._site, self._folder = site, folder
        self._worker = Worker("ocmm-support", self)
        self._draft: support.BundleDraft | None = None
        self._shown: list[support.BundleItem] = []
        self.parts: dict[str, QCheckBox] = {}
        side = kit.vbox(spacing=4)
        for spec in support.PARTS:
            box = QCheckBox(kit.said_word(spec.title))
            box.setChecked(True)
            box.setFont(kit.text_font(15))
            box.setToolTip(kit.literal(kit.said(spec.about)))
            box.toggled.connect(self._show_files)
            self.parts[spec.name] = box
            side.addWidget(box)
        self.mask_names = QCheckBox(tr("Mask names of people"))
        self.mask_names.setFont(kit.text_font(15, bold=True))
        self.mask_names.setChecked(True)
        self.mask_names.toggled.connect(lambda _on: self.gather())
        side.addWidget(self.mask_names)
        self.files = kit.dressed(
            QListWidget(), tr("Files of the support bundle"), font=kit.text_font(13)
        )
        self.files.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.files.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.files.currentRowChanged.connect(self._show_text)
        side.addWidget(self.files, 1)
        self.text = _text_view(tr("What is in the selected file"))
        self.text.setLineWrapMode(QPlainTextEdit.LineWrapMode.WidgetWidth)
        self._name: QLabel = kit.caption("", self.text)
        both = kit.hbox((side, 2), (kit.vbox(self._name, (self.text, 1)), 5), spacing=12)
        self.panel = kit.PathPanel(
            tr("Write the support bundle to"), tr("File of the support bundle"), tr("Write")
        )
        self.panel.given.connect(self._write)
        kit.fill(self.body, self.panel, (both, 1))
        self.use_keys(
            {
                "write": self._ask,
                "names": self.mask_names.toggle,
                "part": self._toggle_part,
                "again": self.gather,
                "about": about,
            },
            primary="write",
        )

    def open(self) -> None:
        """Collect everything, and focus the list."""
        self.files.setFocus()
        self.gather()

    def gather(self) -> None:
        self._draft = None
        self.files.clear()
        self.text.clear()
        self.keys["write"].setEnabled(False)
        self.show_message(tr("Gathering. Nothing is sent."))
        site, mask = self._site(), self.mask_names.isChecked()
        self._worker.do(
            lambda: support.draft_bundle(site, mask_names=mask), self._on_draft, self._on_failed
        )

    def is_ready(self) -> bool:
        """Return whether collecting has finished; for tests."""
        return self._draft is not None

    def close_work(self) -> None:
        self._worker.close(_CLOSE_S)

    def left_out(self) -> tuple[str, ...]:
        return tuple(name for name, box in self.parts.items() if not box.isChecked())

    def _on_draft(self, draft: support.BundleDraft) -> None:
        if draft.masked is not self.mask_names.isChecked():
            # Outdated: requested before the check box changed.
            return
        self._draft = draft
        self.keys["write"].setEnabled(True)
        for name, box in self.parts.items():
            box.setToolTip(kit.literal(kit.said(draft.missing.get(name, "")) or box.text()))
            box.setEnabled(bool(draft.items_of(name)))
        self._show_files()

    def _on_failed(self, error: Exception) -> None:
        self.show_message(tr("Failed; nothing was written."))
        self.failed.emit(error)

    def _show_files(self) -> None:
        draft = self._draft
        if draft is None:
            return
        kept = self.files.currentRow()
        without = self.left_out()
        self._shown = [item for item in draft.items if item.part not in without]
        self.files.clear()
        for item in self._shown:
            size = kit.localised(f"{len(item.content) / 1024:.1f}")
            self.files.addItem(tr("{name}  {size} KiB").format(name=item.name, size=size))
        if self._shown:
            self.files.setCurrentRow(min(max(kept, 0), len(self._shown) - 1))
        else:
            self.text.clear()
        total = kit.localised(f"{sum(len(item.content) for item in self._shown) / 1024:.0f}")
        self.show_message(
            tr(
                "%n files, {size} KiB. This is all that is packed; nothing is sent. Passwords "
                "and keys are never in it.",
                "1 file, {size} KiB. This is all that is packed; nothing is sent. Passwords "
                "and keys are never in it.",
                len(self._shown),
            ).format(size=total)
        )

    def _show_text(self, row: int) -> None:
        if 0 <= row < len(self._shown):
            item = self._shown[row]
            self._name.setText(item.name)
            self.text.setPlainText(item.preview(_SHOWN))

    def _toggle_part(self) -> None:
        row = self.files.currentRow()
        if 0 <= row < len(self._shown):
            self.parts[self._shown[row].part].toggle()
        else:
            for box in self.parts.values():
                box.setChecked(True)

    def _ask(self) -> None:
        if self._draft is None:
            return
        now = datetime.now().astimezone()
        self.panel.ask(self._folder() / f"ocmm_support_{now:%Y%m%d_%H%M%S}.zip")

    def _write(self, path: Path) -> None:
        draft, without = self._draft, self.left_out()
        if draft is None:
            return
        self._worker.do(
            lambda: support.write_bundle(draft, path, without),
            lambda size: self.told.emit(
                tr("Support bundle written to {path} ({size} KiB). Nothing was sent.").format(
                    path=path, size=kit.localised(f"{size / 1024:.0f}")
                )
            ),
            self._on_not_written,
        )

    def _on_not_written(self, error: Exception) -> None:
        if not isinstance(error, OcmmError):
            self.show_message(tr("Failed; nothing was written."))
        self.failed.emit(error)


def _text_view(name: str) -> QPlainTextEdit:
    text = kit.dressed(QPlainTextEdit(), name, font=kit.text_font(13))
    text.setReadOnly(True)
    text.setTabChangesFocus(True)
    return text


_COLUMNS = (
    (later("Where"), later("mode in which the key works")),
    (later("Key"), later("any of them")),
    (later("Name"), later("on the button")),
    (later("What it does"), later("in a sentence")),
)
_ROW_PX = 28
_SIGNS = {".": later(". (full stop)"), ",": later(", (comma)")}


class KeysSheet(kit.Sheet):
    """Table of `ACTIONS`, measuring first; `changed` returns the user's keys by action."""

    def __init__(self, changed: Callable[[], Mapping[str, Sequence[str]]]) -> None:
        super().__init__(tr("Keys"), ())
        self._changed = changed
        self.table = kit.NumberTable(
            tr("Keys of the window"), kit.tr_all(_COLUMNS), whole=False, font=kit.text_font(15)
        )
        self.table.setWordWrap(True)
        self.table.verticalHeader().setMinimumSectionSize(_ROW_PX)
        self.table.setRowCount(len(kit.ACTIONS))
        self._show()
        self.table.fit_columns(len(_COLUMNS) - 1)
        self.body.addWidget(self.table, 1)
        self.show_message(
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
        for row, info in enumerate(kit.ACTIONS):
            self.table.show_words(row, _row(info, kit.shortcuts_of(info, changed)))


def _row(info: kit.ActionInfo, shortcuts: Sequence[str]) -> tuple[str, ...]:
    where = tr("everywhere") if info.mode is None else tr(info.mode.value)
    keys = tr(" or ").join(tr(_SIGNS.get(key, kit.key_words(key))) for key in shortcuts)
    return (where, keys, tr(info.text), f"{tr(info.tip)}.")


_ABOUT_KEYS = (
    kit.ActionInfo("copy", later("Copy"), later("Copy this table, for a message to support"),
                   ("F6",)),
    kit.ActionInfo("licence", later("Licence"), later("Show the licence of OCMM"), ("F7",)),
    kit.ActionInfo(
        "third_party", later("Third-party"), later("Show the licences of the packages in OCMM"),
        ("F8",),
    ),
    kit.ActionInfo("changes", later("Changes"), later("Show the changes of this version"), ("F9",)),
)  # fmt: skip
_FACTS = (
    (later("Name"), later("property of this program")),
    (later("Value"), later("version, licence or folder")),
)


class AboutSheet(kit.Sheet):
    """A table of facts, and below it the licence, third-party licences, or changes."""

    def __init__(self, site: Callable[[], SupportSite]) -> None:
        super().__init__(tr("About OCMM"), _ABOUT_KEYS)
        self._site = site
        self.table = kit.NumberTable(tr("About OCMM"), kit.tr_all(_FACTS), font=kit.text_font(14))
        self.text = _text_view(tr("Text of the licence"))
        self._name = kit.caption("", self.text)
        kit.fill(self.body, self.table, self._name, (self.text, 1))
        shown = {info.key: partial(self._show, at) for at, info in enumerate(_ABOUT_KEYS[1:])}
        self.use_keys({"copy": self.copy, **shown}, primary="copy")
        self.table.fit_columns(len(_FACTS) - 1)

    def open(self) -> None:
        self.table.show_rows(
            [(kit.said_word(one.title), kit.said(one.value)) for one in about_lines(self._site())]
        )
        self._show(0)
        self.table.setFocus()

    def copy(self) -> None:
        """Copy the table to the clipboard."""
        rows = (": ".join(self.table.cells(row)) for row in range(self.table.rowCount()))
        QGuiApplication.clipboard().setText("\n".join(("OCMM", *rows)))
        self.show_message(tr("Copied. Paste it into a message to support."))

    def _show(self, number: int) -> None:
        document = DOCUMENTS[number]
        self._name.setText(kit.said_word(document.title))
        self.text.setPlainText(document.text())


_SCREEN_KEYS = (
    kit.ActionInfo("start", later("Start"), later("Start the page for the tablet"), ("F6",)),
    kit.ActionInfo("stop", later("Stop"), later("End the page on all tablets"), ("F7",)),
)
_CODE_PX = 380


class SecondScreenSheet(kit.Sheet):
    """QR code and address of the page; `start` and `stop` return at once."""

    def __init__(self, start: Callable[[], None], stop: Callable[[], None]) -> None:
        super().__init__(tr("Second screen"), _SCREEN_KEYS)
        self._start = start
        self.code = kit.dressed(kit.PlainLabel(), tr("QR code of the page"))
        self.code.setFixedSize(_CODE_PX, _CODE_PX)
        self.code.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.readers = kit.sentence_label(tr("Open pages"), 26)
        self.doubt = kit.sentence_label(tr("About the connection"), 18)
        kit.use_role(self.doubt, "warn")
        self.address = kit.sentence_label(tr("Address of the page"), 16)
        self.address.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse
            | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        words = kit.vbox(self.readers, self.doubt, self.address, 1, spacing=14)
        row = kit.hbox(self.code, (words, 1), spacing=28)
        row.setAlignment(self.code, Qt.AlignmentFlag.AlignTop)
        self.body.addLayout(row, 1)
        self.show_message(
            tr("Scan the code with the camera of the tablet; the page opens in its browser.")
        )
        self.use_keys({"start": start, "stop": stop}, primary="start")
        self.show_state(None)

    def open(self) -> None:
        """Start the page, unless it runs."""
        self._start()

    def show_state(self, state: ServiceState | None) -> None:
        """Show the running server; None: none runs."""
        self.keys["start"].setEnabled(state is None)
        self.keys["stop"].setEnabled(state is not None)
        self.code.setVisible(state is not None)
        if state is None:
            self.readers.setText(tr("The second screen is off."))
            self.doubt.clear()
            self.address.clear()
            return
        words = tr("No page is open yet.")
        if state.open_pages:
            words = tr("%n pages are open.", "One page is open.", state.open_pages)
        self.readers.setText(words)
        self.doubt.setText(kit.said(state.sentence))
        if state.page != self.address.text():
            self.address.setText(state.page)
            self.code.setPixmap(_picture(state.code))


def _picture(code: tuple[bytes, ...]) -> QPixmap:
    """Return a QR code, black on white in every theme, with whole pixels a module."""
    size = len(code)
    pixels = bytes(0 if module else 255 for row in code for module in row)
    image = QImage(pixels, size, size, size, QImage.Format.Format_Grayscale8).copy()
    side = size * (_CODE_PX // size)
    return QPixmap.fromImage(image.scaled(side, side))
