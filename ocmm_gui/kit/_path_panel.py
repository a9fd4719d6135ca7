"""Non-modal panel for a file or folder to write."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, QMimeData, Qt, QUrl, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFileDialog, QFrame, QHBoxLayout

from ocmm_core.settings import RecentPlaces
from ocmm_gui.kit._narrow import HintField, NarrowButton
from ocmm_gui.kit._shortcuts import is_never_typed
from ocmm_gui.kit._texts import PlainLabel, tr


class PathPanel(QFrame):
    """One line: text ``what``, path with hint ``asked``, Browse, Write, Cancel."""

    given = Signal(object)

    def __init__(self, what: str, asked: str, verb: str, *, folders: bool = False) -> None:
        super().__init__()
        self._folders = folders
        self.setProperty("role", "panel")
        self.setAccessibleName(what)
        self._proposal = Path.home()
        self._field = OwnKeysField()
        self._field.setObjectName("path")
        self._field.setAccessibleName(asked)
        self._field.setMinimumWidth(300)
        write = NarrowButton(verb)
        write.setAccessibleName(what)
        write.setProperty("role", "primary")
        find = NarrowButton(tr("Browse"))
        find.setAccessibleName(tr("Look for the file or folder"))
        find.clicked.connect(self._browse)
        self._files: QFileDialog | None = None
        cancel = NarrowButton(tr("Cancel"))
        cancel.setAccessibleName(tr("Close without changes"))
        label = PlainLabel(what)
        label.setBuddy(self._field)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 6, 8, 6)
        layout.addWidget(label)
        layout.addWidget(self._field, 1)
        layout.addWidget(find)
        layout.addWidget(write)
        layout.addWidget(cancel)
        self._field.returnPressed.connect(self._give)
        self._field.left.connect(self.hide)
        write.clicked.connect(self._give)
        cancel.clicked.connect(self.hide)
        self.hide()

    def ask(self, proposal: Path) -> None:
        """Open the panel with the focus in the field."""
        self._proposal = proposal
        self._field.setText(str(proposal))
        self.show()
        self._field.setFocus()
        self._field.selectAll()

    def _browse(self) -> None:
        """Browse without blocking: the page behind remains active."""
        if self._files is None:
            # Qt's own dialog is the same on every system and respects its parent.
            self._files = QFileDialog(self)
            self._files.setOption(QFileDialog.Option.DontUseNativeDialog)
            self._files.setModal(False)
            self._files.fileSelected.connect(self._on_found)
        at = Path(self._field.text().strip() or self._proposal).expanduser()
        folder = at if at.is_dir() else at.parent
        self._files.setFileMode(
            QFileDialog.FileMode.Directory if self._folders else QFileDialog.FileMode.AnyFile
        )
        self._files.setDirectory(str(folder))
        places = (*RecentPlaces().folders(), Path.home())
        self._files.setSidebarUrls([QUrl.fromLocalFile(str(place)) for place in places])
        self._files.show()

    def _on_found(self, path: str) -> None:
        self._field.setText(path)
        self._field.setFocus()

    def _give(self) -> None:
        text = self._field.text().strip()
        if text:
            self.hide()
            self.given.emit(Path(text).expanduser())


class OwnKeysField(HintField):
    """A field that captures its keys, so that a space in a path records no point."""

    left = Signal()

    def event(self, event: QEvent) -> bool:
        """Keep all keys from window shortcuts except F1 and zoom."""
        if event.type() is QEvent.Type.ShortcutOverride:
            if isinstance(event, QKeyEvent) and is_never_typed(event):
                event.ignore()
                return False
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.left.emit()
            return
        super().keyPressEvent(event)


def list_step(event: QKeyEvent) -> int:
    """Return the list step of a key in a field: down, up, or none."""
    return {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1}.get(Qt.Key(event.key()), 0)


_DROPPED = (".ocmm", ".toml")


def dropped_file(dragged: QMimeData) -> Path | None:
    """Return the single dragged plan or job; None otherwise."""
    paths = [Path(url.toLocalFile()) for url in dragged.urls() if url.isLocalFile()]
    if len(paths) != 1 or paths[0].suffix.lower() not in _DROPPED:
        return None
    return paths[0]
