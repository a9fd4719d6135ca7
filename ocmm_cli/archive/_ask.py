"""``ocmm archive``: queries, and tables as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ocmm_cli.archive._app import archive_app, day_of, opened, place_of
from ocmm_cli.terminal import lead, make_console, say
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_shop.archive.questions import Query


@archive_app.command()
def today(
    *, archive: str | None, station: str, first: str, last: str, most: int, export: Path | None
) -> None:
    """List what was measured on a day, by the clock on the wall; default: today."""
    from ocmm_shop.archive.questions import Query

    asked = Query(station=station, first=day_of(first), last=day_of(last), most=most)
    _answer("today", archive, asked, export)


@archive_app.command()
def trend(
    *, part: str, characteristic: str, archive: str | None, station: str, most: int,
    export: Path | None,
) -> None:  # fmt: skip
    """Show the trend of a characteristic over stations, with run rules, Cp and Cpk."""
    from ocmm_shop.archive.questions import Query

    asked = Query(part=part, characteristic=characteristic, station=station, most=most)
    _answer("trend", archive, asked, export)


@archive_app.command()
def used(kind: str, what: str, *, archive: str | None, most: int, export: Path | None) -> None:
    """List the jobs that used this calibration, tip or artefact."""
    from ocmm_shop.archive.questions import Query

    _answer("used", archive, Query(kind=kind, what=what, most=most), export)


@archive_app.command()
def cpk(
    *, part: str, by: str, characteristic: str, archive: str | None, station: str,
    export: Path | None,
) -> None:  # fmt: skip
    """Show Cp and Cpk of the characteristics of a part, month by month."""
    from ocmm_shop.archive.questions import Query

    if by != "month":
        raise InputError("archive.by", f"Cpk by {by!r} is not known.", "Use --by month.")
    asked = Query(part=part, characteristic=characteristic, station=station)
    _answer("cpk", archive, asked, export)


@archive_app.command()
def passed(
    *, archive: str | None, operator: str, part: str, station: str, first: str, last: str,
    export: Path | None,
) -> None:  # fmt: skip
    """Count who passed what: finished jobs by operator, part and verdict."""
    from ocmm_shop.archive.questions import Query

    asked = Query(
        operator=operator, part=part, station=station, first=day_of(first), last=day_of(last)
    )
    _answer("passed", archive, asked, export)


@archive_app.command()
def rr(*, part: str, characteristic: str, archive: str | None, export: Path | None) -> None:
    """Study gauge R&R over stations: parts that each of them measured twice or more."""
    from ocmm_shop.archive.questions import Query

    _answer("rr", archive, Query(part=part, characteristic=characteristic), export)


@archive_app.command(name="export")
def export_command(view: str, file: Path, *, archive: str | None, most: int) -> None:
    """Write a whole view of the archive to a file."""
    from ocmm_shop.archive.questions import ArchiveAnswer, export_answer
    from ocmm_shop.archive.stores import MALFORMED, VIEW_NAMES

    if view not in VIEW_NAMES:
        raise InputError(
            "archive.view", f"{view!r} is no view.", f"Choose from {', '.join(VIEW_NAMES)}."
        )
    with opened(place_of(archive, None), read_only=True) as open_one:
        table = open_one.ask(f"SELECT * FROM {view} LIMIT :most", {"most": most})  # noqa: S608 - one of the views above
    export_answer(ArchiveAnswer(view, table.columns, table.rows), file)
    rows = f"{len(table.rows)} row{'' if len(table.rows) == 1 else 's'}"
    console = make_console()
    console.print(say(f"{rows}  {file}"), highlight=False, markup=False)
    if table.malformed:
        console.print(say(MALFORMED), style="yellow", highlight=False, markup=False)


def _answer(name: str, archive: str | None, asked: Query, export: Path | None) -> None:
    from ocmm_cli.archive._shown import print_answer
    from ocmm_shop.archive.questions import QUESTIONS, export_answer

    question = next(one for one in QUESTIONS if one.name == name)
    with opened(place_of(archive, None), read_only=True) as open_one:
        answer = question.ask(open_one, asked)
    console = make_console()
    print_answer(console, answer)
    if export is not None:
        export_answer(answer, export)
        console.print(f"{lead('Table  ')}{export}", highlight=False, markup=False)
