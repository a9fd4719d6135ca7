"""Non-modal questions as part of the window: a path, one of two answers, a reason."""

from __future__ import annotations

import contextlib
from collections.abc import Container, Sequence
from pathlib import Path

import msgspec
from PySide6.QtCore import QEvent, QMimeData, QSize, Qt, QUrl, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QFileDialog,
    QFrame,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QWidget,
)

from ocmm_core.documents import decode_json, read_bytes, resource, write_atomic
from ocmm_core.errors import OcmmError
from ocmm_gui.kit._narrow import HintField, NarrowButton, PlainLabel
from ocmm_gui.kit._parts import dressed, hbox
from ocmm_gui.kit._shortcuts import is_never_typed, keeps_keys
from ocmm_gui.kit._texts import later, tr
from ocmm_gui.kit._theme import Themed, text_font

_SCHEMA = "ocmm.recent/1"
_MOST = 20
_LARGEST = 1 << 18


class _Places(msgspec.Struct, frozen=True):
    schema: str = _SCHEMA
    plans: list[str] = msgspec.field(default_factory=list)
    jobs: list[str] = msgspec.field(default_factory=list)
    folders: list[str] = msgspec.field(default_factory=list)


class RecentPlaces:
    """Recent places, newest first; unreadable: empty; ``path`` None: state folder of this user."""

    def __init__(self, path: Path | None = None) -> None:
        if path is None:
            import platformdirs

            path = platformdirs.user_state_path("ocmm") / "recent.json"
        self._path = path

    def plans(self) -> tuple[Path, ...]:
        """Return plans that were measured or edited and still exist."""
        return _there(self._read().plans)

    def jobs(self) -> tuple[Path, ...]:
        """Return jobs that were measured or opened and still exist."""
        return _there(self._read().jobs)

    def folders(self) -> tuple[Path, ...]:
        """Return folders in which something was opened and that still exist."""
        return _there(self._read().folders)

    def note_plan(self, path: Path) -> None:
        """Put a plan first, unless it is shipped with the program."""
        if not is_shipped(path):
            self._note(plans=path, folders=path.parent)

    def note_job(self, path: Path) -> None:
        self._note(jobs=path, folders=path.parent)

    def _note(self, **new: Path) -> None:
        now = self._read()
        lists = {
            kind: [
                str(path.absolute()),
                *(old for old in getattr(now, kind) if old != str(path.absolute())),
            ][:_MOST]
            for kind, path in new.items()
        }
        content = msgspec.json.encode(msgspec.structs.replace(now, **lists))
        # Two programs at once: one entry is lost, which is harmless.
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(self._path, content)

    def _read(self) -> _Places:
        try:
            found = decode_json(read_bytes(self._path, _LARGEST), _Places)
        except (OcmmError, msgspec.MsgspecError):
            return _Places()
        return found if found.schema == _SCHEMA else _Places()


def is_shipped(path: Path) -> bool:
    """Return whether a path is part of the (read-only) program."""
    with contextlib.suppress(OSError, RuntimeError):
        return path.expanduser().resolve().is_relative_to(resource().resolve())
    return False


def _there(names: list[str]) -> tuple[Path, ...]:
    found = []
    for name in names[:_MOST]:
        # Names with a null character, or on a disk that is gone.
        with contextlib.suppress(OSError, ValueError):
            if Path(name).exists():
                found.append(Path(name))
    return tuple(found)


class FieldPanel(QFrame):
    """One line: text, field, buttons of which the last one gives the text, Cancel."""

    def __init__(self, name: str, field: str, buttons: Sequence[QPushButton], decline: str) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(name)
        self.field = dressed(OwnKeysField(), field)
        self._label = PlainLabel()
        self._label.setBuddy(self.field)
        cancel = dressed(NarrowButton(tr("Cancel")), decline)
        hbox(self._label, (self.field, 1), *buttons, cancel, parent=self, margins=(12, 6, 8, 6))
        self.field.returnPressed.connect(self._accept)
        self.field.left.connect(self.hide)
        buttons[-1].clicked.connect(self._accept)
        cancel.clicked.connect(self.hide)
        self.hide()

    def _open(self, text: str) -> None:
        """Open the panel with the focus in the field."""
        self.field.setText(text)
        self.show()
        self.field.setFocus()
        self.field.selectAll()

    def _accept(self) -> None:
        text = self.field.text().strip()
        if text:
            self.hide()
            self._submit(text)

    def _submit(self, text: str) -> None:
        raise NotImplementedError


class PathPanel(FieldPanel):
    """One line: text ``what``, path with hint ``asked``, Browse, Write, Cancel."""

    given = Signal(object)

    def __init__(self, what: str, asked: str, verb: str, *, folders: bool = False) -> None:
        write = dressed(NarrowButton(verb), what, role="primary")
        find = dressed(NarrowButton(tr("Browse")), tr("Look for the file or folder"))
        super().__init__(what, asked, (find, write), tr("Close without changes"))
        self._folders = folders
        self._proposal = Path.home()
        self._label.setText(what)
        self.field.setObjectName("path")
        self.field.setMinimumWidth(300)
        find.clicked.connect(self._browse)
        self._files: QFileDialog | None = None

    def ask(self, proposal: Path) -> None:
        """Open the panel with a proposed path."""
        self._proposal = proposal
        self._open(str(proposal))

    def _browse(self) -> None:
        """Browse without blocking: the page behind remains active."""
        if self._files is None:
            # Qt's own dialog is the same on every system and respects its parent.
            self._files = QFileDialog(self)
            self._files.setOption(QFileDialog.Option.DontUseNativeDialog)
            self._files.setModal(False)
            self._files.fileSelected.connect(self._on_found)
        at = Path(self.field.text().strip() or self._proposal).expanduser()
        folder = at if at.is_dir() else at.parent
        self._files.setFileMode(
            QFileDialog.FileMode.Directory if self._folders else QFileDialog.FileMode.AnyFile
        )
        self._files.setDirectory(str(folder))
        places = (*RecentPlaces().folders(), Path.home())
        self._files.setSidebarUrls([QUrl.fromLocalFile(str(place)) for place in places])
        self._files.show()

    def _on_found(self, path: str) -> None:
        self.field.setText(path)
        self.field.setFocus()

    def _submit(self, text: str) -> None:
        self.given.emit(Path(text).expanduser())


class OwnKeysField(HintField):
    """A field that captures its keys, so that a space in a path records no point."""

    left = Signal()
    given_keys: Container[int] = ()
    """Keys that act on the page."""

    def event(self, event: QEvent) -> bool:
        """Keep all keys from window shortcuts except F1, zoom, and those of the page."""
        if event.type() is QEvent.Type.ShortcutOverride:
            if isinstance(event, QKeyEvent) and (
                is_never_typed(event) or event.key() in self.given_keys
            ):
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


_YES = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
_FAR_SHARE, _DESK_PX = 34.0 / 1080.0, 16.0
"""Type size: relative to the window height, and in pixels."""


class AnswerPanel(Themed, QFrame):
    """One line: the question, and the keys to agree and decline; other keys act as before."""

    agreed = Signal()
    declined = Signal()

    def __init__(self, name: str, verb: str) -> None:
        super().__init__()
        self.setObjectName("answer")
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._before: QWidget | None = None
        self._far = False
        self._label = dressed(PlainLabel(), tr("Question"))
        self._label.setWordWrap(True)
        self._label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self._yes = NarrowButton(tr("{verb}  [Return]").format(verb=verb))
        self._yes.setAccessibleName(tr("{verb} anyway").format(verb=verb))
        self._no = dressed(NarrowButton(tr("Back  [Esc]")), tr("Cancel and go back"))
        layout = hbox((self._label, 1), parent=self, spacing=8, margins=(14, 6, 8, 6))
        for button in (self._yes, self._no):
            # The panel keeps the focus, so that Return answers wherever the mouse was.
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            layout.addWidget(button)
        self._yes.clicked.connect(self.agree)
        self._no.clicked.connect(self.decline)
        self.hide()

    def ask(self, question: str, *, far: bool = False) -> None:
        """Show a question, in a type for near or far reading."""
        self._far = far
        self._set_fonts()
        self._label.setText(question)
        self.setAccessibleDescription(question)
        self._paint()
        if not self.isVisible():
            self._before = QApplication.focusWidget()
        self.show()
        self.setFocus()

    def question(self) -> str:
        return self._label.text()

    def agree(self) -> None:
        self._leave()
        self.agreed.emit()

    def decline(self) -> None:
        self._leave()
        self.declined.emit()

    def minimumSizeHint(self) -> QSize:
        """Return a size that widens no window: the text wraps."""
        return QSize(300, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._set_fonts()

    def event(self, event: QEvent) -> bool:
        """Keep Return and Esc from the shortcuts of the window."""
        return keeps_keys(event, (*_YES, Qt.Key.Key_Escape)) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in _YES:
            self.agree()
        elif event.key() == Qt.Key.Key_Escape:
            self.decline()
        else:
            super().keyPressEvent(event)

    def _leave(self) -> None:
        had_keyboard = self.hasFocus()
        self.hide()
        if had_keyboard and self._before is not None and self._before.isVisible():
            self._before.setFocus()

    def _set_fonts(self) -> None:
        pixels = max(_FAR_SHARE * self.window().height(), _DESK_PX) if self._far else _DESK_PX
        self._label.setFont(text_font(pixels, bold=True))
        for button in (self._yes, self._no):
            button.setFont(text_font(0.7 * pixels if self._far else pixels, bold=True))

    def _paint(self) -> None:
        colour = self._theme.warn
        self.setStyleSheet(
            f"#answer {{ background: {self._theme.panel}; border: 2px solid {colour};"
            f" border-radius: 6px; }} #answer QLabel {{ color: {colour}; }}"
        )


PROPOSAL = later("missed the surface")


class ReasonPanel(FieldPanel):
    """One line: object, reason, Delete, Cancel."""

    given = Signal(int, str)
    """Emits the number of the point and the reason."""

    def __init__(self) -> None:
        delete = dressed(NarrowButton(tr("Delete")), tr("Delete the point now"), role="primary")
        super().__init__(
            tr("Delete a point"), tr("Reason for deletion"), (delete,), tr("Close without deleting")
        )
        self._number = 0
        self.field.setMinimumWidth(260)

    def ask(self, number: int) -> None:
        """Open the panel for a point."""
        self._number = number
        self._label.setText(tr("Reason for deleting point {number}").format(number=number))
        self._open(tr(PROPOSAL))

    def _submit(self, text: str) -> None:
        self.given.emit(self._number, text)


class WorkBar(QProgressBar):
    """Progress bar with the step in it; takes no room while hidden."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.hide()

    def start(self, what: str = "") -> None:
        """Show the start of work; without a step only that something is done."""
        self.setRange(0, 100 if what else 0)
        self.setValue(0)
        self.setFormat(what)
        self.show()

    def advance(self, what: str, share: float) -> None:
        """Show the next step, and the share done."""
        self.setFormat(what)
        self.setValue(round(100.0 * share))
