"""What the parts of a wizard hand to each other: procedures, snapshots, calculations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol, TypeAlias, TypeVar

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import Procedure, ProcedureView

Watcher: TypeAlias = Callable[[FrameBlock], None]
Tap: TypeAlias = Callable[[Watcher | None], None]
"""Sends every block of frames to a watcher from now on, or to nobody."""
TemperatureReadings: TypeAlias = Callable[[], Sequence[float | None]]
"""Returns how warm the sensors of the cameras are, degrees Celsius; empty where nobody knows."""


V = TypeVar("V")


class ShownView(Protocol):
    """What the snapshots of all procedures have."""

    @property
    def base(self) -> ProcedureView:
        """Return what all of them show."""
        ...

    @property
    def outcome(self) -> object | None:
        """Return the result; None before it was calculated."""
        ...


class ShownProcedure(Procedure, Protocol):
    """A procedure with its snapshot."""

    @property
    def view(self) -> ShownView:
        """Return the snapshot."""
        ...

    def compute(self, elsewhere: Callable[[], Any] | None = None) -> None:
        """Calculate the result, here or elsewhere; which one it is, is the procedure's matter."""
        ...

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Keep how warm the sensors are while observations are taken."""
        ...


class Calculation(Protocol):
    """Runs `Procedure.compute` of one procedure somewhere; see `calculation`."""

    def run(self) -> None:
        """Calculate; return when the result is in the snapshot, or raise OcmmError."""
        ...

    def cancel(self) -> None:
        """Make `run` return early; any thread may call."""
        ...


@dataclass(frozen=True, slots=True)
class Seen:
    """What the window shows."""

    view: ShownView
    automatic: bool
    """What is ready is taken without a key."""
    calculating_s: float | None
    """For how long a calculation has been running, s; None where none is."""

    def view_as(self, kind: type[V]) -> V:
        """Return the snapshot as that of the procedure a page is made for.

        Raises
        ------
        TypeError
            The page stands in the wizard of another procedure: a mistake in `_registry`.
        """
        if not isinstance(self.view, kind):
            raise TypeError(f"the page shows {kind.__name__}, not {type(self.view).__name__}")
        return self.view
