"""Non-modal read-only file browser: recent places at the left, files of the folder at right."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QWidget

from ocmm_core.documents import resource
from ocmm_gui import kit
from ocmm_gui.home._setting_row import HIGH_PX, wide_button
from ocmm_gui.kit import tr
from ocmm_gui.work import Worker

_PATH = Qt.ItemDataRole.UserRole
_MOST = 500
_ROW_PX = 40


class FileType(Enum):
    """File types, by suffix."""

    ANY = ()
    FOLDER = ("/",)
    PLAN = (".toml",)
    JOB = (".ocmm",)
    OPEN = (".ocmm", ".toml")


@dataclass(frozen=True, slots=True)
class FolderListing:
    """Contents of a folder by name, and whether there is more than shown."""

    folder: Path
    folders: tuple[Path, ...] = ()
    files: tuple[Path, ...] = ()
    more: bool = False
    fault: str = ""


class FileBrowser(QWidget):
    """Choose a file or a folder by keys, mouse or finger, or type its path."""

    chosen = Signal(object)
    left = Signal()

    def __init__(self, recent: kit.RecentPlaces | None = None) -> None:
        super().__init__()
        self.setAccessibleName(tr("Files"))
        self._recent = recent or kit.RecentPlaces()
        self._wanted = FileType.ANY
        self._folder = Path.home()
        self._worker = Worker("ocmm-files", self)
        self.title = kit.dressed(kit.PlainLabel(), font=kit.text_font(18, bold=True))
        self.path = kit.form_field(tr("Path"), tr("Path of the file; Return opens it"))
        kit.dressed(self.path, font=kit.text_font(17), high=HIGH_PX)
        self.path.left.connect(self.left)
        self.path.returnPressed.connect(self._on_typed)
        self.places = _list(tr("Recent places"))
        self.files = _list(tr("Files of the folder"))
        self.told = kit.sentence_label(tr("About the folder"), 14, role="muted")
        self.take = wide_button(tr("Choose this folder"), "primary")
        self.take.clicked.connect(lambda: self._submit(self._folder))
        cancel = wide_button(tr("Cancel"), "plain")
        cancel.clicked.connect(self.left)
        head = kit.hbox((self.path, 1), self.take, cancel)
        lists = kit.hbox((self.places, 2), (self.files, 5))
        kit.vbox(self.title, head, (lists, 1), self.told, parent=self, margins=0)
        for one in (self.places, self.files):
            one.itemActivated.connect(self._on_activated)
            one.itemClicked.connect(self._on_clicked)

    def ask(self, title: str, wanted: FileType, at: Path | None = None) -> None:
        """Start browsing at a file or folder, or at the last used place."""
        self._wanted = wanted
        self.title.setText(title)
        self.take.setVisible(wanted is FileType.FOLDER)
        places = self._recent.folders()
        start = at if at is not None else next(iter(places), Path.home())
        folder = start if start.is_dir() else start.parent
        self.places.clear()
        for place in dict.fromkeys((*places, Path.home(), *_drives(), resource())):
            _add(self.places, str(place), place)
        self._go(folder)
        self.files.setFocus()

    def close_work(self) -> None:
        self._worker.close(0.0)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave at Esc, and go up at Backspace."""
        if event.key() == Qt.Key.Key_Escape:
            self.left.emit()
        elif event.key() == Qt.Key.Key_Backspace:
            self._go(self._folder.parent)
        else:
            super().keyPressEvent(event)

    def _go(self, folder: Path) -> None:
        self._folder = folder
        self.path.setText(str(folder))
        self.told.setText(tr("Reading {folder}").format(folder=folder))
        wanted = self._wanted
        self._worker.do(
            lambda: listing(folder, wanted), self._show, lambda error: self.told.setText(str(error))
        )

    def _show(self, found: FolderListing) -> None:
        if found.folder != self._folder:
            return
        self.files.clear()
        if found.folder.parent != found.folder:
            _add(self.files, tr("↑ Folder above"), found.folder.parent)
        for path in found.folders:
            _add(self.files, f"{path.name}/", path)
        for path in found.files:
            _add(self.files, path.name, path)
        if self.files.count():
            self.files.setCurrentRow(min(1, self.files.count() - 1))
        told = found.fault or tr("%n files.", "1 file.", len(found.files))
        if found.more:
            told = tr("The first {count} are shown; type the path of others.").format(count=_MOST)
        self.told.setText(told)

    def _on_clicked(self, item: QListWidgetItem) -> None:
        path = item.data(_PATH)
        if item.listWidget() is self.places:
            self._go(path)
        elif not path.is_dir():
            self.path.setText(str(path))

    def _on_activated(self, item: QListWidgetItem) -> None:
        self._open(item.data(_PATH))

    def _on_typed(self) -> None:
        self._open(Path(self.path.text().strip()).expanduser())

    def _open(self, path: Path) -> None:
        if path.is_dir():
            self._go(path)
        elif path.is_file() and self._wanted is not FileType.FOLDER:
            self._submit(path)
        else:
            self.told.setText(tr("{path}: not there, or not what is looked for.").format(path=path))

    def _submit(self, path: Path) -> None:
        self.chosen.emit(path)


def listing(folder: Path, wanted: FileType) -> FolderListing:
    """Return the visible contents of a folder; errors are part of it, not raised."""
    folders, files = [], []
    more = False
    try:
        for path in folder.iterdir():
            if path.name.startswith("."):
                continue
            if path.is_dir():
                folders.append(path)
            elif not wanted.value or path.suffix.lower() in wanted.value:
                files.append(path)
            if len(folders) + len(files) >= _MOST:
                more = True
                break
    except OSError as error:
        return FolderListing(folder, fault=f"{folder}: {error.strerror}")
    return FolderListing(folder, tuple(sorted(folders)), tuple(sorted(files)), more)


def _drives() -> tuple[Path, ...]:
    """Return the mount points of removable media."""
    found: list[Path] = []
    for root in (Path("/media"), Path("/run/media")):
        try:
            found += [path for path in sorted(root.glob("*/*")) if path.is_dir()]
        except OSError:
            continue
    return tuple(found[:10])


def _list(name: str) -> QListWidget:
    made = kit.dressed(QListWidget(), name, font=kit.text_font(16))
    made.setVerticalScrollMode(QListWidget.ScrollMode.ScrollPerPixel)
    return made


def _add(to: QListWidget, text: str, path: Path) -> None:
    item = QListWidgetItem(text, to)
    item.setData(_PATH, path)
    item.setToolTip(kit.literal(str(path)))
    item.setSizeHint(QSize(120, _ROW_PX))
