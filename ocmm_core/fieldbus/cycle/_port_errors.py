"""Which cable is it? What the controllers of the cameras count at each of their ports.

A controller counts frames that arrive broken at a port and links that were lost there (ETG.1000.4,
6.5: registers 0x0300 to 0x0313). A broken frame was broken on the cable that ends at that port: the
controllers behind it count it as forwarded, which says nothing about their own cables.
"""

from __future__ import annotations

from typing import NamedTuple

PORT_ERRORS, PORT_ERRORS_BYTES = 0x0300, 20
"""Two bytes a port of broken frames, eight that say nothing about a port, one a port of links."""
_N_PORTS = 4
_LOST_LINKS = 16
_FULL = 255
"""A counter stays there."""
_PORT_NAMES = ("IN", "OUT", "2", "3")


class PortTrouble(NamedTuple):
    """What went wrong at one port of one camera."""

    port: int
    """0 towards the computer, 1 towards the next camera."""
    broken: int
    lost: int
    """`broken`, `lost`: Frames that arrived broken, and links that were lost, since the last look;
    where a counter is full, what it shows."""

    def words(self, camera: str) -> str:
        """Return it as a sentence."""
        parts = []
        if self.broken:
            parts.append(f"{self.broken} broken frame{'s' if self.broken > 1 else ''}")
        if self.lost:
            parts.append(f"{self.lost} lost link{'s' if self.lost > 1 else ''}")
        return (
            f"Camera '{camera}' counts {' and '.join(parts)} at its port "
            f"{_PORT_NAMES[self.port]} ({self.port})."
        )


def port_trouble(before: bytes, now: bytes) -> PortTrouble | None:
    """Return the port at which most was counted since ``before``; None where nothing was.

    Parameters
    ----------
    before, now
        The registers, `PORT_ERRORS_BYTES` each. Where a counter went down the camera was started
        anew or its counters were cleared, and all that it shows is new.
    """
    found = [
        PortTrouble(
            port,
            sum(_grown(before[at], now[at]) for at in (2 * port, 2 * port + 1)),
            _grown(before[_LOST_LINKS + port], now[_LOST_LINKS + port]),
        )
        for port in range(_N_PORTS)
    ]
    worst = max(found, key=lambda each: (each.broken + each.lost, -each.port))
    return worst if worst.broken or worst.lost else None


def errors_at_ports(counters: bytes) -> int:
    """Return how much all ports of a camera counted."""
    return sum(counters[: 2 * _N_PORTS]) + sum(counters[_LOST_LINKS:])


def _grown(before: int, now: int) -> int:
    if now == _FULL:
        return _FULL
    return now - before if now >= before else now
