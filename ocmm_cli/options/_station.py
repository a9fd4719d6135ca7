"""Options of a station that measures, each group as one parameter of a command."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest


@dataclass(frozen=True, slots=True)
class StationChoice:
    """The station that a command measures with, or whose points it serves."""

    out: Path | None
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
    part_temperature: float | None
    temperature_sigma: float | None

    def request(self, plan: Path, **more: Any) -> StationRequest:
        """Return the request of the station for a plan; ``more``: other fields of it."""
        from ocmm_core.composition import ClimateRequest, StationRequest

        named = asdict(self)
        named["climate"] = ClimateRequest(
            part_c=named.pop("part_temperature"), sigma_k=named.pop("temperature_sigma")
        )
        named["check_after_h"] = named.pop("check_after")
        return StationRequest(plan=plan, **{**named, **more})


@dataclass(frozen=True, slots=True)
class ClimateOptions:
    """Temperatures of the probe, and compensation."""

    probe_design: Path | None
    probe_temperature: float | None
    compensate_probe: bool
    part_expansion: float | None
    compensate_part: bool
    temperature_u: str
    thermometer: str


@dataclass(frozen=True, slots=True)
class StreamChoice:
    """Address of the live stream; off without a port."""

    stream: int | None
    stream_host: str
    stream_token: Path | None
    stream_cert: Path | None
    stream_key: Path | None


@dataclass(frozen=True, slots=True)
class JobOptions:
    """What a job is about, and how it is probed and recorded."""

    part: Path
    order_number: str
    batch: str
    order: str
    record: Path | None
    thesis: bool
