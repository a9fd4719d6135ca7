"""Which answers to the process data have come: told by their index and by what they carry.

The master library tells its frames apart by 16 indices that it uses in turn, so that an answer
that is 16 frames late looks like a fresh one. The first frame of a cycle brings back the outputs
that went out with it, and in them the number of the cycle; the others follow its index.
"""

from __future__ import annotations

from ocmm_core.fieldbus.device import OUTPUT_DTYPE

N_INDICES = 16
"""Of the master library; frames with others are not its own."""
_INDEX_AT = 17
_LENGTH_AT = 22
_LENGTH_BITS = 0x07FF
_DATA_AT = 26
_FIELDS = OUTPUT_DTYPE.fields
OWN_TOKEN = (0 if _FIELDS is None else int(_FIELDS["heartbeat"][1]), 4)
"""Where in the outputs of our cameras the number of the cycle is, and how many bytes it has."""


class AnswerTally:
    """Counts the answers of each cycle, and those that nobody waits for.

    Parameters
    ----------
    token
        Where in the outputs of the first camera the number of the cycle is, and its bytes; no
        bytes where these cameras have no such output. Then the index alone tells answers apart.
    """

    def __init__(self, token: tuple[int, int] = OWN_TOKEN) -> None:
        begin, self._token_bytes = token
        self._token_place = slice(_DATA_AT + begin, _DATA_AT + begin + self._token_bytes)
        self.frames = 0
        """Into how many Ethernet frames a cycle is split; learnt with `learn`."""
        self.stray = 0
        """Answers that were late, came twice or out of order."""
        self.late = 0
        """Those of them that belong to the cycle before, or came after one of a later frame."""
        self.working_counter = 0
        """What the answers that were waited for count in this cycle, in their first datagrams."""
        self._next = 0
        self._expected: list[int] = []
        self._before: list[int] = []
        self._token = b""
        self._first = -1
        self._count = 0

    @property
    def missing(self) -> int:
        """Return how many answers of this cycle are still out."""
        return len(self._expected)

    @property
    def any_came(self) -> bool:
        """Return whether at least one answer of this cycle has come."""
        return self._count > 0

    def learn(self, answers: list[bytes]) -> None:
        """Take the answers of one whole cycle as the pattern of all that follow."""
        # On a ring each answer comes in two copies.
        self.frames = len({answer[_INDEX_AT] for answer in answers})
        self._next = (answers[-1][_INDEX_AT] + 1) % N_INDICES if answers else 0
        self.forget()

    def forget(self) -> None:
        """Count from here on."""
        self.stray = self.late = 0
        self._expected, self._before = [], []

    def begin(self, token: int) -> None:
        """Expect the answers of the next cycle, whose outputs carry ``token`` as heartbeat."""
        # Answers that never came are told from others when they come late.
        self._before = self._expected
        self._expected = [(self._next + frame) % N_INDICES for frame in range(self.frames)]
        self._next = (self._next + self.frames) % N_INDICES
        number = token % (1 << 8 * self._token_bytes)
        self._token = number.to_bytes(self._token_bytes, "little")
        self._first = self._expected[0] if self._expected else -1
        self._count = self.working_counter = 0

    def take(self, frame: bytes) -> bool:
        """Note an answer with an index of the master library; say whether it was waited for."""
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
            # The library may have used indices for something else in between; what is still out
            # of the cycle before is late.
            return frame[_INDEX_AT] not in self._before
        return frame[self._token_place] == self._token

    def _align(self, first: int) -> None:
        """Follow the master library where it used indices for something else in between."""
        if first == self._first:
            return
        self._first = first
        self._expected = [(first + frame) % N_INDICES for frame in range(self.frames)]
        self._next = (first + self.frames) % N_INDICES

    def take_late(self, frame: bytes) -> None:
        """Note an answer that nobody waits for."""
        self.stray += 1
        if frame[_INDEX_AT] in self._before:
            self._before.remove(frame[_INDEX_AT])
            self.late += 1


def _working_counter(frame: bytes) -> int:
    """Return the count of the first datagram, which is behind its data; ETG.1000.4, 5.4."""
    length = int.from_bytes(frame[_LENGTH_AT : _LENGTH_AT + 2], "little") & _LENGTH_BITS
    end = _DATA_AT + length
    return int.from_bytes(frame[end : end + 2], "little")
