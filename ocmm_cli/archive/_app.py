"""Group of commands, its options, and access to an archive."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_shop.archive.outbox import ArchivePlace
    from ocmm_shop.archive.stores import Archive as OpenArchive

archive_app = typer.Typer(
    no_args_is_help=True,
    help="The archive of all stations: a file of this computer, or a PostgreSQL server.\n\nThe "
    "setting archive.address says where it is, or --archive. Finished and paused jobs wait in an "
    "outbox until the archive has them.",
)


def place_of(archive: str | None, outbox: Path | None) -> ArchivePlace:
    """Return the places of archive and outbox; InputError if the archive is off."""
    from ocmm_shop.archiving import archive_place

    place = archive_place(archive, outbox=outbox)
    if place is None:
        raise InputError(
            "archive.off",
            "The archive is off.",
            "Turn it on: ocmm settings set archive.address local, or give --archive.",
        )
    return place


@contextlib.contextmanager
def opened(place: ArchivePlace, *, read_only: bool = False) -> Iterator[OpenArchive]:
    from ocmm_shop.archive.stores import open_archive

    with open_archive(place.address, password=place.password, read_only=read_only) as found:
        yield found


def day_of(text: str) -> date | None:
    """Return the date of a text; None if empty, InputError if not a date."""
    if not text:
        return None
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise InputError("archive.day", f"{text!r} is no day.", "Write 2026-11-26.") from None
