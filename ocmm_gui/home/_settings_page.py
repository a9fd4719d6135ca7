"""Settings page: validated while typing, stored at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QGridLayout, QPushButton, QStackedWidget, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.settings import (
    SECTIONS,
    SETTINGS,
    Applies,
    Kind,
    Note,
    SettingsStore,
    Value,
    spec_of,
)
from ocmm_gui import kit
from ocmm_gui.access import RulerLine
from ocmm_gui.home._file_browser import FileBrowser, FileType
from ocmm_gui.home._setting_row import HIGH_PX, SettingRow, TemplatePreview, wide_button
from ocmm_gui.home._settings_parts import KeyList, SoundsPage
from ocmm_gui.kit import later, tr

_APPLY = kit.ActionInfo(
    "apply", later("Use now"), later("Open the job again with these settings; no point is lost"),
    ("F8",),
)  # fmt: skip
_NOTES_SHOWN = 4
_HEAD = "report"


class SettingsPage(kit.Sheet):
    """Section names, with one section at a time at their right.

    Values are stored on Return or when leaving the field. Values that a running job cannot adopt
    wait until it is reopened by a key, with ``apply`` (None without an open job).
    """

    changed = Signal(object)
    """Emits the `LoadedSettings` in force."""

    def __init__(self, store: SettingsStore, apply: Callable[[], None] | None = None) -> None:
        super().__init__(tr("Settings"), () if apply is None else (_APPLY,))
        self._whole = QStackedWidget()
        self._store, self._reopens = store, apply is not None
        self._waiting: set[str] = set()
        self.loaded = store.load()
        self.notes = kit.sentence_label(tr("What was not used"), 15, role="warn")
        self.rows: dict[str, SettingRow] = {}
        self.ruler = RulerLine()
        self.preview = TemplatePreview()
        self._pages = QStackedWidget()
        self._sections = QButtonGroup(self)
        names = kit.vbox(spacing=2)
        for number, (section, title) in enumerate(SECTIONS.items()):
            names.addWidget(self._section_button(tr(title), number))
            self._pages.addWidget(
                self._with_preview(section) if section == _HEAD else self._section(section)
            )
        self.keys_list = KeyList()
        self.keys_list.changed.connect(lambda keys: self._commit("window.keys", keys))
        names.addWidget(self._section_button(tr("Keys"), len(SECTIONS)))
        self._pages.addWidget(self.keys_list)
        self.sounds = SoundsPage()
        names.addWidget(self._section_button(tr("Test of sounds"), len(SECTIONS) + 1))
        self._pages.addWidget(self.sounds)
        names.addStretch(1)
        self._sections.idClicked.connect(self.show_section)
        self.browser = FileBrowser()
        self.browser.chosen.connect(self._on_chosen)
        self.browser.left.connect(lambda: self._whole.setCurrentIndex(0))
        self._browsed = ""
        column = QWidget()
        column.setLayout(names)
        names.setContentsMargins(0, 0, 2, 0)
        beside = kit.scrolled(column)
        bar = beside.verticalScrollBar().sizeHint().width()
        beside.setFixedWidth(column.sizeHint().width() + bar)
        row = kit.hbox(beside, (self._pages, 1), spacing=12)
        both = QWidget()
        both.setLayout(row)
        row.setContentsMargins(0, 0, 0, 0)
        self._whole.addWidget(both)
        self._whole.addWidget(self.browser)
        kit.fill(self.body, self.notes, (self._whole, 1))
        self.use_keys({} if apply is None else {"apply": apply})
        for each in self.findChildren(QPushButton):
            if each.objectName().startswith("button_"):
                each.setMinimumHeight(HIGH_PX)
        self.show_section(0)
        self._show()

    def open(self, section: str = "") -> None:
        self.loaded = self._store.load()
        self._whole.setCurrentIndex(0)
        if section:
            self.show_section(list(SECTIONS).index(section))
        self._show()
        button = self._sections.checkedButton()
        if button is not None:
            button.setFocus()

    def read_again(self) -> None:
        """Show changes made by window keys."""
        self.loaded = self._store.load()
        self._show()

    def show_section(self, number: int) -> None:
        self._pages.setCurrentIndex(number)
        self._sections.button(number).setChecked(True)
        if number < len(SECTIONS) and list(SECTIONS)[number] == _HEAD:
            self._follow_head()

    def change(self, key: str, value: Value) -> None:
        """Store one setting, as its field does."""
        self._commit(key, value)

    def waits(self) -> bool:
        """Return whether changes await reopening the job."""
        return bool(self._waiting)

    def close_work(self) -> None:
        self.sounds.close_work()
        self.browser.close_work()
        self.preview.close_work()

    def _follow_head(self) -> None:
        self.preview.follow(self.loaded.settings)

    def _with_preview(self, section: str) -> QWidget:
        both = QWidget()
        kit.hbox((self._section(section), 5), (self.preview, 3), parent=both, margins=0)
        return both

    def _section_button(self, title: str, number: int) -> QPushButton:
        button = kit.dressed(wide_button(title), font=kit.text_font(17))
        button.setCheckable(True)
        self._sections.addButton(button, number)
        return button

    def _section(self, section: str) -> QWidget:
        grid = QGridLayout()
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(4)
        for place, spec in enumerate(one for one in SETTINGS if one.section == section):
            if spec.kind is Kind.KEYS:
                continue
            row = SettingRow(spec, grid, place, self, below=section == _HEAD)
            if spec.key == "window.ruler_mm":
                grid.addWidget(self.ruler, 2 * place + 1, 1, 1, 5)
            row.committed.connect(self._commit)
            row.browse.connect(self._browse)
            row.left.connect(self.left)
            self.rows[spec.key] = row
        grid.setColumnStretch(2, 3)
        if section != _HEAD:
            grid.setColumnStretch(5, 4)
        grid.setRowStretch(99, 1)
        return kit.scrolled(kit.panel(grid))

    def _commit(self, key: str, value: Value) -> None:
        notes: tuple[Note, ...] = ()
        try:
            notes = self._store.change({key: value})
        except OcmmError as error:
            self.failed.emit(error)
        for note in notes:
            self.told.emit(kit.said(f"{note.what} {note.remedy}"))
        before = self.loaded.values[key]
        self.loaded = self._store.load()
        if spec_of(key).section == _HEAD:
            self.attempt(self._use_head)
            self._follow_head()
        waits = self._reopens and spec_of(key).applies is Applies.REOPEN
        if waits and self.loaded.values[key] != before:
            self._waiting.add(key)
        self._show()
        self.changed.emit(self.loaded)

    def _use_head(self) -> None:
        # Imported only for templates.
        from ocmm_core.export.template import use_head

        use_head(self.loaded.settings, self._store.user.path.parent)

    def _browse(self, key: str) -> None:
        spec, value = spec_of(key), self.loaded.values[key]
        wanted = FileType.FOLDER if spec.kind is Kind.FOLDER else FileType.ANY
        self._browsed = key
        self._whole.setCurrentWidget(self.browser)
        self.browser.ask(
            kit.said_word(spec.label), wanted, value if isinstance(value, Path) else None
        )

    def _on_chosen(self, path: Path) -> None:
        self._whole.setCurrentIndex(0)
        self.rows[self._browsed].set_text(str(path))

    def _show(self) -> None:
        for row in self.rows.values():
            row.show_value(self.loaded, in_job=self._reopens)
        settings = self.loaded.settings
        self.keys_list.show_keys(settings.window_keys)
        self.ruler.show_length(settings.window_ruler_mm)
        self.sounds.use(enabled=settings.window_sounds, volume=settings.window_volume)
        notes = self.loaded.notes
        text = "\n".join(kit.said(f"{note.what} {note.remedy}") for note in notes[:_NOTES_SHOWN])
        self.notes.tell(text)
        if self._waiting:
            names = ", ".join(kit.said_word(spec_of(key).label) for key in sorted(self._waiting))
            self.show_message(
                tr("Used from the next opening of the job: {names}. F8 opens it again now.").format(
                    names=names
                )
            )
        else:
            differ = tr(
                "%n settings differ from the default (●).",
                "1 setting differs from the default (●).",
                sum(self.loaded.differs(spec.key) for spec in SETTINGS),
            )
            self.show_message(f"{differ} {kit.said(self._store.places())}")
