"""Upload after measuring: queue the jobs, then send all that is possible now."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from ocmm_cli.terminal import lead, say, told
from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_shop.archive.outbox import ArchivePlace, JobNote, Outbox


class MeasuredJobs:
    """Jobs noted at their start, uploaded at the end; ``place`` None: not."""

    def __init__(self, place: ArchivePlace | None, console: Console) -> None:
        self._place, self._console = place, console
        self._jobs: list[Path] = []
        self._notes: list[JobNote] = []

    def begin(self, path: Path) -> None:
        """Note a job, so that it is found even if this program is killed."""
        self._jobs.append(path)
        if self._place is None:
            return
        from ocmm_shop.archive.outbox import JobNote

        # Reported when it is queued: that will probably fail for the same reason.
        with contextlib.suppress(OcmmError):
            self._notes.append(JobNote(self._place.outbox, path))

    def drop(self, path: Path) -> None:
        """Drop a job whose file was lost: its name may mean another file now."""
        self._jobs.remove(path)
        for note in self._notes:
            if note.path == path:
                note.done()

    def hand_over(self) -> None:
        """Queue all jobs, upload what waits, print failures; call it last, for the exit code."""
        if self._place is None or not self._jobs:
            return
        from ocmm_shop.archive.outbox import Outbox, hand_over

        try:
            with Outbox(self._place.outbox) as outbox:
                for path in self._jobs:
                    if path.exists():
                        outbox.put(path)
                for note in self._notes:
                    note.done()
                send_now(self._place, outbox)
            state = hand_over(self._place.outbox)
        except OcmmError as error:
            self._console.print(
                f"{lead('Archive  ')}{told(error)}", style="yellow", highlight=False, markup=False
            )
            return
        if state.line:
            self._console.print(
                f"{lead('Archive  ')}{say(state.line)}",
                style="yellow",
                highlight=False,
                markup=False,
            )


def send_now(place: ArchivePlace, outbox: Outbox) -> None:
    """Upload what waits, once; nothing if another program is doing so."""
    from ocmm_shop.archive.outbox import only_one, sweep

    with only_one(place.outbox) as alone:
        if not alone:
            return
        sweep(outbox)
        courier = place.courier(outbox)
        try:
            courier.send_waiting()
            outbox.prune()
        finally:
            courier.close()
