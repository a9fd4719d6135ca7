"""All queries with their parameters, as offered by window and terminal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_shop.archive.questions._judge import ArchiveAnswer, Query
from ocmm_shop.archive.questions._lists import passed, today, used
from ocmm_shop.archive.questions._statistics import cpk_by_month, rr, trend
from ocmm_shop.archive.stores import Archive, not_understood

Answers = Callable[[Archive, Query], ArchiveAnswer]


@dataclass(frozen=True, slots=True)
class Question:
    name: str
    title: str
    """`name`, `title`: For scripts, and for people."""
    takes: tuple[str, ...]
    needs: tuple[str, ...]
    """`takes`, `needs`: Fields of `Query` that it uses, and the required ones."""
    answers: Answers

    def answer(self, archive: Archive, asked: Query) -> ArchiveAnswer:
        """Return the answer; malformed ones are errors, and not shown.

        InputError: a required parameter is missing, or unknown. StorageError: the archive cannot be
        queried, or its rows are malformed.
        """
        try:
            return self.answers(archive, asked)
        except (ValueError, TypeError, LookupError, AssertionError) as error:
            # A server may return anything, and a file may have other columns.
            raise not_understood(archive.place, str(error)) from error


QUESTIONS = (
    Question("today", "What was measured", ("first", "last", "station", "most"), (), today),
    Question(
        "trend", "Trend", ("part", "characteristic", "station", "most"),
        ("part", "characteristic"), trend,
    ),
    Question("used", "What used this", ("kind", "what", "most"), ("what",), used),
    Question("cpk", "Cpk by month", ("part", "characteristic", "station"), ("part",), cpk_by_month),
    Question(
        "passed", "Who passed what", ("operator", "part", "station", "first", "last"), (), passed
    ),
    Question(
        "rr", "R&R over stations", ("part", "characteristic"), ("part", "characteristic"), rr
    ),
)  # fmt: skip
