"""What the process beside the window does: ask the archive, or look how the hand-over stands."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.archive.outbox import ArchivePlace, HandOver, hand_over
from ocmm_core.archive.questions import QUESTIONS, ArchiveAnswer, Asked, parts
from ocmm_core.archive.stores import open_archive
from ocmm_gui.kit import later
from ocmm_gui.work import Tell


@dataclass(frozen=True, slots=True)
class Answered:
    """An answer with what is known besides."""

    answer: ArchiveAnswer | None
    """Of the question; None where only the archive was looked at."""
    place: str
    """What people call the archive."""
    parts: tuple[tuple[str, str], ...]
    """Parts with their characteristics, to choose from."""
    standing: HandOver
    """How the hand-over stands."""


@dataclass(frozen=True, slots=True)
class Asking:
    """Ask a question; an empty name only looks at the archive."""

    place: ArchivePlace
    """Archive and outbox."""
    question: str
    asked: Asked
    """What it is about."""

    def __call__(self, tell: Tell) -> Answered:
        """Return the answer; errors as those of `open_archive` and of the question."""
        tell(later("Asking the archive"), 0.2)
        standing = hand_over(self.place.outbox)
        with open_archive(
            self.place.address, password=self.place.password, read_only=True
        ) as archive:
            known = parts(archive)
            found = next((one for one in QUESTIONS if one.name == self.question), None)
            answer = None if found is None else found.ask(archive, self.asked)
            return Answered(answer, archive.place, known, standing)
