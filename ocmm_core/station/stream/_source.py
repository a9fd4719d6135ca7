"""Interfaces of the measuring station read by the stream, which does not know the station."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from psygnal import SignalInstance

from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_core.storage import JobStep


class StreamedEvents(Protocol):
    @property
    def changed(self) -> SignalInstance:
        """Emitted after every change of the job."""
        ...

    @property
    def button(self) -> SignalInstance:
        """Emitted with a `ButtonChange` when the button of the probe goes down or up."""
        ...


class StreamedJob(Protocol):
    """The current job."""

    @property
    def path(self) -> Path: ...

    def view(self) -> JobView:
        """Return the current job; takes up to some seconds."""
        ...

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return job and steps after an audit row, from 0 if another; empty only if no more."""
        ...


class StreamedLooks(Protocol):
    def live(self) -> LiveView: ...


class StreamedInstruments(Protocol):
    @property
    def simulated(self) -> bool:
        """Return whether the frames come from a virtual rig, as far as is known by now."""
        ...


class StreamSource(Protocol):
    """Source of the stream, e.g. the measuring station."""

    @property
    def events(self) -> StreamedEvents: ...

    @property
    def job(self) -> StreamedJob: ...

    @property
    def looks(self) -> StreamedLooks: ...

    @property
    def instruments(self) -> StreamedInstruments: ...
