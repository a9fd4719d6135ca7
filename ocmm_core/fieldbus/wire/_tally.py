"""Process data answers, matched by index and by the cycle number they carry.

The master library distinguishes its frames by 16 indices in rotation, so an answer 16 frames late
looks fresh. The first frame of a cycle returns the outputs sent with it, which contain the cycle
number; the others follow by index.
"""

from __future__ import annotations

from ocmm_core.fieldbus.device import OUTPUT_DTYPE

N_INDICES = 16
"""Indices of the master library; frames with others are not its own."""
_INDEX_AT = 17
_LENGTH_AT = 22
_LENGTH_BITS = 0x07FF
_DATA_AT = 26
_FIELDS = OUTPUT_DTYPE.fields
OWN_TOKEN = (0 if _FIELDS is None else int(_FIELDS["heartbeat"][1]), 4)
"""Offset and size of the cycle number in our cameras' outputs."""


class AnswerTally:
    """Counts expected and stray answers of each cycle.

    ``token``: offset and size of the cycle number in the first camera's outputs; size 0 if absent,
    then only the index is matched.
    """

    def __init__(self, token: tuple[int, int] = OWN_TOKEN) -> None:
        begin, self._token_bytes = token
        self._token_place = slice(_DATA_AT + begin, _DATA_AT + begin + self._token_bytes)
        self.frames = 0
        """Ethernet frames per cycle; set by `learn`."""
        self.stray = 0
        """Late, duplicated or reordered answers."""
        self.late = 0
        """Stray answers of the previous cycle, or overtaken by a later frame."""
        self.working_counter = 0
        """Sum over the first datagrams of this cycle's expected answers."""
        self._next = 0
        self._expected: list[int] = []
        self._before: list[int] = []
        self._token = b""
        self._first = -1
        self._count = 0

    @property
    def missing(self) -> int:
        """Return the number of outstanding answers."""
        return len(self._expected)

    @property
    def any_came(self) -> bool:
        return self._count > 0

    def learn(self, answers: list[bytes]) -> None:
        """Learn the pattern from the answers of one whole cycle."""
        # On a ring each answer comes in two copies.
        self.frames = len({answer[_INDEX_AT] for answer in answers})
        self._next = (answers[-1][_INDEX_AT] + 1) % N_INDICES if answers else 0
        self.forget()

    def forget(self) -> None:
        """Reset the counters."""
        self.stray = self.late = 0
        self._expected, self._before = [], []

    def expect(self, token: int) -> None:
        """Expect the answers of the next cycle, whose outputs carry `token`."""
        # Kept to recognise late answers.
        self._before = self._expected
        self._expected = [(self._next + frame) % N_INDICES for frame in range(self.frames)]
        self._next = (self._next + self.frames) % N_INDICES
        number = token % (1 << 8 * self._token_bytes)
        self._token = number.to_bytes(self._token_bytes, "little")
        self._first = self._expected[0] if self._expected else -1
        self._count = self.working_counter = 0

    def receive(self, frame: bytes) -> bool:
        """Record an answer to the master library; return whether it was expected."""
        index = frame[_INDEX_AT]
        if not self._count and self._is_first(frame):
            self._align(index)
        if index not in self._expected or (index == self._first and not self._is_first(frame)):
            self.take_late(frame)
            return False
        if index != self._expected[0]:
            self.stray += 1
            self.late += 1
        self._expected.remove(index)
        self._count += 1
        self.working_counter += _working_counter(frame)
        return True

    def _is_first(self, frame: bytes) -> bool:
        if not self._token_bytes:
            # The library may have used indices in between; indices outstanding from the cycle
            # before are late.
            return frame[_INDEX_AT] not in self._before
        return frame[self._token_place] == self._token

    def _align(self, first: int) -> None:
        """Resynchronise after the library used indices for other frames."""
        if first == self._first:
            return
        self._first = first
        self._expected = [(first + frame) % N_INDICES for frame in range(self.frames)]
        self._next = (first + self.frames) % N_INDICES

    def take_late(self, frame: bytes) -> None:
        """Record an unexpected answer."""
        self.stray += 1
        if frame[_INDEX_AT] in self._before:
            self._before.remove(frame[_INDEX_AT])
            self.late += 1


def _working_counter(frame: bytes) -> int:
    """Return the count of the first datagram, behind its data (ETG.1000.4, 5.4)."""
    length = int.from_bytes(frame[_LENGTH_AT : _LENGTH_AT + 2], "little") & _LENGTH_BITS
    end = _DATA_AT + length
    return int.from_bytes(frame[end : end + 2], "little")
