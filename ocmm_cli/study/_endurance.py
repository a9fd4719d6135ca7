"""Memory of a long run: the whole chain, with the virtual rig at full speed."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.host import HOST

_SAMPLES = 10
_POLL_S = 0.05
_MIB = 1024.0 * 1024.0


@dataclass(frozen=True, slots=True)
class MemoryRun:
    frames: int
    wall_s: float
    memory_mib: tuple[float, ...]
    """Resident memory at ten equal steps of bus time, MiB; the first after one tenth, when
    everything is loaded and the script has been measured. Excludes the last 30 s of frames, which
    are kept on purpose and bounded (decision 21)."""

    @property
    def growth_mib(self) -> float:
        """Return the growth from the first to the last sample, MiB."""
        return self.memory_mib[-1] - self.memory_mib[0]


def run_for(bus_time_s: float, console: Console) -> MemoryRun:
    """Run the station on the virtual rig at 8 kHz for ``bus_time_s``.

    The operator measures a short plan; then the probe stays in view and is tracked.
    """
    with tempfile.TemporaryDirectory() as folder:
        request = StationRequest(
            plan=resource("plans", "quick.toml"), out=Path(folder), stay=True, speed=0.0,
            rest_speed=0.0,
        )  # fmt: skip
        station = build_station(request).station
        memory: list[float] = []
        start = time.monotonic()
        with Progress(console=console, transient=True) as progress:
            task = progress.add_task(f"{bus_time_s:.0f} s of bus time", total=_SAMPLES)
            try:
                station.start()
                while len(memory) < _SAMPLES:
                    if station.wait_finished(_POLL_S):
                        break
                    if station.looks.live().time_s >= bus_time_s * (len(memory) + 1) / _SAMPLES:
                        kept = 0 if station.history is None else station.history.size_bytes
                        memory.append(_resident_mib() - kept / _MIB)
                        progress.advance(task)
                frames = station.looks.acquisition().frames
            finally:
                station.close()
    return MemoryRun(frames, time.monotonic() - start, tuple(memory))


def print_run(run: MemoryRun, bus_time_s: float, console: Console) -> None:
    samples = "  ".join(f"{value:.0f}" for value in run.memory_mib)
    console.print(f"{bus_time_s:.0f} s of bus time, {run.frames} frames at 8 kHz", highlight=False)
    console.print(f"Memory at ten steps, MiB: {samples}", highlight=False)
    console.print(f"Growth from first to last: {run.growth_mib:+.1f} MiB", highlight=False)
    console.print(
        f"Real-time factor of the whole chain, virtual rig included: {bus_time_s / run.wall_s:.1f}",
        highlight=False,
    )


def _resident_mib() -> float:
    return HOST.resident_bytes() / _MIB
