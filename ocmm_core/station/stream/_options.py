"""Where the live stream is given, and to whom."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

from ocmm_core.errors import InputError

SHORTEST_TOKEN = 16


@dataclass(frozen=True, slots=True)
class StreamOptions:
    """Where and how the stream is given.

    Attributes
    ----------
    host, port
        Address to listen on; port 0 takes a free one.
    token
        Clients must send it; needed unless ``host`` is this computer alone.
    poses_hz
        How often poses are sent at most, and how often it is looked whether the state changed.
    """

    host: str = "127.0.0.1"
    port: int = 0
    token: str = ""
    poses_hz: float = 60.0


def check_stream(options: StreamOptions) -> None:
    """Raise InputError if the stream would be open to others without a token worth the name."""
    if not _is_loopback(options.host) and len(options.token) < SHORTEST_TOKEN:
        raise InputError(
            "stream.token",
            f"The stream would be open to anyone who can reach {options.host}.",
            f"Give a token of {SHORTEST_TOKEN} characters or more, or listen on 127.0.0.1.",
        )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
