"""``ocmm archive``: status, upload, and administration of a server.

Upload after measuring: queue the jobs, then send all that is possible now.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.terminal import PlainConsole, error_text, lead, make_console, tr, tr_word
from ocmm_core.documents import find_files
from ocmm_core.errors import InputError, OcmmError

if TYPE_CHECKING:
    from ocmm_shop.archive.outbox import ArchivePlace, JobNote, Outbox
    from ocmm_shop.archive.stores import Archive as OpenArchive


archive_app = typer.Typer(
    no_args_is_help=True,
    help="The archive of all stations: a file of this computer, or a PostgreSQL server.\n\nThe "
    "setting archive.address says where it is, or --archive. Finished and paused jobs wait in an "
    "outbox until the archive has them.",
)


def place_of(archive: str | None, outbox: Path | None) -> ArchivePlace:
    """Return the places of archive and outbox; InputError if the archive is off."""
    from ocmm_shop.archiving import required_place

    return required_place(archive, outbox)


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


class MeasuredJobs:
    """Jobs noted at their start, uploaded at the end; ``place`` None: not."""

    def __init__(self, place: ArchivePlace | None, console: PlainConsole) -> None:
        self._place, self._console = place, console
        self._jobs: list[Path] = []
        self._notes: list[JobNote] = []

    def start(self, path: Path) -> None:
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
            self._console.print(f"{lead('Archive  ')}{error_text(error)}", style="yellow")
            return
        if state.line:
            self._console.print(f"{lead('Archive  ')}{tr(state.line)}", style="yellow")


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


@archive_app.command()
def status(*, archive: str | None, outbox: Path | None) -> None:
    """Say where the archive is, what waits for it and why; ends with 1 where something is wrong."""
    from ocmm_shop.archive.outbox import hand_over

    console = make_console()
    place = place_of(archive, outbox)
    reached = True
    try:
        with opened(place, read_only=True) as open_one:
            _print_archive(console, open_one)
    except OcmmError as error:
        # The outbox is local; report it even if the archive is unreachable.
        reached = False
        console.print(f"{lead('Archive  ')}{error_text(error)}", style="yellow")
    state = hand_over(place.outbox)
    console.print(f"{lead('Outbox   ')}{place.outbox}")
    console.show(f"Waiting  {state.waiting}, set aside {len(state.aside)}")
    for sentence in state.sentences:
        console.show(sentence, style="yellow")
    for item in state.aside:
        console.print(f"{item.name}: {tr(item.said)}", style="yellow")
    if state.needs_attention or not reached:
        raise typer.Exit(1)


@archive_app.command()
def send(
    jobs: Annotated[list[Path] | None, typer.Argument(readable=False)], *, archive: str | None,
    outbox: Path | None, follow: bool, retry: bool,
) -> None:  # fmt: skip
    """Hand over what waits; job files that are named are put in first.

    Ends with 1 where something still waits or was set aside.
    """
    from ocmm_core.inspection.finished import SUFFIX
    from ocmm_core.storage import JobFile
    from ocmm_shop.archive.outbox import Outbox, hand_over
    from ocmm_shop.archive.outbox import follow as follow_outbox

    console = make_console()
    place = place_of(archive, outbox)
    code = 0
    with Outbox(place.outbox) as box:
        if retry:
            box.try_aside_again()
        for named in jobs or []:
            paths, left_out = find_files(named, SUFFIX) if named.is_dir() else ([named], [])
            for one in left_out:
                code = 1
                console.print(error_text(one), style="yellow")
            for path in paths:
                try:
                    job = JobFile.read(path)
                    box.put_content(job.content(), path)
                    if job.left_out:
                        console.print(
                            f"{path.name}: {tr(job.left_out)}",
                            style="yellow",
                        )  # fmt: skip
                except OcmmError as error:
                    code = 1
                    console.print(error_text(error), style="yellow")
        if not follow:
            send_now(place, box)
    if follow:
        import random

        stop = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop.set())
        follow_outbox(place, stop, random.Random())  # noqa: S311 - pauses only
        return
    state = hand_over(place.outbox)
    console.print(tr(state.line) or tr("Nothing waits for the archive."))
    raise typer.Exit(1 if state.waiting or state.needs_attention else code)


@archive_app.command()
def roles() -> None:
    """Print the SQL of the roles station, reader and quality, for the owner of the database."""
    from ocmm_shop.archive.stores import roles_sql

    typer.echo(roles_sql())


@archive_app.command(name="set-up")
def set_up(*, archive: str | None, with_roles: bool) -> None:
    """Make the tables of a server (by the owner of the database), or a new file for a lost one."""
    from ocmm_shop.archive.stores import VERSION, give_roles, open_archive

    place = place_of(archive, None)
    with open_archive(place.address, password=place.password, set_up=True) as open_one:
        if with_roles:
            give_roles(open_one)
        make_console().print(tr(f"{open_one.place}: archive of version {VERSION}"))


@archive_app.command()
def admit(login: str, station: str, *, archive: str | None) -> None:
    """Let a login send jobs as a station, and as no other; by quality or the owner."""
    with opened(place_of(archive, None)) as open_one:
        open_one.admit(login, station)
    make_console().print(tr(f"Login {login} sends as station {station} now."))


@archive_app.command(name="replace-computer")
def replace_computer(station: str, *, archive: str | None, outbox: Path | None) -> None:
    """Let this computer be a station that another one was; by quality, on the new computer."""
    from ocmm_shop.archive.outbox import Outbox, sender_of

    place = place_of(archive, outbox)
    with Outbox(place.outbox) as box, opened(place) as open_one:
        open_one.replace_computer(station, sender_of(box, station))
    make_console().print(tr(f"This computer is station {station} now."))


@archive_app.command(name="new-outbox")
def new_outbox(*, outbox: Path | None) -> None:
    """Give the outbox of a copied computer an identity of its own; what waits is kept."""
    from ocmm_shop.archive.outbox import Outbox, default_outbox

    with Outbox(outbox or default_outbox()) as box:
        box.renew()
        make_console().print(f"{lead('Outbox   ')}{box.identity}")


def _print_archive(console: PlainConsole, archive: OpenArchive) -> None:
    console.print(f"{lead('Archive  ')}{archive.place}")
    jobs, stations = (
        int(str(archive.query(f"SELECT count(*) FROM {view}").rows[0][0]))  # noqa: S608 - two views
        for view in ("archived_job", "archive_station")
    )
    console.show(f"Jobs     {jobs} of {stations} station{'' if stations == 1 else 's'}")
    encrypted = getattr(archive, "encrypted", None)
    if encrypted is not None:
        console.print(f"{lead('TLS      ')}{tr_word('yes' if encrypted else 'no')}")
