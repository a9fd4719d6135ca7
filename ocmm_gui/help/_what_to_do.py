"""What to do if: a page searchable by symptom or error code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import msgspec
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QHeaderView

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_gui.help._symptoms import SYMPTOMS
from ocmm_gui.kit import ActionInfo, DataTable, Sheet, Theme, form_field, later, said, text_font, tr

_KEYS = (ActionInfo("support", later("Support bundle"), later("Pack what support needs"), ("F6",)),)
_MOST_CODES = 60
_LEAST = 2
_LARGEST = 16 << 20


@dataclass(frozen=True, slots=True)
class Answer:
    """A search result: symptom, remedy, and codes."""

    sign: str
    steps: str
    codes: str


@dataclass(frozen=True, slots=True)
class Told:
    """Sentence of the core with a code, and whether it is a remedy."""

    sentence: str
    is_remedy: bool


class _Catalogue(msgspec.Struct, frozen=True):
    sentences: dict[str, list[str]]
    remedies: frozenset[str]


@cache
def told_by_code() -> dict[str, tuple[Told, ...]]:
    """Return the core's sentences by code, in the order of codes and file."""
    try:
        content = resource("i18n", "core.json").read_bytes()[:_LARGEST]
        found = msgspec.json.decode(content, type=_Catalogue)
    except (OSError, msgspec.MsgspecError, OcmmError):
        # The page still has its symptoms.
        return {}
    by_code: dict[str, list[Told]] = {}
    for sentence, codes in found.sentences.items():
        for code in codes:
            by_code.setdefault(code, []).append(Told(sentence, sentence in found.remedies))
    return {code: tuple(by_code[code]) for code in sorted(by_code)}


def answers(wanted: str) -> tuple[Answer, ...]:
    """Return lines for a query (all words, ignoring case; code prefixes): symptoms, sentences."""
    words = wanted.casefold().split()
    found = [
        Answer(tr(one.sign), tr(one.steps), ", ".join(one.codes))
        for one in SYMPTOMS
        if _has(f"{tr(one.sign)} {tr(one.steps)} {' '.join(one.codes)}", words)
        or any(_begins(word, one.codes) for word in words)
    ]
    if len("".join(words)) < _LEAST:
        return tuple(found)
    for code, told in told_by_code().items():
        if _has(f"{code} {' '.join(said(one.sentence) for one in told)}", words):
            what = [said(one.sentence) for one in told if not one.is_remedy]
            steps = [said(one.sentence) for one in told if one.is_remedy]
            found.append(Answer(_blank(" ".join(what)), _blank(" ".join(steps)), code))
        if len(found) >= _MOST_CODES:
            break
    return tuple(found)


def _has(text: str, words: list[str]) -> bool:
    folded = text.casefold()
    return all(word in folded for word in words)


def _begins(word: str, codes: tuple[str, ...]) -> bool:
    return "." in word and any(word.startswith(code) for code in codes if code.endswith("."))


def _blank(sentence: str) -> str:
    """Return a sentence with dots for names and numbers."""
    text, depth = "", 0
    for letter in sentence:
        if letter == "{":
            depth += 1
            text += "…" if depth == 1 else ""
        elif letter == "}":
            depth = max(depth - 1, 0)
        elif not depth:
            text += letter
    return text


class _AnswerTable(DataTable):
    def __init__(self) -> None:
        super().__init__(
            tr("Symptoms and remedies"),
            (
                (tr("What you see"), tr("symptom, or what the program says")),
                (tr("What to do"), tr("in this order")),
                (tr("Code"), tr("of errors and refusals")),
            ),
        )
        self._found: tuple[Answer, ...] = ()

    def show_answers(self, found: tuple[Answer, ...]) -> None:
        self._found = found
        self.setRowCount(len(found))
        for row, one in enumerate(found):
            self.show_words(row, (one.sign, one.steps, one.codes))
        self.resizeRowsToContents()

    def set_theme(self, theme: Theme) -> None:
        self._colours = theme
        self.show_answers(self._found)


class WhatToDoSheet(Sheet):
    """A search field and a table."""

    def __init__(self, support: Callable[[], None]) -> None:
        super().__init__(tr("What to do if"), _KEYS)
        self.field = form_field(tr("Search"), tr("a symptom, or the code of an error"))
        self.table = _AnswerTable()
        self.table.setWordWrap(True)
        self.table.setFont(text_font(15))
        self.table.setShowGrid(True)
        head = self.table.horizontalHeader()
        head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        head.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        head.setSectionResizeMode(2, QHeaderView.ResizeMode.ResizeToContents)
        # A scroll bar narrows the columns, and rows may need another line.
        head.sectionResized.connect(
            lambda _column, _before, _now: QTimer.singleShot(
                0, self.table, self.table.resizeRowsToContents
            )
        )
        self.body.addWidget(self.field)
        self.body.addWidget(self.table, 1)
        self.field.textChanged.connect(self.search)
        self.use_keys({"support": support})
        self.search("")

    def open(self, wanted: str = "") -> None:
        """Focus the field, with a query."""
        self.field.setText(wanted)
        self.field.setFocus()

    def search(self, wanted: str) -> None:
        found = answers(wanted)
        self.table.show_answers(found)
        self.say(tr("%n lines", "1 line", len(found)) if found else tr("Nothing found. Type less."))
