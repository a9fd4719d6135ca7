"""What to do if: a page that is searched by symptom or by the code of an error."""

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
    """A line that was found: what is seen, what to do, and the codes of it."""

    sign: str
    steps: str
    codes: str


@dataclass(frozen=True, slots=True)
class Told:
    """What the core says with a code: a sentence, and whether it says what to do."""

    sentence: str
    is_remedy: bool


class _Catalogue(msgspec.Struct, frozen=True):
    sentences: dict[str, list[str]]
    remedies: frozenset[str]


@cache
def told_by_code() -> dict[str, tuple[Told, ...]]:
    """Return what the core says with each code, in the order of the codes and of the file."""
    try:
        content = resource("i18n", "core.json").read_bytes()[:_LARGEST]
        found = msgspec.json.decode(content, type=_Catalogue)
    except (OSError, msgspec.MsgspecError, OcmmError):
        # The page has its symptoms without it.
        return {}
    by_code: dict[str, list[Told]] = {}
    for sentence, codes in found.sentences.items():
        for code in codes:
            by_code.setdefault(code, []).append(Told(sentence, sentence in found.remedies))
    return {code: tuple(by_code[code]) for code in sorted(by_code)}


def answers(wanted: str) -> tuple[Answer, ...]:
    """Return the lines for what somebody typed: symptoms first, then what the core says.

    Every word must be in the line, whatever its case; a code finds what it begins.
    """
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
    """Return a sentence with dots where names and numbers are filled in."""
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
    """Sign, remedy and code of what was found."""

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
        """Show what was found, and nothing else."""
        self._found = found
        self.setRowCount(len(found))
        for row, one in enumerate(found):
            self.show_words(row, (one.sign, one.steps, one.codes))
        self.resizeRowsToContents()

    def set_theme(self, theme: Theme) -> None:
        """Write in the colours of ``theme`` from now on."""
        self._colours = theme
        self.show_answers(self._found)


class WhatToDoSheet(Sheet):
    """A field and a table; what is typed narrows the table.

    Parameters
    ----------
    support
        Opens the page of the support bundle.
    """

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
        # A bar at the side takes from the columns, and a row may need another line then.
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
        """Give the field the keyboard, with what is looked for."""
        self.field.setText(wanted)
        self.field.setFocus()

    def search(self, wanted: str) -> None:
        """Show what fits."""
        found = answers(wanted)
        self.table.show_answers(found)
        self.say(tr("%n lines", "1 line", len(found)) if found else tr("Nothing found. Type less."))
