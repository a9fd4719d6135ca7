"""The page of the second screen: its address as QR code, and the number of open pages."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QImage, QPixmap

from ocmm_core.station import ServiceState
from ocmm_gui import kit
from ocmm_gui.kit import later, tr

_KEYS = (
    kit.ActionInfo("start", later("Start"), later("Start the page for the tablet"), ("F6",)),
    kit.ActionInfo("stop", later("Stop"), later("End the page on all tablets"), ("F7",)),
)
_CODE_PX = 380


class SecondScreenSheet(kit.Sheet):
    """QR code and address of the page; `start` and `stop` return at once."""

    def __init__(self, start: Callable[[], None], stop: Callable[[], None]) -> None:
        super().__init__(tr("Second screen"), _KEYS)
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
        self.say(tr("Scan the code with the camera of the tablet; the page opens in its browser."))
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
