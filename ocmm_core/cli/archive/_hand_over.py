"""What a command that has measured does for the archive: put in, and hand over what can be now."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_core.archive import ArchivePlace, Outbox


def hand_over_after_measuring(
    place: ArchivePlace | None, jobs: Sequence[Path], console: Console
) -> None:
    """Put jobs into the outbox, hand over what waits, and say what does not get there.

    It comes after everything else: the jobs are measured, and their exit code is known.
    """
    if place is None or not jobs:
        return
    from ocmm_core.archive import Outbox, hand_over

    try:
        with Outbox(place.outbox) as outbox:
            for path in jobs:
                if path.exists():
                    outbox.put(path)
            send_now(place, outbox)
        told = hand_over(place.outbox)
    except OcmmError as error:
        console.print(f"Archive  {error}", style="yellow", highlight=False, markup=False)
        return
    if told.line:
        console.print(f"Archive  {told.line}", style="yellow", highlight=False, markup=False)


def send_now(place: ArchivePlace, outbox: Outbox) -> None:
    """Hand over what waits, once; nothing where another program is at it."""
    from ocmm_core.archive import only_one

    with only_one(place.outbox) as alone:
        if not alone:
            return
        courier = place.courier(outbox)
        try:
            courier.send_waiting()
            outbox.prune()
        finally:
            courier.close()
