"""Documents of the manual, painted by Qt with headings as link targets, and places of pages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from PySide6.QtCore import Qt, QUrl, Signal
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontDatabase,
    QImage,
    QPalette,
    QTextBlock,
    QTextBlockFormat,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
    QTextFrameFormat,
    QTextLength,
    QTextTable,
)
from PySide6.QtWidgets import QTextBrowser, QTextEdit, QWidget

from ocmm_core.manual import ENGLISH, Chapter, Manual, Place, anchors_of, search_words, word_fits
from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, text_font, tr

PLACES = {
    # Start.
    "StartPage": "inspector/start.md#the-start-page",
    "PlanChoice": "inspector/start.md#choosing-a-plan",
    "FileBrowser": "inspector/start.md#opening-a-file",
    "SettingsPage": "inspector/settings.md#settings",
    "ManualSheet": "inspector/start.md#the-manual",
    "KeysSheet": "inspector/start.md#all-keys",
    # Measuring, and results.
    "DeskView": "inspector/inspecting.md#measure",
    "FarView": "inspector/inspecting.md#measure",
    "JobSheet": "inspector/inspecting.md#start-j",
    "PlanSheet": "inspector/plans.md#in-the-window",
    "AlignmentSheet": "inspector/inspecting.md#alignment-f5",
    "ResultsSheet": "inspector/inspecting.md#results-f3",
    "ReportSheet": "quality/exports.md#report-template-and-head",
    "CompareSheet": "quality/exports.md#a-batch",
    "ArchiveSheet": "quality/archive.md#questions",
    "RecallSheet": "quality/recall.md#recalculating",
    "WhatToDoSheet": "inspector/help.md#what-to-do-if-shiftf1",
    "CameraSheet": "integrator/cameras.md#set-up-a-camera",
    "SupportSheet": "inspector/help.md#support-bundle-ctrlb",
    "SecondScreenSheet": "inspector/second_screen.md#from-the-window",
    "AboutSheet": "inspector/help.md#about-ocmm-f10",
    # Maintain.
    "BusPage": "technician/wire.md#verdicts",
    "CalibrationPage": "technician/calibrating.md#the-page-of-the-cameras",
    "ProbePage": "technician/calibrating.md#the-page-of-the-probe",
    "TestsPage": "quality/acceptance.md#in-the-window",
    "AcceptanceDesk": "quality/acceptance.md#in-the-window",
    "ArtefactSheet": "quality/acceptance.md#artefacts",
    "StudySheet": "quality/msa.md#in-the-window",
    "ProbeDesignPage": "technician/probe_design.md#what-enters-the-uncertainty-of-a-point",
    "RigPlanPage": "technician/planning_a_rig.md#in-the-window",
    "FitsPage": "inspector/inspecting.md#are-the-fits-right",
    # Wizards, by their procedure.
    "DefinitionPage": "technician/wizards.md#defining-a-probe",
    "Wizard": "technician/wizards.md#in-the-wizards",
    "Wizard known-points": "technician/calibration.md#from-known-points",
    "Wizard relocation": "technician/calibration.md#relocation",
    "Wizard verification": "technician/calibration.md#verification",
    "Wizard tracker": "integrator/trackers.md#calibrate-and-verify-it",
    "Wizard pivot": "technician/probe_calibration.md#how-it-is-done",
    "Wizard qualification": "technician/tip.md#how-it-is-done",
    "Wizard tip-check": "technician/tip.md#how-it-is-done",
}
"""By the class of the page; for a wizard also by its procedure."""

FIRST = "inspector/start.md"


def place_of(page: QWidget | None) -> str:
    """Return the section that explains a page, as ``document.md#section``.

    Containers return the current page in ``page()``, pages of several kinds ``topic()``.
    """
    shown = page
    inner = getattr(shown, "page", None)
    if callable(inner):
        shown = inner()
    name = type(shown).__name__
    topic = getattr(shown, "topic", None)
    if callable(topic):
        found = PLACES.get(f"{name} {topic()}")
        if found is not None:
            return found
    return PLACES.get(name, FIRST)


_BODY_PX = 16
_LEAST_PX, _MOST_PX = 12, 30
_HEADINGS = {1: 1.7, 2: 1.35, 3: 1.12}
"""Relative to the text size, by level."""

_CODE = 0.94
_MARGIN_PX = 20
_HEADING_PX = 14.0
_WIDEST_PX = 980
"""Of a picture: lines of text stay as long as the page."""

_MOST_MARKS = 300
_GITHUB = (
    QTextDocument.MarkdownFeature.MarkdownDialectGitHub
    | QTextDocument.MarkdownFeature.MarkdownNoHTML
)


class DocumentView(QTextBrowser):
    """A document: arrows and page keys scroll, Tab and Return select and follow links."""

    link_wanted = Signal(str)
    """Emits the target of a link, as in the document."""

    def __init__(self, manual: Manual) -> None:
        super().__init__()
        self._manual = manual
        self._chapter: Chapter | None = None
        self._theme: Theme = THEMES[DEFAULT_THEME]
        self._pixels = _BODY_PX
        self._words: tuple[str, ...] = ()
        self.setAccessibleName(tr("Text of the manual"))
        self.setAccessibleDescription(tr("Tab goes to the next link, Return follows it"))
        # The manual resolves links; nothing is fetched from anywhere.
        self.setOpenLinks(False)
        self.setOpenExternalLinks(False)
        self.setUndoRedoEnabled(False)
        self.anchorClicked.connect(lambda url: self.link_wanted.emit(url.toString()))

    def show_place(self, place: Place, words: Sequence[str] = ()) -> None:
        """Show a section at the top, with the search words marked."""
        chapter = self._manual.chapter(place.document)
        if chapter is None:
            return
        if chapter is not self._chapter:
            self._chapter = chapter
            self._fill()
        self._words = tuple(words)
        self._mark()
        self.go_to(place.anchor)

    def go_to(self, anchor: str) -> None:
        """Scroll to a section; to the top if unknown."""
        block = next((block for name, block in self.headings() if name == anchor), None)
        bar = self.verticalScrollBar()
        if block is None:
            bar.setValue(0)
            return
        self.setTextCursor(QTextCursor(block))
        bar.setValue(round(self.document().documentLayout().blockBoundingRect(block).top()))

    def place(self) -> Place | None:
        """Return the section at the top of the view."""
        if self._chapter is None:
            return None
        top = self.verticalScrollBar().value() + _MARGIN_PX
        found = ""
        layout = self.document().documentLayout()
        for anchor, block in self.headings():
            if layout.blockBoundingRect(block).top() > top:
                break
            found = anchor
        return Place(self._chapter.name, found)

    def zoom(self, steps: int) -> None:
        """Change the text size, keeping the place."""
        pixels = min(max(self._pixels + 2 * steps, _LEAST_PX), _MOST_PX)
        if pixels != self._pixels:
            self._pixels = pixels
            self._fill_again()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._fill_again()

    def loadResource(self, kind: int, name: QUrl | str) -> Any:
        """Return a picture of the manual, no wider than the page; nothing from elsewhere."""
        link = name.toString() if isinstance(name, QUrl) else name
        if kind != QTextDocument.ResourceType.ImageResource.value or self._chapter is None:
            return None
        path = self._manual.picture(self._chapter.name, link)
        image = QImage() if path is None else QImage(str(path))
        if image.isNull():
            return None
        room = min(max(self.viewport().width() - 3 * _MARGIN_PX, 300), _WIDEST_PX)
        if image.width() <= room:
            return image
        return image.scaledToWidth(room, Qt.TransformationMode.SmoothTransformation)

    def _fill_again(self) -> None:
        if self._chapter is None:
            return
        place = self.place()
        self._fill()
        self._mark()
        if place is not None:
            self.go_to(place.anchor)

    def _fill(self) -> None:
        chapter = self._chapter
        if chapter is None:
            return
        theme = self._theme
        palette = self.palette()
        for role, colour in (
            (QPalette.ColorRole.Base, theme.panel), (QPalette.ColorRole.Text, theme.text),
            (QPalette.ColorRole.Link, theme.accent),
        ):  # fmt: skip
            palette.setColor(role, QColor(colour))
        self.setPalette(palette)
        document = self.document()
        document.clear()
        document.setDefaultFont(text_font(self._pixels))
        document.setDocumentMargin(_MARGIN_PX)
        document.setMarkdown(chapter.markdown, _GITHUB)
        self._dress()

    def _dress(self) -> None:
        theme, document = self._theme, self.document()
        cursor = QTextCursor(document)
        cursor.beginEditBlock()
        plain = text_font(self._pixels)
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        for block in _blocks(document):
            level = block.blockFormat().headingLevel()
            code = block.blockFormat().hasProperty(QTextFormat.Property.BlockCodeFence)
            cursor.setPosition(block.position())
            if cursor.currentTable() is None:
                cursor.setBlockFormat(self._spaced(block.blockFormat(), level, code=code))
            for first, length, had in _runs(block):
                style = QTextCharFormat(had)
                is_code = code or had.fontFixedPitch()
                font = QFont(fixed if is_code else plain)
                share = _HEADINGS.get(level, _CODE if is_code else 1.0)
                font.setPixelSize(round(self._pixels * share))
                font.setBold(bool(level) or had.fontWeight() > QFont.Weight.Medium)
                font.setItalic(had.fontItalic())
                style.setFont(font)
                style.setForeground(QColor(theme.accent if had.isAnchor() else theme.text))
                style.setFontUnderline(had.isAnchor())
                if is_code and not level:
                    style.setBackground(QColor(theme.background))
                cursor.setPosition(first)
                cursor.setPosition(first + length, QTextCursor.MoveMode.KeepAnchor)
                cursor.setCharFormat(style)
        for frame in document.rootFrame().childFrames():
            if isinstance(frame, QTextTable):
                self._dress_table(frame)
        cursor.endEditBlock()

    def _spaced(self, had: QTextBlockFormat, level: int, *, code: bool) -> QTextBlockFormat:
        """Return the format of a paragraph with margins; long lines of code wrap."""
        style = QTextBlockFormat(had)
        style.setNonBreakableLines(False)
        style.setTopMargin(_HEADING_PX if level > 1 else 0.0)
        style.setBottomMargin(0.0 if code else 0.4 * self._pixels)
        return style

    def _dress_table(self, table: QTextTable) -> None:
        style = table.format()
        style.setBorder(1.0)
        style.setBorderCollapse(True)
        style.setBorderBrush(QColor(self._theme.border))
        style.setBorderStyle(QTextFrameFormat.BorderStyle.BorderStyle_Solid)
        style.setCellPadding(5.0)
        style.setCellSpacing(0.0)
        style.setTopMargin(6.0)
        style.setBottomMargin(10.0)
        style.setWidth(QTextLength(QTextLength.Type.PercentageLength, 100.0))
        table.setFormat(style)

    def _mark(self) -> None:
        """Mark the search words at starts of words, in German also inside."""
        text = " ".join(self._words)
        # Qt distinguishes "ss" and "ß".
        words = (*search_words(text), *(word for word in text.lower().split() if "ß" in word))
        joins = self._chapter is not None and self._chapter.language != ENGLISH
        marks: list[QTextEdit.ExtraSelection] = []
        style = QTextCharFormat()
        style.setBackground(QColor(self._theme.zone_warn))
        style.setForeground(QColor(self._theme.text))
        document = self.document()
        for word in words:
            inside = word_fits(f"x{word}", word, joins=joins)
            at = QTextCursor(document)
            while len(marks) < _MOST_MARKS:
                at = document.find(word, at)
                if at.isNull():
                    break
                before = document.characterAt(at.selectionStart() - 1)
                if before.isalnum() and not inside:
                    continue
                mark = QTextEdit.ExtraSelection()
                mark.cursor = at
                mark.format = style
                marks.append(mark)
        self.setExtraSelections(marks)

    def marked(self) -> int:
        return len(self.extraSelections())

    def headings(self) -> Iterator[tuple[str, QTextBlock]]:
        """Yield the anchor of every heading, with its block."""
        blocks = [one for one in _blocks(self.document()) if one.blockFormat().headingLevel()]
        # Anchors of a German page are the English ones.
        anchors = {} if self._chapter is None else self._chapter.anchors_by_heading()
        for shown, block in zip(anchors_of(one.text() for one in blocks), blocks, strict=True):
            yield anchors.get(shown, shown), block


def _blocks(document: QTextDocument) -> Iterator[QTextBlock]:
    block = document.begin()
    while block.isValid():
        yield block
        block = block.next()


def _runs(block: QTextBlock) -> list[tuple[int, int, QTextCharFormat]]:
    """Return start, length and format of each run."""
    found = []
    turn = block.begin()
    while not turn.atEnd():
        fragment = turn.fragment()
        if fragment.isValid() and not fragment.charFormat().isImageFormat():
            found.append((fragment.position(), fragment.length(), fragment.charFormat()))
        turn += 1
    return found
