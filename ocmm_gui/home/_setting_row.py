"""One setting with its field, validated while typing, and the preview of a report's first page.

The preview is drawn in another process.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QFileSystemWatcher, QObject, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QImage, QPixmap, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QCompleter, QGridLayout, QPushButton, QWidget

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.settings import (
    Applies,
    Kind,
    LoadedSettings,
    Scope,
    SettingOrigin,
    Settings,
    SettingSpec,
    Value,
    text_of,
    value_of_text,
)
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.work import SideProcess, Teller

HIGH_PX = 57
"""15 mm at 96 dpi: a gloved finger."""
_PATHS = (Kind.FILE, Kind.FOLDER)
_LONGEST = 60
_FONT_PX = 17


class SettingRow(QObject):
    """The widgets of one setting, in four columns of a grid."""

    committed = Signal(str, object)
    """Emits key and valid value after editing."""
    browse = Signal(str)
    """Emits the key of a path to browse for."""
    left = Signal()

    def __init__(
        self,
        spec: SettingSpec,
        grid: QGridLayout,
        row: int,
        parent: QWidget,
        *,
        below: bool = False,
    ) -> None:
        super().__init__(parent)
        self.spec = spec
        self._shown: Value = spec.default
        self._about = ""
        label, tip = kit.said_word(spec.label), kit.said(spec.tip)
        self.choice: kit.ChoiceBox | None = None
        self.switch: QPushButton | None = None
        # Without a place in the grid it would be a top-level window.
        # After the first show the style sheet overrides later fonts.
        self.field = kit.dressed(_Field(), label, tip, font=kit.text_font(_FONT_PX))
        self.field.setParent(parent)
        self.field.hide()
        editor: QWidget = self.field
        if spec.kind is Kind.CHOICE:
            editor = self.choice = kit.ChoiceBox(label, tip, kit.tr_all(spec.choices))
            self.choice.activated.connect(lambda index: self._commit(spec.choices[index]))
        elif spec.kind is Kind.SWITCH:
            editor = self.switch = kit.dressed(kit.NarrowButton(), label, tip)
            self.switch.setCheckable(True)
            self.switch.clicked.connect(self._commit)
        else:
            self.field.show()
            self.field.textEdited.connect(self._on_typed)
            self.field.editingFinished.connect(self._on_finished)
            self.field.left.connect(self._on_left)
            if spec.choices:
                completer = QCompleter(spec.choices, self.field)
                completer.setCompletionMode(QCompleter.CompletionMode.UnfilteredPopupCompletion)
                self.field.setCompleter(completer)
        editor.setMinimumHeight(HIGH_PX)
        editor.setMinimumWidth(300)
        if editor is not self.field:
            editor.setFont(kit.text_font(_FONT_PX))
        self.editor = editor
        self.mark = kit.dressed(kit.PlainLabel(), font=kit.text_font(20, bold=True))
        self.mark.setFixedWidth(18)
        words = kit.caption(_with_unit(label, spec.quantity.unit), editor, 16)
        self.told = kit.sentence_label(
            tr("About {setting}").format(setting=label), 14, role="muted", middle=True
        )
        # Every second line is for messages.
        row = 2 * row
        grid.addWidget(self.mark, row, 0)
        grid.addWidget(words, row, 1)
        grid.addWidget(editor, row, 2)
        self.find: QPushButton | None = None
        if spec.kind in _PATHS:
            self.find = _button("…", tr("Look for the file of {setting}").format(setting=label))
            self.find.clicked.connect(lambda: self.browse.emit(spec.key))
            grid.addWidget(self.find, row, 3)
        self.reset = _button("↺", tr("Set {setting} to its default").format(setting=label))
        self.reset.clicked.connect(lambda: self.committed.emit(spec.key, spec.default))
        grid.addWidget(self.reset, row, 4)
        if below:
            grid.addWidget(self.told, row + 1, 1, 1, 4)
        else:
            grid.addWidget(self.told, row, 5)

    def show_value(self, loaded: LoadedSettings, *, in_job: bool) -> None:
        """Show the value in force, its source, and the default."""
        key, spec = self.spec.key, self.spec
        self._shown = value = loaded.values[key]
        text = _typed(spec, value)
        if self.choice is not None:
            self.choice.setCurrentIndex(spec.choices.index(text) if text in spec.choices else 0)
        elif self.switch is not None:
            self.switch.setChecked(bool(value))
            self.switch.setText(tr("Yes") if value else tr("No"))
        elif not self.field.hasFocus() or not self.field.isModified():
            self.field.setText(text)
            self.field.setModified(False)
        origin = loaded.origins[key]
        given = origin is SettingOrigin.COMMAND_LINE
        self.editor.setEnabled(not given)
        if self.find is not None:
            self.find.setEnabled(not given)
        differs = loaded.differs(key)
        self.reset.setVisible(differs and not given)
        self.mark.setText("●" if differs else "")
        self.mark.setAccessibleName(tr("Differs from the default") if differs else "")
        told = []
        if given:
            told.append(tr("Given at the start, which wins until OCMM is closed."))
        if differs:
            default = _default_words(spec)
            told.append(tr("Default: {default}.").format(default=default))
        if origin is SettingOrigin.STATION and spec.scope is Scope.USER:
            told.append(tr("Set for this station."))
        elif origin is SettingOrigin.USER and spec.scope is Scope.STATION:
            told.append(tr("Set for this user only."))
        told.append(f"{kit.said(spec.tip)}.")
        if in_job and spec.applies is Applies.REOPEN:
            told.append(tr("Used when the job is opened."))
        self._about = " ".join(told)
        self._show_message(self._about, fault=False)

    def set_text(self, text: str) -> None:
        self.field.setText(text)
        self.field.setModified(True)
        self._on_finished()

    def fault(self) -> str:
        """Return why the typed value is invalid; empty if valid."""
        return self.told.text() if self.told.property("role") == "bad" else ""

    def _on_typed(self, text: str) -> None:
        try:
            value_of_text(self.spec, text)
        except InputError as error:
            self._show_message(kit.said(error.what), fault=True)
        else:
            self._show_message(tr("Return takes it."), fault=False)

    def _on_finished(self) -> None:
        if not self.field.isModified():
            return
        try:
            value = value_of_text(self.spec, self.field.text())
        except InputError as error:
            self._show_message(kit.said(error.what), fault=True)
            return
        self.field.setModified(False)
        if value != self._shown:
            self._commit(value)
        else:
            self.field.setText(_typed(self.spec, value))
            self._show_message(self._about, fault=False)

    def _on_left(self) -> None:
        if self.field.isModified():
            self.field.setModified(False)
            self.field.setText(_typed(self.spec, self._shown))
            self._show_message(self._about, fault=False)
        else:
            self.left.emit()

    def _commit(self, value: Value) -> None:
        self.committed.emit(self.spec.key, value)

    def _show_message(self, text: str, *, fault: bool) -> None:
        kit.use_role(self.told, "bad" if fault else "muted")
        self.told.setText(text)
        self.told.setToolTip(kit.literal(text))


class _Field(kit.OwnKeysField):
    """F-keys act on the page; Esc first undoes typing."""

    given_keys = kit.F_KEYS


def _button(text: str, name: str) -> QPushButton:
    button = kit.dressed(kit.NarrowButton(text), name, font=kit.text_font(20))
    button.setToolTip(kit.literal(name))
    button.setFixedSize(QSize(HIGH_PX, HIGH_PX))
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button


def wide_button(text: str, role: str = "") -> QPushButton:
    """Return a button for a gloved finger."""
    font = kit.text_font(16)
    return kit.dressed(kit.NarrowButton(text), text, font=font, role=role, high=HIGH_PX)


def _typed(spec: SettingSpec, value: Value) -> str:
    text = text_of(value)
    return kit.localised(text) if spec.kind is Kind.NUMBER else text


def _with_unit(label: str, unit: str) -> str:
    return f"{label} [{unit}]" if unit else label


def _default_words(spec: SettingSpec) -> str:
    if spec.kind is Kind.KEYS:
        return tr("as shipped")
    text = _typed(spec, spec.default)
    if not text:
        return tr("empty")
    # Ends of paths are more informative.
    return text if len(text) <= _LONGEST else f"…{text[-_LONGEST:]}"


_LEAST_PX, _MOST_PX = 300, 1240
_A4 = 297.0 / 210.0
_SETTLE_MS = 300
"""Debounce of window resizing and of editors that write in pieces."""
_SAME_PX = 8


def draw_head(settings: Settings, width: int, tell: Teller) -> tuple[int, int, bytes]:
    """Draw the first page of an empty report; imports happen in the drawing process only.

    Returns width, height and pixels (``QImage.Format_RGB32``); errors as `use_head`.
    """
    from ocmm_gui.reports import template_page

    tell(later("Drawing the first page"), 0.5)
    page = template_page(settings, width)
    return page.width, page.height, page.content


class TemplatePreview(QWidget):
    """The page, or the error in the template: file, line, field, and remedy."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Preview of the report template"))
        self.words = kit.sentence_label(tr("State of the preview"), 14)
        self.page = kit.dressed(kit.PlainLabel(), tr("First page of a report"))
        self.page.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignHCenter)
        self.page.setMinimumSize(QSize(1, 1))
        kit.vbox(self.words, (self.page, 1), parent=self, margins=0)
        self.setMinimumWidth(_LEAST_PX)
        self._settings: Settings | None = None
        self._width = 0
        self._work = SideProcess(self, self._show, self._fail)
        self._settling = QTimer(self, singleShot=True, interval=_SETTLE_MS)
        self._settling.timeout.connect(self._draw)
        # Templates are edited with other programs.
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(lambda _path: self._settling.start())

    def follow(self, settings: Settings) -> None:
        """Show the page for settings, and again after changes of their template."""
        self._settings = settings
        self._settling.start()

    def is_drawing(self) -> bool:
        return self._settling.isActive() or self._work.is_running()

    def close_work(self) -> None:
        self._settling.stop()
        self._work.cancel()

    def showEvent(self, event: QShowEvent) -> None:
        """Draw changes made while hidden."""
        super().showEvent(event)
        if self._settings is not None:
            self._settling.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self._width and abs(self._room() - self._width) > _SAME_PX:
            self._settling.start()

    def _room(self) -> int:
        high = int(self.page.height() / _A4)
        return min(max(min(self.width(), high), _LEAST_PX), _MOST_PX)

    def _draw(self) -> None:
        if self._settings is None or not self.isVisible():
            return
        self._watch(self._settings.report_template)
        self._width = self._room()
        kit.use_role(self.words, "muted")
        self.words.setText(tr("Drawing the first page"))
        self._work.start(partial(draw_head, self._settings, self._width))

    def _watch(self, template: Path | None) -> None:
        # Replacing a file ends its watch.
        wanted = [] if template is None else [str(template.absolute())]
        old = self._watcher.files()
        if old != wanted:
            if old:
                self._watcher.removePaths(old)
            if wanted and Path(wanted[0]).exists():
                self._watcher.addPaths(wanted)

    def _show(self, answer: object) -> None:
        if isinstance(answer, tuple):
            width, height, content = answer
            image = QImage(content, width, height, QImage.Format.Format_RGB32)
            self.page.setPixmap(QPixmap.fromImage(image))
            self.words.setText(
                tr("First page of a report, nothing measured. It follows the settings.")
            )

    def _fail(self, error: object) -> None:
        if isinstance(error, OcmmError):
            # The previous page would be mistaken for this template's.
            self.page.clear()
            kit.use_role(self.words, "warn")
            self.words.setText("▲ " + kit.said(f"{error.what} {error.remedy}"))
