"""Servers that let other programs measure with a running station, added by installed packages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from ocmm_core.errors import InputError
from ocmm_core.plugins import load
from ocmm_core.settings import Settings
from ocmm_core.station._station import MeasuringStation

GROUP = "ocmm.services"


@dataclass(frozen=True, slots=True)
class ServiceState:
    """What a server does now, for screens."""

    title: str
    """Protocol and edition."""
    address: str
    client: str = ""
    """Address of the connected program; empty: none."""
    command: str = ""
    answer: str = ""
    """`command`, `answer`: last lines of the program and to it."""
    sentence: str = ""
    """Last sentence for the operator."""


class StationService(Protocol):
    """A running server; its methods may be called on any thread."""

    def state(self) -> ServiceState: ...

    def operate(self, words: str) -> None:
        """Send a word of the operator, such as ``done``."""
        ...

    def close(self) -> bool:
        """Disconnect the program and release the station, which keeps running; False: too late."""
        ...


@dataclass(frozen=True, slots=True)
class ServiceSpec:
    """A server in the group `ocmm.services`."""

    start: Callable[[MeasuringStation, Any, Settings], StationService]
    """From a running station, its virtual hand or None, and settings; OcmmError if it cannot."""


def start_service(
    name: str, station: MeasuringStation, hand: Any, settings: Settings
) -> StationService:
    """Start an installed server on a running station; OcmmError if it cannot."""
    spec = load(GROUP, name, ServiceSpec)
    if spec is None:
        raise InputError(
            "service.not_installed",
            f"The server {name} is not installed.",
            "Install OCMM again, with all its packages.",
        )
    return spec.start(station, hand, settings)
