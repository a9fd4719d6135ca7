"""Camera temperatures, one camera every few seconds, between other requests."""

from __future__ import annotations

import time
from collections.abc import Callable

from ocmm_core.fieldbus.device import INFORMATION
from ocmm_core.fieldbus.objects._objects import Request, RequestPort
from ocmm_core.fieldbus.objects._requests import ObjectReply, ObjectRequest

INTERVAL_NS = 5_000_000_000
"""Between readings; the cameras take turns."""
_TEMPERATURE = 4
_BYTES = 2


class Thermometer:
    """Port that inserts its own requests between those of another port."""

    def __init__(
        self,
        port: RequestPort | None,
        names: tuple[str, ...],
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.celsius: dict[str, float] = {}
        """Last temperatures; cameras without answer are missing."""
        self._port = port
        self._names = names
        self._now_ns = now_ns
        self._next_ns = now_ns()
        self._turn = 0

    def take(self) -> Request | None:
        """Return the next request of the other port, or a due reading."""
        request = None if self._port is None else self._port.take()
        now_ns = self._now_ns()
        if request is not None or now_ns < self._next_ns:
            return request
        self._next_ns = now_ns + INTERVAL_NS
        self._turn = (self._turn + 1) % len(self._names)
        # Numbers of other requests are not negative.
        return ObjectRequest(
            -1 - self._turn, self._names[self._turn], INFORMATION, _TEMPERATURE, room=_BYTES
        )

    def is_cancelled(self, number: int) -> bool:
        return number >= 0 and self._port is not None and self._port.is_cancelled(number)

    def reply(self, reply: ObjectReply) -> None:
        """Store the reply to a reading; pass any other on."""
        if reply.number >= 0:
            if self._port is not None:
                self._port.reply(reply)
            return
        name = self._names[-1 - reply.number]
        if reply.code:
            self.celsius.pop(name, None)
        elif reply.finished and len(reply.value) == _BYTES:
            self.celsius[name] = int.from_bytes(reply.value, "little", signed=True) / 10.0
