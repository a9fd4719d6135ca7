"""Options of a served station, each group as one parameter of a command."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest


@dataclass(frozen=True, slots=True)
class ServedAddress:
    """Address of a server, and its permitted clients."""

    host: str
    port: int | None
    allow: list[str] | None
    certificate: Path | None
    private_key: Path | None


@dataclass(frozen=True, slots=True)
class ServedStation:
    """The station whose points are served."""

    out: Path
    source: str
    rig: Path
    probe: Path
    reference: Path | None
    seed: int
    speed: float
    operator: str
    serial: str
    calibrations: Path | None
    uncalibrated: bool
    probes: Path | None
    tip: str | None
    check_after: float
    """Hours."""
    force: bool
    bus_processor: int | None

    def request(self, plan: Path) -> StationRequest:
        """Return the request of the station for a plan."""
        from ocmm_core.composition import StationRequest

        named = asdict(self)
        return StationRequest(plan=plan, check_after_h=named.pop("check_after"), **named)
