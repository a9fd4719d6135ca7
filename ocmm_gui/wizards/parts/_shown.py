"""Types shared by the parts of a wizard: procedures, snapshots, calculations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol, TypeAlias, TypeVar

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import Procedure, ProcedureView

Watcher: TypeAlias = Callable[[FrameBlock], None]
Tap: TypeAlias = Callable[[Watcher | None], None]
"""Sends every block of frames to a watcher from now on, or to none."""
TemperatureReadings: TypeAlias = Callable[[], Sequence[float | None]]
"""Returns the sensor temperatures, degrees Celsius; empty if unknown."""


V = TypeVar("V")


class ShownView(Protocol):
    """Common part of all snapshots."""

    @property
    def base(self) -> ProcedureView: ...

    @property
    def outcome(self) -> object | None:
        """Return the result; None before calculation."""
        ...


class ShownProcedure(Procedure, Protocol):
    @property
    def view(self) -> ShownView: ...

    def compute(self, elsewhere: Callable[[], Any] | None = None) -> None:
        """Calculate the result here, or by ``elsewhere`` if supported."""
        ...

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Store sensor temperatures during observations."""
        ...


class Calculation(Protocol):
    """Runs `Procedure.compute` of one procedure; see `calculation`."""

    def run(self) -> None:
        """Calculate; return when the result is in the snapshot, or raise OcmmError."""
        ...

    def cancel(self) -> None:
        """Make `run` return early; thread-safe."""
        ...


@dataclass(frozen=True, slots=True)
class Seen:
    """State for display."""

    view: ShownView
    automatic: bool
    calculating_s: float | None
    """Duration of the running calculation, s; None if none is running."""

    def view_as(self, kind: type[V]) -> V:
        """Return the snapshot as a page's type; TypeError for an error in `_registry`."""
        if not isinstance(self.view, kind):
            raise TypeError(f"the page shows {kind.__name__}, not {type(self.view).__name__}")
        return self.view
