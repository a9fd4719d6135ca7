"""Faulty cables: error counters at the ports of the cameras' controllers.

A controller counts broken frames and lost links per port (ETG.1000.4, 6.5: registers 0x0300 to
0x0313). A frame counted as broken was damaged on the cable at that port; controllers behind it
count it as forwarded, which implies nothing about their own cables.
"""

from __future__ import annotations

from typing import NamedTuple

PORT_ERRORS, PORT_ERRORS_BYTES = 0x0300, 20
"""Two bytes of broken frames per port, eight unused, one byte of lost links per port."""
_N_PORTS = 4
_LOST_LINKS = 16
_FULL = 255
"""Counters saturate here."""
_PORT_NAMES = ("IN", "OUT", "2", "3")


class PortTrouble(NamedTuple):
    """Errors at one port of one camera."""

    port: int
    """0 towards the computer, 1 towards the next camera."""
    broken: int
    lost: int
    """`broken`, `lost`: frames and links since the last sample; counter value if saturated."""

    def words(self, camera: str) -> str:
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
    """Return the port with the most new errors since `before`, or None.

    The registers have `PORT_ERRORS_BYTES`. A decreased counter was reset: its whole value is new.
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
    """Return the error count of all ports of a camera."""
    return sum(counters[: 2 * _N_PORTS]) + sum(counters[_LOST_LINKS:])


def _grown(before: int, now: int) -> int:
    if now == _FULL:
        return _FULL
    return now - before if now >= before else now
