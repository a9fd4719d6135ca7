"""The protocols of trackers: what differs between them, in one table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.camera import TrackerDocument
from ocmm_trackers._igtl_stream import IgtlDecoder
from ocmm_trackers._link import DatagramLink, Link, StreamLink
from ocmm_trackers._messages import Decoder
from ocmm_trackers._natnet import NatNetDecoder
from ocmm_trackers._ndi import NdiDecoder
from ocmm_trackers._qtm import QtmDecoder


@dataclass(frozen=True, slots=True)
class TrackerProtocol:
    """One protocol of trackers."""

    name: str
    """In recordings."""
    port: int
    """If the source names none."""
    server: str
    """To be started at the device."""
    link: Callable[[tuple[str, int], float], Link]
    """Connects to an address within a time, s; OSError if it cannot."""
    decoder: Callable[[TrackerDocument], Decoder]


PROTOCOLS = {
    "igtl": TrackerProtocol(
        "OpenIGTLink", 18944, "the OpenIGTLink server of the tracker", StreamLink, IgtlDecoder
    ),
    "natnet": TrackerProtocol(
        "NatNet", 1510, "Motive with its data streaming", DatagramLink, NatNetDecoder
    ),
    "ndi": TrackerProtocol("NDI", 8765, "the tracker", StreamLink, NdiDecoder),
    "qtm": TrackerProtocol(
        "QTM", 22223, "Qualisys Track Manager with its real-time output", StreamLink, QtmDecoder
    ),
}
"""By the prefix of their sources."""
