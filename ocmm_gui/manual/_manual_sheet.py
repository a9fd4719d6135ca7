"""The manual as a sheet: chapters and search at the left, the text at the right."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QApplication, QListWidget, QListWidgetItem, QWidget
from shiboken6 import isValid

from ocmm_core.manual import Chapter, Manual, ManualHit, ManualPart, Place, load_manual
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.manual._reading import FIRST, DocumentView


class SearchField(kit.FormField):
    """Search field; Up and Down move in the hits."""

    moved = Signal(int)

    @classmethod
    def with_tip(cls, name: str, tip: str) -> SearchField:
        field = kit.dressed(cls(""), name, tip, font=kit.text_font(15))
        field.setPlaceholderText(tip)
        return field

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if step := kit.list_step(event):
            self.moved.emit(step)
            return
        super().keyPressEvent(event)


def hit_words(hit: ManualHit) -> str:
    """Return a hit for the list: place, and surrounding words."""
    where = hit.title if hit.title == hit.chapter else f"{hit.chapter}: {hit.title}"
    return f"{where}\n{hit.excerpt}" if hit.excerpt else where


_INFOS = (
    kit.ActionInfo(
        "chapters", later("Chapters"), later("List of chapters, those for the inspector first"),
        ("F7",),
    ),
    kit.ActionInfo("search", later("Search"), later("Search the manual"), ("F8", "Ctrl+F")),
    kit.ActionInfo(
        "before", later("Previous place"), later("Back to where you read before"),
        ("F9", "Alt+Left"),
    ),
    kit.ActionInfo(
        "after", later("Next place"), later("Forward to where you came back from"),
        ("F10", "Alt+Right"),
    ),
)  # fmt: skip
_PARTS = {
    ManualPart.OVERVIEW: later("Overview"),
    ManualPart.INSPECTOR: later("For the inspector"),
    ManualPart.TECHNICIAN: later("For the technician"),
    ManualPart.QUALITY: later("For the quality engineer"),
    ManualPart.INTEGRATOR: later("For the integrator"),
    ManualPart.DEVELOPER: later("For developers"),
    ManualPart.DECISIONS: later("Decisions"),
}
_PLACE = Qt.ItemDataRole.UserRole
_SIDE_PX = 330
_ROW_PX, _HIT_PX = 30, 78
_MOST_PLACES = 200


@dataclass(frozen=True, slots=True)
class _Read:
    """A visited place, with the marked words."""

    place: Place
    words: tuple[str, ...] = ()


class ManualSheet(kit.Sheet):
    """Chapters, search, and text; `manual` None: that of this program, read at first use."""

    def __init__(self, manual: Manual | None = None) -> None:
        super().__init__(tr("Manual"), _INFOS)
        self._language = kit.language_in_use()
        self._manual = manual or self.attempt(lambda: load_manual(language=self._language))
        self._read: list[_Read] = []
        self._now = -1
        self._came_from: tuple[QWidget | None, QWidget | None] = (None, None)
        self.field = SearchField.with_tip(tr("Search the manual"), tr("Words to search for"))
        self.list = kit.dressed(
            QListWidget(), tr("Chapters and what was found"), font=kit.text_font(14)
        )
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        left = QWidget()
        kit.vbox(self.field, (self.list, 1), parent=left, spacing=6, margins=0)
        left.setFixedWidth(_SIDE_PX)
        self.text = DocumentView(self._manual) if self._manual is not None else None
        both = kit.hbox(left, spacing=10)
        self.remark = kit.sentence_label(tr("Language of this page"), 14, role="muted")
        if self.text is not None:
            both.addLayout(kit.vbox(self.remark, (self.text, 1), spacing=4), 1)
            self.text.link_wanted.connect(self._follow)
        self.body.addLayout(both, 1)
        self.field.textChanged.connect(lambda _text: self._list())
        self.field.returnPressed.connect(self._take_first)
        self.field.moved.connect(self._move)
        self.list.itemActivated.connect(self._open_item)
        self.list.itemClicked.connect(self._open_item)
        self.use_keys(
            {
                "chapters": self._show_chapters, "search": self._search,
                "before": lambda: self._turn(-1), "after": lambda: self._turn(1),
            }
        )  # fmt: skip
        self._zooms()
        self._list()
        self._show_status()

    def open(self, reference: str = "") -> None:
        """Show a section, ``document.md#section``, by default the first."""
        self.field.clear()
        self._go(_Read(Place.from_reference(reference or FIRST)))
        if self.text is not None:
            self.text.setFocus()

    def come_from(self, page: QWidget | None) -> None:
        """Remember the page shown before the manual, and its focus widget."""
        if page is not self:
            self._came_from = (page, QApplication.focusWidget())

    def came_from(self) -> tuple[QWidget | None, QWidget | None]:
        """Return that page, and its focus widget if it still exists."""
        page, focus = self._came_from
        return page, focus if focus is not None and isValid(focus) else None

    def place(self) -> Place | None:
        """Return the current place; None without a manual."""
        return self._read[self._now].place if self._read else None

    def _go(self, read: _Read) -> None:
        """Open a place and add it to the history, truncated after the current place."""
        self._remember_scroll()
        del self._read[self._now + 1 :]
        if not self._read or self._read[-1] != read:
            self._read.append(read)
        del self._read[:-_MOST_PLACES]
        self._now = len(self._read) - 1
        self._show()

    def _turn(self, step: int) -> None:
        if 0 <= self._now + step < len(self._read):
            self._remember_scroll()
            self._now += step
            self._show()

    def _remember_scroll(self) -> None:
        """Store the section read last, to return there."""
        at = self.text.place() if self.text is not None else None
        if at is not None and 0 <= self._now < len(self._read):
            old = self._read[self._now]
            if old.place.document == at.document:
                self._read[self._now] = _Read(at, old.words)

    def _show(self) -> None:
        if self._manual is None or self.text is None:
            return
        read = self._read[self._now]
        self.text.show_place(read.place, read.words)
        if not self.field.text():
            self._select(read.place)
        self._show_status()
        self.text.setFocus()

    def _show_status(self) -> None:
        self.keys["before"].setEnabled(self._now > 0)
        self.keys["after"].setEnabled(self._now + 1 < len(self._read))
        chapter = None if self._manual is None or not self._read else self._chapter()
        self._remark_on(chapter)
        if chapter is None:
            self.show_message(tr("Tab and Return follow a link."))
        else:
            self.show_message(
                tr("{part}: {title}. Tab and Return follow a link.").format(
                    part=tr(_PARTS[chapter.part]), title=chapter.title
                )
            )

    def _remark_on(self, chapter: Chapter | None) -> None:
        """Remark on a page that is not translated, or older than the English."""
        told = ""
        if chapter is not None and chapter.language != self._language:
            told = tr("This page is in English only.")
        elif chapter is not None and chapter.is_behind:
            told = tr("The English page was changed after this one was translated.")
        self.remark.tell(told)

    def _chapter(self) -> Chapter | None:
        place = self.place()
        return (
            None if place is None or self._manual is None else self._manual.chapter(place.document)
        )

    def _follow(self, link: str) -> None:
        place, now = None, self.place()
        if self._manual is not None and now is not None:
            place = self._manual.resolve(now.document, link)
        if place is None:
            self.show_message(tr("{link} is not part of the manual.").format(link=link))
            return
        self._go(_Read(place))

    def _list(self) -> None:
        """List the hits; the chapters without a search."""
        self.list.clear()
        if self._manual is None:
            return
        words = self.field.text().strip()
        if not words:
            part = None
            for chapter in self._manual.chapters:
                if chapter.part is not part:
                    part = chapter.part
                    self._heading(tr(_PARTS[part]))
                item = self._item(chapter.title, Place(chapter.name), _ROW_PX)
                item.setToolTip(kit.literal(chapter.name))
            return
        hits = self._manual.search(words)
        for hit in hits:
            self._item(hit_words(hit), Place(hit.document, hit.anchor), _HIT_PX)
        if hits:
            self.list.setCurrentRow(0)
        else:
            self._heading(tr("Nothing found: try fewer words, or only their beginnings"))

    def _heading(self, text: str) -> None:
        item = QListWidgetItem(text, self.list)
        item.setFlags(Qt.ItemFlag.NoItemFlags)
        item.setFont(kit.text_font(14, bold=True))
        item.setSizeHint(QSize(_SIDE_PX - 30, _ROW_PX if len(text) < 40 else 2 * _ROW_PX))

    def _item(self, text: str, place: Place, height: int) -> QListWidgetItem:
        item = QListWidgetItem(text, self.list)
        item.setData(_PLACE, str(place))
        lines = self.list.fontMetrics().horizontalAdvance(text) // (_SIDE_PX - 50) + 1
        item.setSizeHint(
            QSize(_SIDE_PX - 30, max(height, _ROW_PX + 18 * (lines - 1) if "\n" not in text else 0))
        )
        item.setToolTip(kit.literal(text))
        return item

    def _open_item(self, item: QListWidgetItem) -> None:
        reference = item.data(_PLACE)
        if reference:
            words = tuple(self.field.text().split())
            self._go(_Read(Place.from_reference(reference), words))

    def _take_first(self) -> None:
        item = self.list.currentItem()
        if self.field.text().strip() and item is not None:
            self._open_item(item)

    def _move(self, step: int) -> None:
        count = self.list.count()
        if count:
            self.list.setCurrentRow((self.list.currentRow() + step) % count)

    def _select(self, place: Place) -> None:
        for row in range(self.list.count()):
            reference = self.list.item(row).data(_PLACE)
            if reference and Place.from_reference(reference).document == place.document:
                self.list.setCurrentRow(row)
                return

    def _search(self) -> None:
        self.field.setFocus()
        self.field.selectAll()

    def _show_chapters(self) -> None:
        self.field.clear()
        place = self.place()
        if place is not None:
            self._select(place)
        self.list.setFocus()

    def _zooms(self) -> None:
        for steps, key in (
            (1, QKeySequence.StandardKey.ZoomIn), (-1, QKeySequence.StandardKey.ZoomOut),
        ):  # fmt: skip
            action = QAction(self)
            action.setShortcuts(key)
            action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            action.triggered.connect(lambda _checked, steps=steps: self._zoom(steps))
            self.addAction(action)

    def _zoom(self, steps: int) -> None:
        if self.text is not None:
            self.text.zoom(steps)
