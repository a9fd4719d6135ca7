"""``ocmm archive``: hand over, ask, export, rebuild and verify."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_core.cli.archive._hand_over import send_now
from ocmm_core.cli.terminal import make_console, progress_line
from ocmm_core.errors import InputError, OcmmError

if TYPE_CHECKING:
    from rich.console import Console

    from ocmm_core.archive.checks import Checked
    from ocmm_core.archive.outbox import ArchivePlace
    from ocmm_core.archive.questions import Asked
    from ocmm_core.archive.stores import Archive as OpenArchive

archive_app = typer.Typer(
    no_args_is_help=True,
    help="The archive of all stations: a file of this computer, or a PostgreSQL server.\n\nThe "
    "setting archive.address says where it is, or --archive. Finished and paused jobs wait in an "
    "outbox until the archive has them.",
)

ArchiveOption = Annotated[
    str | None,
    typer.Option(
        "--archive", help="local, a file, or postgresql://USER@SERVER/DB. Default: the settings."
    ),
]
OutboxOption = Annotated[
    Path | None, typer.Option("--outbox", help="Folder of the outbox. Default: that of this user.")
]
ExportOption = Annotated[
    Path | None, typer.Option("--export", help="Write the table as .csv or .parquet as well.")
]
StationOption = Annotated[str, typer.Option("--station", help="Only of this station.")]
PartOption = Annotated[str, typer.Option("--part", help="Name of the part.")]
CharacteristicOption = Annotated[
    str, typer.Option("--characteristic", help="Name of the characteristic.")
]
FirstOption = Annotated[str, typer.Option("--from", help="First day, e.g. 2026-11-26.")]
LastOption = Annotated[str, typer.Option("--to", help="Last day.")]
MostOption = Annotated[int, typer.Option("--most", min=1, help="Rows at most.")]
WhoOption = Annotated[str, typer.Option("--by", help="Who says so.")]


@archive_app.command()
def status(*, archive: ArchiveOption = None, outbox: OutboxOption = None) -> None:
    """Say where the archive is, what waits for it and why; ends with 1 where something is wrong."""
    from ocmm_core.archive.outbox import hand_over

    console = make_console()
    place = _place(archive, outbox)
    reached = True
    try:
        with _opened(place, read_only=True) as open_one:
            _print_archive(console, open_one)
    except OcmmError as error:
        # What waits is here, whatever became of the archive.
        reached = False
        console.print(f"Archive  {error}", style="yellow", highlight=False, markup=False)
    told = hand_over(place.outbox)
    console.print(f"Outbox   {place.outbox}", highlight=False, markup=False)
    console.print(
        f"Waiting  {told.waiting}, set aside {len(told.aside)}", highlight=False, markup=False
    )
    for sentence in told.sentences:
        console.print(sentence, style="yellow", highlight=False, markup=False)
    for item in told.aside:
        console.print(f"{item.name}: {item.said}", style="yellow", highlight=False, markup=False)
    if told.needs_attention or not reached:
        raise typer.Exit(1)


@archive_app.command()
def send(
    jobs: Annotated[
        list[Path] | None, typer.Argument(help="Job files, or folders of them, to be put in first.")
    ] = None,
    *,
    archive: ArchiveOption = None,
    outbox: OutboxOption = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="Go on until stopped, as a service does.")
    ] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Try again what was set aside.")] = False,
) -> None:
    """Hand over what waits; job files that are named are put in first.

    Ends with 1 where something still waits or was set aside.
    """
    from ocmm_core.archive.outbox import Outbox, hand_over
    from ocmm_core.archive.outbox import follow as follow_outbox
    from ocmm_core.inspection.archive import SUFFIX

    console = make_console()
    place = _place(archive, outbox)
    code = 0
    with Outbox(place.outbox) as box:
        if retry:
            box.try_aside_again()
        for named in jobs or []:
            for path in sorted(named.rglob(f"*{SUFFIX}")) if named.is_dir() else [named]:
                try:
                    box.put(path)
                except OcmmError as error:
                    code = 1
                    console.print(str(error), style="yellow", highlight=False, markup=False)
        if not follow:
            send_now(place, box)
    if follow:
        import random

        stop = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: stop.set())
        follow_outbox(place, stop, random.Random())  # noqa: S311 - pauses only
        return
    told = hand_over(place.outbox)
    console.print(told.line or "Nothing waits for the archive.", highlight=False, markup=False)
    raise typer.Exit(1 if told.waiting or told.needs_attention else code)


@archive_app.command()
def today(
    *,
    archive: ArchiveOption = None,
    station: StationOption = "",
    first: FirstOption = "",
    last: LastOption = "",
    most: MostOption = 500,
    export: ExportOption = None,
) -> None:
    """List what was measured on a day, by the clock on the wall; default: today."""
    from ocmm_core.archive.questions import Asked

    asked = Asked(station=station, first=_day(first), last=_day(last), most=most)
    _answer("today", archive, asked, export)


@archive_app.command()
def trend(
    *,
    part: PartOption,
    characteristic: CharacteristicOption,
    archive: ArchiveOption = None,
    station: StationOption = "",
    most: MostOption = 500,
    export: ExportOption = None,
) -> None:
    """Show the trend of a characteristic over stations, with run rules, Cp and Cpk."""
    from ocmm_core.archive.questions import Asked

    asked = Asked(part=part, characteristic=characteristic, station=station, most=most)
    _answer("trend", archive, asked, export)


@archive_app.command()
def used(
    kind: Annotated[
        str, typer.Argument(help="calibration, tip, probe, artefact, rig, plan or reference.")
    ],
    what: Annotated[str, typer.Argument(help="Its hash, serial number or name.")],
    *,
    archive: ArchiveOption = None,
    most: MostOption = 500,
    export: ExportOption = None,
) -> None:
    """List the jobs that used this calibration, tip or artefact."""
    from ocmm_core.archive.questions import Asked

    _answer("used", archive, Asked(kind=kind, what=what, most=most), export)


@archive_app.command()
def cpk(
    *,
    part: PartOption,
    by: Annotated[str, typer.Option("--by", help="month")] = "month",
    characteristic: CharacteristicOption = "",
    archive: ArchiveOption = None,
    station: StationOption = "",
    export: ExportOption = None,
) -> None:
    """Show Cp and Cpk of the characteristics of a part, month by month."""
    from ocmm_core.archive.questions import Asked

    if by != "month":
        raise InputError("archive.by", f"Cpk by {by!r} is not known.", "Use --by month.")
    asked = Asked(part=part, characteristic=characteristic, station=station)
    _answer("cpk", archive, asked, export)


@archive_app.command()
def passed(
    *,
    archive: ArchiveOption = None,
    operator: Annotated[str, typer.Option("--operator", help="Only this one.")] = "",
    part: PartOption = "",
    station: StationOption = "",
    first: FirstOption = "",
    last: LastOption = "",
    export: ExportOption = None,
) -> None:
    """Count who passed what: finished jobs by operator, part and verdict."""
    from ocmm_core.archive.questions import Asked

    asked = Asked(operator=operator, part=part, station=station, first=_day(first), last=_day(last))
    _answer("passed", archive, asked, export)


@archive_app.command()
def rr(
    *,
    part: PartOption,
    characteristic: CharacteristicOption,
    archive: ArchiveOption = None,
    export: ExportOption = None,
) -> None:
    """Study gauge R&R over stations: parts that each of them measured twice or more."""
    from ocmm_core.archive.questions import Asked

    _answer("rr", archive, Asked(part=part, characteristic=characteristic), export)


@archive_app.command(name="export")
def export_command(
    view: Annotated[str, typer.Argument(help="A view, e.g. archived_result: docs/archive.md.")],
    file: Annotated[Path, typer.Argument(help="Ends in .csv or .parquet.")],
    *,
    archive: ArchiveOption = None,
    most: Annotated[int, typer.Option("--most", min=1, help="Rows at most.")] = 10_000_000,
) -> None:
    """Write a whole view of the archive to a file."""
    from ocmm_core.archive.questions import ArchiveAnswer, export_answer
    from ocmm_core.archive.stores import VIEW_NAMES

    if view not in VIEW_NAMES:
        raise InputError(
            "archive.view", f"{view!r} is no view.", f"Choose from {', '.join(VIEW_NAMES)}."
        )
    with _opened(_place(archive, None), read_only=True) as open_one:
        table = open_one.ask(f"SELECT * FROM {view} LIMIT :most", {"most": most})  # noqa: S608 - one of the views above
    export_answer(ArchiveAnswer(view, table.columns, table.rows), file)
    make_console().print(f"{len(table.rows)} rows  {file}", highlight=False, markup=False)


@archive_app.command()
def rebuild(
    new: Annotated[str, typer.Argument(help="The new archive: a file, or a set-up database.")],
    folders: Annotated[
        list[Path] | None, typer.Argument(help="Folders of job files; default: the old archive.")
    ] = None,
    *,
    archive: ArchiveOption = None,
    stations: Annotated[
        list[str] | None,
        typer.Option("--name", help="KEY=STATION: name of the station that signs with this key."),
    ] = None,
) -> None:
    """Make an archive anew from job files alone: those in folders, or those in another archive."""
    from ocmm_core.archive.checks import files_in, files_of, stations_of
    from ocmm_core.archive.checks import rebuild as rebuild_archive
    from ocmm_core.archive.stores import open_archive

    console = make_console()
    names = dict(one.split("=", 1) for one in stations or [] if "=" in one)
    unread: list[str] = []
    old = None if folders else _opened(_place(archive, None), read_only=True)
    with contextlib.ExitStack() as stack:
        if old is not None:
            from_archive = stack.enter_context(old)
            contents, names = files_in(from_archive), stations_of(from_archive) | names
        else:
            contents = files_of(folders or [], unread.append)
        target = stack.enter_context(open_archive(new))
        with progress_line() as tell:
            done = rebuild_archive(target, contents, names, tell)
    for sentence in (*unread, *done.unread):
        console.print(sentence, style="yellow", highlight=False, markup=False)
    console.print(f"Kept {done.kept} jobs in {new}", highlight=False, markup=False)
    raise typer.Exit(1 if unread or done.unread else 0)


@archive_app.command()
def verify(
    folders: Annotated[
        list[Path] | None, typer.Argument(help="Job files or folders to hold against the archive.")
    ] = None,
    *,
    archive: ArchiveOption = None,
    against: Annotated[
        str, typer.Option("--against", help="Another archive that should hold the same rows.")
    ] = "",
    quick: Annotated[
        bool, typer.Option("--quick", help="Only whether files are as they were stored.")
    ] = False,
    mark: Annotated[
        bool, typer.Option("--mark", help="Take what is wrong out of statistics; needs --by.")
    ] = False,
    who: WhoOption = "",
) -> None:
    """Hold the archive against its own files, against job files, or against another archive.

    Names every job that was altered after it was archived; ends with 1 where there is one.
    """
    from ocmm_core.archive.checks import differences, mark_altered, verify_archive, verify_files
    from ocmm_core.archive.stores import open_archive

    console = make_console()
    if mark and not who:
        raise InputError("archive.by", "Who marks them?", "Give --by NAME.")
    with _opened(_place(archive, None), read_only=not mark) as open_one:
        if against:
            with open_archive(against, read_only=True) as other:
                told = differences(open_one, other)
            for sentence in told:
                console.print(sentence, style="yellow", highlight=False, markup=False)
            console.print("The same rows." if not told else f"{len(told)} differences.")
            raise typer.Exit(1 if told else 0)
        with progress_line() as tell:
            found: Checked = (
                verify_files(open_one, folders)
                if folders
                else verify_archive(open_one, deep=not quick, tell=tell)
            )
        for job, why in found.faults:
            console.print(f"{job[:8]}  {why}", style="yellow", highlight=False, markup=False)
        if mark:
            marked = mark_altered(open_one, found, who)
            console.print(f"Marked {marked} jobs: they count in no statistic.", highlight=False)
    console.print(f"Checked {found.looked_at}, wrong {len(found.faults)}", highlight=False)
    raise typer.Exit(1 if found.faults else 0)


@archive_app.command()
def roles() -> None:
    """Print the SQL of the roles station, reader and quality, for the owner of the database."""
    from ocmm_core.archive.stores import roles_sql

    typer.echo(roles_sql())


@archive_app.command(name="set-up")
def set_up(
    *,
    archive: ArchiveOption = None,
    with_roles: Annotated[
        bool, typer.Option("--roles/--no-roles", help="Make the three roles as well.")
    ] = True,
) -> None:
    """Make the tables of a server, or bring them up to date; by the owner of the database."""
    from ocmm_core.archive.stores import VERSION, give_roles, open_archive

    place = _place(archive, None)
    with open_archive(place.address, password=place.password, set_up=True) as open_one:
        if with_roles:
            give_roles(open_one)
        make_console().print(
            f"{open_one.place}: archive of version {VERSION}", highlight=False, markup=False
        )


@archive_app.command(name="replace-computer")
def replace_computer(
    station: Annotated[str, typer.Argument(help="Name of the station.")],
    *,
    archive: ArchiveOption = None,
    outbox: OutboxOption = None,
) -> None:
    """Let this computer be a station that another one was; by quality, on the new computer."""
    from ocmm_core.archive.outbox import Outbox, sender_of

    place = _place(archive, outbox)
    with Outbox(place.outbox) as box, _opened(place) as open_one:
        open_one.replace_computer(station, sender_of(box, station))
    make_console().print(f"This computer is station {station} now.", highlight=False, markup=False)


@archive_app.command(name="new-outbox")
def new_outbox(*, outbox: OutboxOption = None) -> None:
    """Give the outbox of a copied computer an identity of its own; what waits is kept."""
    from ocmm_core.archive.outbox import Outbox, default_outbox

    with Outbox(outbox or default_outbox()) as box:
        box.renew()
        make_console().print(f"Outbox   {box.identity}", highlight=False)


def _print_archive(console: Console, archive: OpenArchive) -> None:
    console.print(f"Archive  {archive.place}", highlight=False, markup=False)
    jobs, stations = (
        int(str(archive.ask(f"SELECT count(*) FROM {view}").rows[0][0]))  # noqa: S608 - two views
        for view in ("archived_job", "archive_station")
    )
    console.print(f"Jobs     {jobs} of {stations} stations", highlight=False)
    encrypted = getattr(archive, "encrypted", None)
    if encrypted is not None:
        console.print(f"TLS      {'yes' if encrypted else 'no'}", highlight=False)


def _answer(name: str, archive: str | None, asked: Asked, export: Path | None) -> None:
    from ocmm_core.archive.questions import QUESTIONS, export_answer
    from ocmm_core.cli.archive._shown import print_answer

    question = next(one for one in QUESTIONS if one.name == name)
    with _opened(_place(archive, None), read_only=True) as open_one:
        answer = question.ask(open_one, asked)
    console = make_console()
    print_answer(console, answer)
    if export is not None:
        export_answer(answer, export)
        console.print(f"Table  {export}", highlight=False, markup=False)


def _place(archive: str | None, outbox: Path | None) -> ArchivePlace:
    from ocmm_core.station.archiving import archive_place

    place = archive_place(archive, outbox=outbox)
    if place is None:
        raise InputError(
            "archive.off",
            "The archive is off.",
            "Turn it on: ocmm settings set archive.address local, or give --archive.",
        )
    return place


@contextlib.contextmanager
def _opened(place: ArchivePlace, *, read_only: bool = False) -> Iterator[OpenArchive]:
    from ocmm_core.archive.stores import open_archive

    with open_archive(place.address, password=place.password, read_only=read_only) as found:
        yield found


def _day(text: str) -> date | None:
    if not text:
        return None
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise InputError("archive.day", f"{text!r} is no day.", "Write 2026-11-26.") from None
