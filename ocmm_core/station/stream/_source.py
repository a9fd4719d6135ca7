"""What the stream reads of the measuring station, as interfaces: this room knows no station."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from psygnal import SignalInstance

from ocmm_core.inspection.evaluation import JobView, LiveView
from ocmm_core.storage import JobStep


class StreamedEvents(Protocol):
    """Signals of what changes."""

    @property
    def changed(self) -> SignalInstance:
        """Emitted after every change of the job."""
        ...

    @property
    def button(self) -> SignalInstance:
        """Emitted with a `ButtonChange` when the button of the probe goes down or up."""
        ...


class StreamedJob(Protocol):
    """The job that is measured."""

    @property
    def path(self) -> Path:
        """Return its file."""
        ...

    def view(self) -> JobView:
        """Return the job as it stands; takes up to some seconds."""
        ...

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return the job that is measured, and what was stored in it behind an audit row.

        From its beginning where ``job`` is another one; empty only where there is nothing more.
        """
        ...


class StreamedLooks(Protocol):
    """What the machine sees."""

    def live(self) -> LiveView:
        """Return what it sees now."""
        ...


class StreamedInstruments(Protocol):
    """What is measured with."""

    @property
    def simulated(self) -> bool:
        """Return whether the frames come from a virtual rig, as far as is known by now."""
        ...


class StreamSource(Protocol):
    """What is streamed, e.g. the measuring station."""

    @property
    def events(self) -> StreamedEvents:
        """Return its signals."""
        ...

    @property
    def job(self) -> StreamedJob:
        """Return the job that is measured."""
        ...

    @property
    def looks(self) -> StreamedLooks:
        """Return what it sees."""
        ...

    @property
    def instruments(self) -> StreamedInstruments:
        """Return what it measures with."""
        ...
