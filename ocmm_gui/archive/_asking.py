"""Work of the side process: query the archive, or read the state of the upload."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_gui.kit import later
from ocmm_gui.work import Tell
from ocmm_shop.archive.outbox import ArchivePlace, HandOver, hand_over
from ocmm_shop.archive.questions import QUESTIONS, ArchiveAnswer, Asked, parts
from ocmm_shop.archive.stores import open_archive


@dataclass(frozen=True, slots=True)
class Answered:
    """An answer with its context."""

    answer: ArchiveAnswer | None
    """None if only the archive was checked."""
    place: str
    """Display name of the archive."""
    parts: tuple[tuple[str, str], ...]
    standing: HandOver
    """State of the upload."""


@dataclass(frozen=True, slots=True)
class Asking:
    """A query; an empty name only checks the archive."""

    place: ArchivePlace
    question: str
    asked: Asked

    def __call__(self, tell: Tell) -> Answered:
        """Return the answer; errors as those of `open_archive` and of the query."""
        tell(later("Asking the archive"), 0.2)
        standing = hand_over(self.place.outbox)
        with open_archive(
            self.place.address, password=self.place.password, read_only=True
        ) as archive:
            known = parts(archive)
            found = next((one for one in QUESTIONS if one.name == self.question), None)
            answer = None if found is None else found.ask(archive, self.asked)
            return Answered(answer, archive.place, known, standing)
