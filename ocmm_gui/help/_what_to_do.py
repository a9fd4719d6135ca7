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
from ocmm_gui.kit import (
    ActionInfo,
    DataTable,
    Sheet,
    Theme,
    form_field,
    later,
    said,
    text_font,
    tr,
)

_KEYS = (ActionInfo("support", later("Support bundle"), later("Pack what support needs"), ("F6",)),)
_MOST_CODES = 60
_IMPERATIVES = frozenset(
    [
        "add",
        "adjust",
        "allow",
        "ask",
        "assign",
        "avoid",
        "calibrate",
        "change",
        "check",
        "choose",
        "clean",
        "clear",
        "close",
        "complete",
        "connect",
        "continue",
        "convert",
        "copy",
        "correct",
        "cover",
        "create",
        "define",
        "delete",
        "do",
        "drag",
        "enter",
        "export",
        "fit",
        "free",
        "get",
        "give",
        "go",
        "hold",
        "import",
        "increase",
        "install",
        "join",
        "keep",
        "leave",
        "let",
        "load",
        "log",
        "look",
        "lower",
        "make",
        "measure",
        "mount",
        "move",
        "name",
        "open",
        "pause",
        "place",
        "plug",
        "point",
        "press",
        "probe",
        "put",
        "qualify",
        "re-probe",
        "read",
        "reboot",
        "recalculate",
        "reconnect",
        "record",
        "reduce",
        "register",
        "relocate",
        "remove",
        "rename",
        "repair",
        "repeat",
        "replace",
        "restart",
        "restore",
        "resume",
        "retake",
        "run",
        "save",
        "see",
        "select",
        "send",
        "set",
        "shorten",
        "show",
        "sign",
        "start",
        "state",
        "stop",
        "support",
        "sweep",
        "switch",
        "take",
        "touch",
        "try",
        "turn",
        "type",
        "undo",
        "update",
        "use",
        "verify",
        "wait",
        "warm",
        "write",
    ]
)
"""First words of remedies: the catalogue does not tell them from what they remedy."""
_LEAST = 2
_LARGEST = 16 << 20


@dataclass(frozen=True, slots=True)
class Answer:
    """A line that was found: what is seen, what to do, and the codes of it."""

    sign: str
    steps: str
    codes: str


class _Catalogue(msgspec.Struct, frozen=True):
    sentences: dict[str, list[str]]


@cache
def error_sentences() -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return what the core says with a code: sentence and remedy, in the order of the file."""
    try:
        content = resource("i18n", "core.json").read_bytes()[:_LARGEST]
        found = msgspec.json.decode(content, type=_Catalogue).sentences
    except (OSError, msgspec.MsgspecError, OcmmError):
        # The page has its symptoms without it.
        return ()
    return tuple((sentence, tuple(codes)) for sentence, codes in found.items() if codes)


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
    by_code: dict[str, list[str]] = {}
    for sentence, codes in error_sentences():
        for code in codes:
            by_code.setdefault(code, []).append(sentence)
    for code, sentences in sorted(by_code.items()):
        if _has(f"{code} {' '.join(map(said, sentences))}", words):
            what = [said(one) for one in sentences if one.split(" ")[0].lower() not in _IMPERATIVES]
            steps = [said(one) for one in sentences if one.split(" ")[0].lower() in _IMPERATIVES]
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
