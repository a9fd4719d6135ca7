"""All pages of the window, their cut texts, and a pseudo language with the longest sentences."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QPoint, QRect, QTranslator
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton, QScrollBar, QWidget

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.settings import SECTIONS
from ocmm_gui.kit import FitText, Mode, NarrowButton, is_longer
from ocmm_gui.kit._narrow import FittedText
from ocmm_gui.window import MainWindow
from tests.gui.cut_words import cut_words, shown_widgets

_SLACK_PX = 2
TURNS = 50
"""In which a page comes to rest; half a second."""

_LONGER = 1.4
_KEPT = re.compile(r"(\{[^{}]*\}|%n|\n|\s+)")
_VOWELS = str.maketrans("aeiouAEIOU", "äéîöûÄÉÎÖÛ")


@runtime_checkable
class _Fits(Protocol):
    def fits(self) -> bool: ...


@runtime_checkable
class _Fitted(Protocol):
    def fitted(self) -> FittedText | None: ...


def fits(widget: QWidget) -> bool:
    """Return whether a widget paints all its text."""
    if isinstance(widget, _Fitted):
        return is_longer() and widget.fitted() is not None
    return isinstance(widget, _Fits) and widget.fits()


class Pseudo(QTranslator):
    """Makes every sentence 40 % longer, word by word, with letters that English does not have."""

    def translate(
        self, context: str, sentence: str, comment: str | None = None, count: int = -1
    ) -> str:
        """Return a longer sentence with everything that is filled in."""
        return longer(sentence)

    def isEmpty(self) -> bool:
        """Return that there is something in it."""
        return False


def longer(sentence: str) -> str:
    """Return a sentence 40 % longer, with the same fields and line ends."""
    owed, words = 0.0, []
    for word in _KEPT.split(sentence):
        if not word or _KEPT.fullmatch(word):
            words.append(word)
            continue
        owed += (_LONGER - 1.0) * len(word)
        more = int(owed)
        owed -= more
        # Vowels are what languages have more of.
        words.append(word.translate(_VOWELS) + ("eno" * more)[:more])
    return "".join(words)


def pages(window: MainWindow) -> Iterator[tuple[str, Callable[[], None]]]:
    """Give every page of the window with how it is opened."""
    sheets, maintenance = window.sheets, window.maintenance
    yield "desk", lambda: window.show_far(False)
    yield "far", lambda: window.show_far(True)
    yield "job", sheets.open_job
    yield "plan", partial(sheets.show_sheet, "plan")
    yield "results", partial(sheets.show_sheet, "results")
    yield "keys", partial(sheets.show_sheet, "keys")
    yield "what to do", sheets.open_what_to_do
    yield "support", partial(sheets.show_sheet, "support")
    yield "about", partial(sheets.show_sheet, "about")
    for sheet in (sheets.report, sheets.batch, sheets.alignment):
        yield sheet.accessibleName(), partial(sheets.wanted.emit, sheet)
    for kind in ProcedureKind:
        yield kind.name, partial(maintenance.open_wizard, kind)
    yield "definition", maintenance.open_definition
    yield "settings", partial(sheets.show_sheet, "settings")
    # After the sections come the keys and the test of sounds.
    for number in range(len(SECTIONS) + 2):
        yield f"settings {number}", partial(sheets.settings.show_section, number)
    yield "recall", partial(sheets.show_sheet, "recall")
    yield "archive", partial(sheets.show_sheet, "archive")
    if window.tests.bench is not None:
        calls = window.tests.calls()
        for key in ("acceptance", "artefacts", "study"):
            yield key, calls[key]
    window.show_mode(Mode.MAINTAIN)
    for row in range(maintenance.view.list.count()):

        def open_page(row: int = row) -> None:
            window.show_mode(Mode.MAINTAIN)
            maintenance.view.list.setCurrentRow(row)

        yield f"Maintain {row}", open_page


def faults(window: QWidget) -> Iterator[str]:
    """Yield the cut texts of a window."""
    for widget in shown_widgets(window):
        room, metrics = widget.contentsRect(), widget.fontMetrics()
        if isinstance(widget, QLabel) and widget.text():
            if fits(widget):
                continue
            if widget.wordWrap():
                need = widget.heightForWidth(widget.width())
                if need > widget.height() + _SLACK_PX:
                    yield f"{widget.text()!r} needs {need} px of height, has {widget.height()}"
            elif widget.sizeHint().width() > widget.width() + _SLACK_PX:
                yield f"{widget.text()!r} needs {widget.sizeHint().width()}, has {widget.width()}"
        elif isinstance(widget, NarrowButton) and widget.text():
            if widget.fitted() is None:
                yield f"button {widget.text()!r} has {room.width()} px"
        elif isinstance(widget, QPushButton) and widget.text():
            box = metrics.boundingRect(QRect(0, 0, 2000, 200), 0, widget.text())
            if box.width() > room.width() - 4 or box.height() > room.height():
                yield f"button {widget.text()!r} needs {box.width()} px, has {room.width()}"
        elif isinstance(widget, QLineEdit) and not widget.text():
            need = metrics.horizontalAdvance(widget.placeholderText())
            if need > room.width() - 8 and not fits(widget):
                yield f"hint {widget.placeholderText()!r} needs {need} px, has {room.width()}"
        elif isinstance(widget, FitText) and widget.text() and not fits(widget):
            yield f"line {widget.text()!r} has {room.width()} px at its least size"
    yield from cut_words(window)


def walk(
    window: MainWindow,
    app: QApplication,
    themes: tuple[str, ...],
    sizes: tuple[tuple[int, int], ...],
    *,
    scrolled: bool = False,
    look: Callable[[QWidget], Iterator[str]] | None = None,
) -> list[str]:
    """Return the cut texts of all pages, in all themes, at all sizes.

    Parameters
    ----------
    window
        Its last page stays open.
    app
        Its events are processed.
    themes, sizes
        All combinations.
    scrolled
        Pages may be scrolled as a whole: enlarged, or for gloves.
    look
        Finds other faults than cut texts.
    """
    look = look or faults
    found = []
    # A theme costs more than a page: it is changed seldom.
    for theme in themes:
        window.use_theme(theme)
        for size in sizes:
            window.resize(*size)
            for name, open_page in pages(window):
                open_page()
                # The layout settles in one turn of the event loop, its consequences in a second
                # one; data read by a thread may come between. Cut texts persist.
                left: list[str] = []
                for _ in range(TURNS):
                    app.processEvents()
                    left = list(look(window))
                    if not left:
                        break
                    time.sleep(0.01)
                if window.area.scrolls() and not scrolled:
                    content = window.area.widget()
                    assert content is not None
                    room = content.minimumSizeHint()
                    left.append(f"the page needs {room.width()} x {room.height()} px")
                found += [f"{name}, {theme}, {size[1]} px: {fault}" for fault in left]
    return found


def covered(window: QWidget) -> Iterator[str]:
    """Give what covers something else: widgets without children that overlap."""
    leaves = [
        widget
        for widget in shown_widgets(window)
        if not isinstance(widget, QScrollBar)
        and not any(child.isVisible() for child in widget.findChildren(QWidget))
    ]
    places = [
        (one, one.visibleRegion().boundingRect().translated(one.mapTo(window, QPoint(0, 0))))
        for one in leaves
    ]
    for index, (one, place) in enumerate(places):
        for other, room in places[index + 1 :]:
            both = place.intersected(room)
            if min(both.width(), both.height()) > _SLACK_PX:
                names = [f"{type(w).__name__} {w.accessibleName()!r}" for w in (one, other)]
                yield f"{' and '.join(names)} overlap by {both.width()} x {both.height()} px"
