"""Keys, queries and fields of the Archive page, typed dates, and queries in a side process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from PySide6.QtWidgets import QWidget

from ocmm_core.errors import InputError
from ocmm_gui.kit import ActionInfo, caption, later, tr, vbox
from ocmm_gui.work import Tell
from ocmm_shop.archive.outbox import ArchivePlace, HandOver, hand_over
from ocmm_shop.archive.questions import QUESTIONS, ArchiveAnswer, Query, parts
from ocmm_shop.archive.stores import open_archive

D = TypeVar("D")

USE_WORDS = {
    "calibration": later("calibration"),
    "tip": later("tip"),
    "probe": later("probe"),
    "artefact": later("artefact"),
    "rig": later("rig"),
    "plan": later("plan"),
    "reference": later("reference body"),
}
"""Kinds of equipment, as shown."""

KEYS = (
    ActionInfo("ask", later("Ask"), later("Ask the archive"), ("F8",)),
    ActionInfo("next", later("Next question"), later("Choose the next question"), ("F6",)),
    ActionInfo(
        "export", later("Export"), later("Write the table to a file, .csv or .parquet"), ("F7",)
    ),
    ActionInfo("stop", later("Stop"), later("Stop; what is shown stays"), ("F9",)),
    ActionInfo(
        "recall", later("Recall"), later("Recall archived jobs, or back to the questions"), ("F10",)
    ),
    ActionInfo(
        "store",
        later("Store"),
        later("Store the recall; stations hold back what does not hold"),
        ("Shift+F8",),
    ),
)
TITLES = {
    "today": later("What was measured"),
    "trend": later("Trend of a characteristic"),
    "used": later("Which jobs used this"),
    "cpk": later("Cpk by month"),
    "passed": later("Who passed what"),
    "rr": later("R&R over stations"),
}
FIELDS = (
    ("part", later("Part"), later("name of the part")),
    ("characteristic", later("Characteristic"), later("as in the plan")),
    ("what", later("What"), later("hash, serial number or name")),
    ("operator", later("Operator"), later("empty: all")),
    ("station", later("Station"), later("empty: all")),
    ("first", later("From"), later("day, e.g. 2026-11-26; empty: today")),
    ("last", later("To"), later("day; empty: the same")),
)


def read_day(text: str, read: Callable[[str], D]) -> D:
    """Return a typed date; InputError if invalid."""
    try:
        return read(text)
    except ValueError:
        raise InputError(
            "archive.day",
            tr("{text} is no day.").format(text=text),
            tr("Write it like 2026-11-26."),
        ) from None


def labelled(name: str, field: QWidget) -> QWidget:
    holder = QWidget()
    vbox(caption(name, field), field, parent=holder, spacing=2, margins=0)
    return holder


@dataclass(frozen=True, slots=True)
class ArchiveResult:
    """An answer with its context."""

    answer: ArchiveAnswer | None
    """None if only the archive was checked."""
    place: str
    """Display name of the archive."""
    parts: tuple[tuple[str, str], ...]
    standing: HandOver
    """State of the upload."""


def ask_archive(place: ArchivePlace, question: str, asked: Query, tell: Tell) -> ArchiveResult:
    """Return the answer to a query; an empty name only checks the archive.

    Errors as those of `open_archive` and of the query.
    """
    tell(later("Asking the archive"), 0.2)
    standing = hand_over(place.outbox)
    with open_archive(place.address, password=place.password, read_only=True) as archive:
        known = parts(archive)
        found = next((one for one in QUESTIONS if one.name == question), None)
        answer = None if found is None else found.answer(archive, asked)
        return ArchiveResult(answer, archive.place, known, standing)
