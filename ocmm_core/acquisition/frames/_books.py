"""The books of an acquisition in the head of its ring: what became of every cycle.

Another process reads them while they are written, and the writer may be killed at any moment. Word
by word a reader could see a cycle that has gone by and has no account yet. So there are two pages:
the writer fills the one that nobody reads and then says, with one word, that it is the newest. What
a reader gets is one whole page, also the last one of a writer that was killed.
"""

from __future__ import annotations

from typing import NamedTuple

NEWEST_PAGE = 34
"""Word of the head: how many pages were filled; the newest one is that modulo 2."""
_FIRST_WORD = 40
_PAGES = 2


class Books(NamedTuple):
    """Counters since the start."""

    elapsed: int = 0
    good: int = 0
    late: int = 0
    lost: int = 0
    bad: int = 0
    """`elapsed`, `good`, `late`, `lost`, `bad`: Cycles; ``good + late + lost + bad == elapsed``."""
    frames: int = 0
    frames_lost: int = 0
    """`frames`, `frames_lost`: Frames given out, and frames that never came."""

    def plus(self, **amounts: int) -> Books:
        """Return the books with these amounts added."""
        return self._replace(
            **{name: getattr(self, name) + amount for name, amount in amounts.items()}
        )


def write_books(words: memoryview, books: Books) -> None:
    """Publish the next page; only the writer of the ring does this."""
    number = words[NEWEST_PAGE] + 1
    begin = _FIRST_WORD + number % _PAGES * len(Books._fields)
    for place, value in enumerate(books, begin):
        words[place] = value
    words[NEWEST_PAGE] = number


def read_books(words: memoryview) -> Books:
    """Return the newest page whole, whatever the writer does meanwhile."""
    while True:
        number = words[NEWEST_PAGE]
        begin = _FIRST_WORD + number % _PAGES * len(Books._fields)
        books = Books(*words[begin : begin + len(Books._fields)].tolist())
        # The writer comes back to this page only after it has published the other one.
        if words[NEWEST_PAGE] == number:
            return books
