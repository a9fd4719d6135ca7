"""A folder of records with the chain of what happened to them; see `chain_file`."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ocmm_core.chain_file import ChainFile

T = TypeVar("T", bound=msgspec.Struct)


class EventFolder(Generic[T]):
    """The folder; one process writes at a time. Its methods may be called from any thread.

    Parameters
    ----------
    folder
        Made at the first write.
    kind
        Of the events.

    Raises
    ------
    StorageError
        The chain of events is broken.
    """

    def __init__(self, folder: Path, kind: type[T]) -> None:
        self._folder = folder
        self._kind = kind
        self._lock = threading.Lock()
        self._chain = ChainFile(folder / "events.jsonl", kind)

    @property
    def folder(self) -> Path:
        """Return where it is."""
        return self._folder

    @property
    def events(self) -> tuple[T, ...]:
        """Return what happened, oldest first."""
        return self._chain.items

    def refresh(self) -> None:
        """Take in what another process appended; raise StorageError where the chain is broken."""
        with self._lock:
            self._refresh()

    def _append_event(self, event: T) -> None:
        """Add an event and return when it is on the disk; StorageError where it is not."""
        with self._lock:
            # The lines of another process must not be written over.
            self._refresh()
            self._chain.append(event)

    def _refresh(self) -> None:
        if not self._chain.is_current():
            self._chain = ChainFile(self._chain.path, self._kind)
