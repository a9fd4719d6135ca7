"""Every sentence of the window can be translated: in the sources, for `lupdate`, on the screen."""

from __future__ import annotations

import html
import re
import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QTranslator
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QListWidget,
    QTableWidget,
    QWidget,
)
from pytestqt.qtbot import QtBot

from docs.make_texts import LUPDATE, extract
from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.features.measured import Convention
from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.evaluation import NO_REAL_PART, job_states
from ocmm_core.inspection.recall import COLUMNS
from ocmm_core.station import NO_BUS, NO_BUS_REMEDY
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_gui.kit import ACTIONS, FitText, Mode, later, shape_word, tr, tr_all
from tests.gui.window_sentences import bare, marked
from tests.host import HANG_MS, needs_tools

if TYPE_CHECKING:
    from tests.gui.conftest import Bench, OpenWindow


def test_no_sentence_stands_outside_the_calls_that_translate_it() -> None:
    assert not bare()


def test_a_sentence_is_translated_when_it_is_used_and_whole() -> None:
    """`lupdate` takes literals only, and none out of an f-string; a table is read too early."""
    calls = marked()
    assert len(calls) > 1500
    for call in calls:
        where = f"{call.file}:{call.line}"
        if call.sentence is None:
            assert call.mark == "tr", where
            assert "JoinedStr" not in type(call.node.args[0]).__name__, where
        else:
            assert not call.in_braces, where
        assert call.mark == "later" or not call.at_import, where


def test_what_is_filled_in_has_the_name_that_the_sentence_gives_it() -> None:
    filled = [call for call in marked() if call.filled is not None and call.sentence is not None]
    assert len(filled) > 150
    for call in filled:
        assert call.sentence is not None
        assert _names(call.sentence) == call.filled, f"{call.file}:{call.line}"


_COUNTED = re.compile(r"(%n|\{\w+(?::[^{}]*)?\}) ((?:[a-z-]+ )??)([A-Za-z]+s)\b")
_MANY = (
    # Two parts, operators and trials are the least.
    "{name}: {parts} parts, {operators} operators, {trials} trials",
    # No probe has fewer than three LEDs, no alignment by faces fewer than six points.
    "%n poses, {leds} LEDs; drag to rotate",
    "Aligned by %n faces; {count} points added. F10 undoes this.",
)
"""Sentences whose count is never one, with the reason."""


def test_what_is_counted_has_a_sentence_for_one() -> None:
    sentences = [(call, call.sentence) for call in marked() if call.sentence is not None]
    counted = [
        (call, found[3])
        for call, text in sentences
        for found in _COUNTED.finditer(text)
        if found[1] == "%n"
    ]
    nouns = {noun for _, noun in counted}
    assert {"points", "jobs", "LEDs", "frames"} <= nouns
    assert not [f"{call.file}:{call.line}" for call, _ in counted if not call.comment]
    left = {
        f"{call.file}:{call.line}: {text}"
        for call, text in sentences
        for found in _COUNTED.finditer(text)
        if found[1] != "%n"
        and found[3] in nouns
        and text not in _MANY
        # "1 of 3 faces" stays right with one.
        and not text[: found.start()].endswith(" of ")
    }
    assert not left


def test_lupdate_finds_every_sentence(tmp_path: Path) -> None:
    needs_tools(LUPDATE)
    target = tmp_path / "window.ts"
    extract(target)
    found = set()
    for message in re.findall(r"<message.*?</message>", target.read_text(), re.DOTALL):
        (source,) = re.findall(r"<source>(.*?)</source>", message, re.DOTALL)
        comments = re.findall(r"<comment>(.*?)</comment>", message, re.DOTALL)
        found.add((html.unescape(source), html.unescape("".join(comments))))
    assert found == {
        (call.sentence, call.comment) for call in marked() if call.sentence is not None
    }


def test_lupdate_warns_of_what_it_cannot_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_tools(LUPDATE)
    (tmp_path / "ocmm_gui").mkdir()
    (tmp_path / "ocmm_gui" / "broken.py").write_text('tr("one"\n')
    monkeypatch.setattr("docs.make_texts.ROOT", tmp_path)
    with pytest.raises(ValueError, match="parentheses"):
        extract(tmp_path / "window.ts")


_WORDS = re.compile(r"[^\W\d_]{2,}")


class Bracketed(QTranslator):
    """Puts every sentence into brackets, as a translation that has all of them."""

    def translate(
        self, context: str, sentence: str, comment: str | None = None, count: int = -1
    ) -> str:
        """Return a sentence in brackets."""
        return f"⟦{sentence}⟧" if sentence else ""

    def isEmpty(self) -> bool:
        """Return that there is something in it."""
        return False


@pytest.fixture
def bracketed(qapp: QApplication) -> Iterator[None]:
    """Install the translation in brackets for one test."""
    translator = Bracketed()
    qapp.installTranslator(translator)
    yield
    qapp.removeTranslator(translator)


def test_without_a_translation_a_sentence_is_as_it_is() -> None:
    assert tr("Take a point now") == "Take a point now"
    assert tr("%n outliers.", "1 outlier.", 1) == "1 outlier."
    assert tr("%n outliers.", "1 outlier.", 3) == "3 outliers."
    assert tr("%n outliers.", "1 outlier.", 0) == "0 outliers."


@pytest.mark.usefixtures("bracketed")
def test_a_sentence_is_translated_at_its_use_and_counted() -> None:
    marked_only = later("Take")
    assert marked_only == "Take"
    assert tr(marked_only) == "⟦Take⟧"
    assert tr_all((("Take", "now"), ("Undo", ""))) == (("⟦Take⟧", "⟦now⟧"), ("⟦Undo⟧", ""))
    assert tr("%n outliers.", "1 outlier.", 3) == "⟦3 outliers.⟧"
    # A language has its own sentence for one.
    assert tr("%n outliers.", "1 outlier.", 1) == "⟦1 outliers.⟧"
    assert ACTIONS[0].text == "Take"


@pytest.mark.usefixtures("bracketed")
def test_every_text_of_the_main_pages_is_translated(open_window: OpenWindow, qtbot: QtBot) -> None:
    bench = open_window(stay=True)
    window = bench.window
    sheets, maintenance = window.sheets, window.maintenance
    bench.wait_complete(qtbot)
    qtbot.waitUntil(lambda: bench.bridge.shown.job.part_verdict.complete, timeout=HANG_MS)
    left: dict[str, set[str]] = {"desk": _left(window)}
    window.show_far(True)
    left["far"] = _left(window.far)
    opened: dict[str, Callable[[], None]] = {
        "results": partial(sheets.show_sheet, "results"),
        "job": sheets.open_job,
        "plan": partial(sheets.show_sheet, "plan"),
        "alignment": partial(sheets.show_sheet, "alignment"),
        "keys": partial(sheets.show_sheet, "keys"),
    }
    for name, open_sheet in opened.items():
        open_sheet()
        qtbot.wait(200)
        left[name] = _left(getattr(sheets, name))
    window.show_mode(Mode.MAINTAIN)
    for row in range(maintenance.view.list.count()):
        maintenance.view.list.setCurrentRow(row)
        left[f"maintain {row}"] = _left(maintenance.view)
    sheets.show_sheet("recall")
    left["recall"] = _left(sheets.recall)
    for kind in ProcedureKind:
        maintenance.open_wizard(kind)
        left[kind.value] = _left(maintenance.wizard)
    maintenance.open_definition()
    left["definition"] = _left(maintenance.definition)
    qtbot.waitUntil(lambda: not sheets.results.detail.is_busy(), timeout=HANG_MS)
    # Texts of the core and names by users are no texts of the window.
    core = sorted(_core_words(bench), key=len, reverse=True)
    assert {page: bad for page, texts in left.items() if (bad := _without_words(texts, core))} == {}


_KEYS = re.compile(
    r"\b(Shift\+|Ctrl\+)?"
    r"(Space|Backspace|Return|Enter|PgUp|PgDown|Pause|Home|Del|Ins|Esc|[FRYKHP]\d*)\b|Ctrl\+,"
)
_HASH = re.compile(r"\b[0-9a-f]{12}\b")


def _without_words(texts: set[str], words: Sequence[str]) -> set[str]:
    """Return the texts with more than the given words, keys and translated sentences."""
    bad = set()
    for text in texts:
        rest = _HASH.sub("", _KEYS.sub("", _without(text)))
        for word in words:
            rest = rest.replace(word, "")
        if _WORDS.search(rest):
            bad.add(text)
    return bad


def _core_words(bench: Bench) -> set[str]:
    """Return all texts and names given to the window by the core, and its words."""
    station, job = bench.bridge.station, bench.bridge.shown.job
    instruments = station.instruments
    sheets = bench.window.sheets
    # A side process calculates the budget, at any time.
    table = sheets.results.detail.budget
    cells = [
        table.item(row, column)
        for row in range(table.rowCount())
        for column in range(table.columnCount())
    ]
    budget = [text for cell in cells if cell for text in (cell.text(), cell.toolTip())]
    plan_words = {
        box.itemText(index)
        for box in (*sheets.plan.findChildren(QComboBox), sheets.job.plans)
        for index in range(box.count())
    }
    return {
        text
        for text in (
            *_strings(job), *_strings(station.job.plan), *_strings(station.looks.live()),
            *_strings(instruments.rig), *_strings(instruments.body),
            *_strings(instruments.calibration()), *_strings(instruments.probe()),
            *(one.name for one in Convention), *_strings((*Verdict, *PartWord)),
            *(shape_word(shape) for shape in Shape), *COLUMNS, *plan_words,
            *(result.caution for result in job.characteristics), *job_states(job),
            *_strings(budget), NO_REAL_PART, NO_BUS, NO_BUS_REMEDY, "quick.toml",
        )
        if _WORDS.search(text)
    }  # fmt: skip


def _strings(value: object) -> Iterator[str]:
    """Return every text in a value of the core, however deep."""
    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for item in value.items():
            yield from _strings(item)
    elif isinstance(value, Sequence | frozenset):
        for item in value:
            yield from _strings(item)
    else:
        names = getattr(value, "__dataclass_fields__", ()) or getattr(
            value, "__struct_fields__", ()
        )
        for name in names:
            yield from _strings(getattr(value, name))


def _left(page: QWidget) -> set[str]:
    """Return the texts of a page with words outside all brackets."""
    return {text for text in _texts(page) if _WORDS.search(_without(text))}


def _without(text: str) -> str:
    """Return the text outside all brackets."""
    inside = None
    while inside != text:
        inside, text = text, re.sub(r"⟦[^⟦⟧]*⟧", "", text)
    return text


def _texts(page: QWidget) -> Iterator[str]:
    for widget in (page, *page.findChildren(QWidget)):
        yield widget.toolTip()
        yield widget.accessibleName()
        yield widget.accessibleDescription()
        yield from _shown(widget)
        for action in widget.actions():
            yield from (action.text(), action.toolTip())


def _shown(widget: QWidget) -> Iterator[str]:
    match widget:
        case QLabel() | QAbstractButton() | FitText():
            yield widget.text()
        case QLineEdit():
            yield widget.placeholderText()
        case QComboBox():
            yield from (widget.itemText(index) for index in range(widget.count()))
        case QListWidget():
            yield from (widget.item(row).text() for row in range(widget.count()))
        case QTableWidget():
            for column in range(widget.columnCount()):
                head = widget.horizontalHeaderItem(column)
                cells = (widget.item(row, column) for row in range(widget.rowCount()))
                for item in (head, *cells):
                    if item is not None:
                        yield from (item.text(), item.toolTip())
        case _:
            pass


def _names(sentence: str) -> frozenset[str]:
    found = set()
    for _, name, form, _ in string.Formatter().parse(sentence):
        if name is not None:
            found.add(name)
            found |= _names(form or "")
    return frozenset(found)
