"""What to do if: a page searchable by symptom, in the inspector's words, or error code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import islice

import msgspec
from PySide6.QtCore import QTimer

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_gui import kit
from ocmm_gui.kit import later, tr


@dataclass(frozen=True, slots=True)
class Symptom:
    sign: str
    steps: str
    codes: tuple[str, ...] = ()
    """Prefixes of related error and refusal codes."""


SYMPTOMS = (
    Symptom(
        later("LOST: the cameras do not see the probe"),
        later("Turn the LEDs to the cameras. Follow the arrow beside the readout. Move hand, cable "
              "and part out of the line of sight. Check that the probe is switched on."),
        ("lost", "tracking.targets"),
    ),
    Symptom(
        later("LOST: LED identification is ambiguous"),
        later("Turn the probe so that all LEDs face both cameras. Cover reflections. Check that "
              "the probe in Settings is the one in your hand."),
        ("unidentified", "tracking.open"),
    ),
    Symptom(
        later("INACCURATE: the position uncertainty is too large"),
        later("Follow the hint beside the readout. Show more LEDs to both cameras. Move the part "
              "to the middle of the measuring volume."),
        ("uncertain",),
    ),
    Symptom(
        later("INACCURATE: the spots do not fit the probe"),
        later("Cover reflections and lamps. Check that the right probe is chosen. Look for a bent "
              "or knocked probe. If it stays, verify the cameras."),
        ("doubtful",),
    ),
    Symptom(
        later("INACCURATE: the ball is outside the calibrated volume"),
        later("Move the part into the measuring volume; the small picture of the 3-D view shows "
              "it."),
        ("outside",),
    ),
    Symptom(
        later("No point: the probe moved"),
        later("Rest the ball on the surface, hold still until the tone, then pull away along the "
              "normal. Steady your arm."),
        ("moving", "gap"),
    ),
    Symptom(
        later("No point: the side of the material is not known"),
        later("Approach along the normal and pull back the same way. Press I to choose how the "
              "side is found, X to flip the last point."),
        ("no_approach",),
    ),
    Symptom(
        later("No point: the touch came from another face"),
        later("Touch the feature square to its surface. If its earlier points are wrong, undo "
              "them first: Backspace."),
        ("wrong_face",),
    ),
    Symptom(
        later("No point: no feature, or several, fit the touch"),
        later("Choose the feature in the list, or switch to plan order with O. Check the "
              "alignment: F5."),
        ("no_feature", "ambiguous"),
    ),
    Symptom(
        later("No point: the job is paused"), later("Press Z to resume, then touch again."),
        ("paused",),
    ),
    Symptom(
        later("NO POINTS: the calibration of the cameras forbids it"),
        later("Read the sentence at the top. Expired or knocked: Maintain, Verify or Relocate. "
              "UNCALIBRATED results are not proven."),
        ("calibration", "rig.", "records."),
    ),
    Symptom(
        later("NO POINTS: the tip must be checked"),
        later("Maintain, Check tip: it takes a minute. After a blow or a change of the tip qualify "
              "it on the sphere."),
        ("tip", "probe."),
    ),
    Symptom(
        later("NOT READY: no new frames from the cameras"),
        later("Check power and network cables of the cameras. Maintain, Bus shows which camera is "
              "missing. Wait until all are in operation."),
        ("not_ready", "bus.", "acquisition.", "camera."),
    ),
    Symptom(
        later("The reference body is lost or has moved"),
        later("Clear the line of sight to its LEDs. Let part and cameras come to rest. It must not "
              "be moved against the part."),
        ("reference",),
    ),
    Symptom(
        later("NOT STORED: points cannot be saved"),
        later("Free disk space or connect the disk again. Points that are shown as taken are safe. "
              "Open the job again from the Start page."),
        ("storage", "job.", "recording.disk_full", "out."),
    ),
    Symptom(
        later("FAILED: a part of the program stopped"),
        later("All points taken are saved. Open the job again: Start page, Continue. If it fails "
              "again, write a support bundle."),
        ("internal.",),
    ),
    Symptom(
        later("Results: NOT PROVEN"),
        later("The value lies within U of the limit. Select it in Results to see what makes U "
              "large; more points, or a better attitude of the probe, make it smaller."),
        ("evaluation.",),
    ),
    Symptom(
        later("The plan cannot be opened"),
        later("Read which line or field the message names. Open the plan in the editor (F4), which "
              "marks what is wrong."),
        ("plan.", "document.", "step."),
    ),
    Symptom(
        later("A report cannot be written"),
        later("Choose a folder that can be written. Close the file in the other program, then "
              "press E again."),
        ("export.", "report."),
    ),
    Symptom(
        later("A setting has no effect"),
        later("Settings shows when a change applies: at once, or when the job is opened again."),
        ("settings.",),
    ),
    Symptom(
        later("The archive does not answer"),
        later("Nothing is lost: jobs wait in the outbox. Check the network and the address in "
              "Settings, Archive."),
        ("archive.", "outbox."),
    ),
    Symptom(
        later("The picture stutters or frames are late"),
        later("Close other programs. Let a technician run the doctor of this computer; Maintain, "
              "Bus shows late and lost cycles."),
        ("doctor.",),
    ),
)  # fmt: skip
"""By frequency."""


_KEYS = (
    kit.ActionInfo("support", later("Support bundle"), later("Pack what support needs"), ("F6",)),
)
_MOST_CODES = 60
_LEAST = 2
_LARGEST = 16 << 20


@dataclass(frozen=True, slots=True)
class RemedyEntry:
    """A search result: symptom, remedy, and codes."""

    sign: str
    steps: str
    codes: str


@dataclass(frozen=True, slots=True)
class CodedSentence:
    """Sentence of the core with a code, and whether it is a remedy."""

    sentence: str
    is_remedy: bool


class _Catalogue(msgspec.Struct, frozen=True):
    sentences: dict[str, list[str]]
    remedies: frozenset[str]


@cache
def told_by_code() -> dict[str, tuple[CodedSentence, ...]]:
    """Return the core's sentences by code, in the order of codes and file."""
    try:
        content = resource("i18n", "core.json").read_bytes()[:_LARGEST]
        found = msgspec.json.decode(content, type=_Catalogue)
    except (OSError, msgspec.MsgspecError, OcmmError):
        # The page still has its symptoms.
        return {}
    by_code: dict[str, list[CodedSentence]] = {}
    for sentence, codes in found.sentences.items():
        for code in codes:
            by_code.setdefault(code, []).append(CodedSentence(sentence, sentence in found.remedies))
    return {code: tuple(by_code[code]) for code in sorted(by_code)}


def answers(wanted: str) -> tuple[RemedyEntry, ...]:
    """Return lines for a query (all words, ignoring case; code prefixes): symptoms, sentences."""
    words = wanted.casefold().split()
    found = [
        RemedyEntry(tr(one.sign), tr(one.steps), ", ".join(one.codes))
        for one in SYMPTOMS
        if _has(f"{tr(one.sign)} {tr(one.steps)} {' '.join(one.codes)}".casefold(), words)
        or any(_begins(word, one.codes) for word in words)
    ]
    if len("".join(words)) < _LEAST:
        return tuple(found)
    lines = _lines(kit.language_in_use(), kit.numbers_in_use().comma)
    known = (
        RemedyEntry(_blank(what), _blank(steps), code)
        for text, code, what, steps in lines
        if _has(text, words)
    )
    return (*found, *islice(known, max(_MOST_CODES - len(found), 0)))


@cache
def _lines(language: str, comma: bool) -> list[tuple[str, str, str, str]]:  # used as cache key
    """Return searched text, code, sentences and remedies of each code in the language in use."""
    lines = []
    for code, told in told_by_code().items():
        said = [(kit.said(one.sentence), one.is_remedy) for one in told]
        what = " ".join(text for text, is_remedy in said if not is_remedy)
        steps = " ".join(text for text, is_remedy in said if is_remedy)
        text = f"{code} {' '.join(text for text, _ in said)}"
        lines.append((text.casefold(), code, what, steps))
    return lines


def _has(folded: str, words: list[str]) -> bool:
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


class _AnswerTable(kit.DataTable):
    def __init__(self) -> None:
        super().__init__(
            tr("Symptoms and remedies"),
            (
                (tr("What you see"), tr("symptom, or what the program says")),
                (tr("What to do"), tr("in this order")),
                (tr("Code"), tr("of errors and refusals")),
            ),
        )

    def show_answers(self, found: tuple[RemedyEntry, ...]) -> None:
        self.setRowCount(len(found))
        for row, one in enumerate(found):
            self.show_words(row, (one.sign, one.steps, one.codes))
        self.resizeRowsToContents()


class WhatToDoSheet(kit.Sheet):
    """A search field and a table."""

    def __init__(self, support: Callable[[], None]) -> None:
        super().__init__(tr("What to do if"), _KEYS)
        self.field = kit.form_field(tr("Search"), tr("a symptom, or the code of an error"))
        self.table = _AnswerTable()
        self.table.setWordWrap(True)
        self.table.setFont(kit.text_font(15))
        self.table.setShowGrid(True)
        self.table.fit_columns(0, 1)
        # A scroll bar narrows the columns, and rows may need another line.
        self.table.horizontalHeader().sectionResized.connect(
            lambda _column, _before, _now: QTimer.singleShot(
                0, self.table, self.table.resizeRowsToContents
            )
        )
        kit.fill(self.body, self.field, (self.table, 1))
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
        self.show_message(
            tr("%n lines", "1 line", len(found)) if found else tr("Nothing found. Type less.")
        )
