"""Acquisition counters in the ring header, with the verdict of every cycle.

Another process reads them during writing, and the writer may be killed at any moment. Reading word
by word could show an elapsed cycle without verdict. So there are two pages: the writer fills the
inactive one and then activates it with one word. Readers get whole pages in any case.
"""

from __future__ import annotations

from typing import NamedTuple

NEWEST_PAGE = 34
"""Header word: number of written pages; modulo 2 the newest one."""
_FIRST_WORD = 40
_PAGES = 2


class Books(NamedTuple):
    """Counters since the start."""

    elapsed: int = 0
    good: int = 0
    late: int = 0
    lost: int = 0
    bad: int = 0
    """`elapsed`, `good`, `late`, `lost`, `bad`: cycles; ``good + late + lost + bad == elapsed``."""
    frames: int = 0
    frames_lost: int = 0

    def plus(self, **amounts: int) -> Books:
        """Return the counters with these amounts added."""
        return self._replace(
            **{name: getattr(self, name) + amount for name, amount in amounts.items()}
        )


def write_books(words: memoryview, books: Books) -> None:
    """Publish the next page; only the writer of the ring may call this."""
    number = words[NEWEST_PAGE] + 1
    begin = _FIRST_WORD + number % _PAGES * len(Books._fields)
    for place, value in enumerate(books, begin):
        words[place] = value
    words[NEWEST_PAGE] = number


def read_books(words: memoryview) -> Books:
    """Return the newest page, consistent despite concurrent writing."""
    while True:
        number = words[NEWEST_PAGE]
        begin = _FIRST_WORD + number % _PAGES * len(Books._fields)
        books = Books(*words[begin : begin + len(Books._fields)].tolist())
        # The writer reuses this page only after publishing the other one.
        if words[NEWEST_PAGE] == number:
            return books
