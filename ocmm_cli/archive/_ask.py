"""``ocmm archive``: queries, tables as files, rebuild from job files, comparison with them."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.archive._archive import archive_app, day_of, opened, place_of
from ocmm_cli.terminal import lead, make_console, print_grid, progress_line, tr, tr_word
from ocmm_core.errors import InputError

__all__ = ["archive_app"]

if TYPE_CHECKING:
    from rich.text import Text

    from ocmm_cli.terminal import PlainConsole
    from ocmm_shop.archive.checks import Checked
    from ocmm_shop.archive.outbox import Item
    from ocmm_shop.archive.questions import ArchiveAnswer, Query
    from ocmm_shop.archive.stores import Archive as OpenArchive


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
        table = open_one.query(f"SELECT * FROM {view} LIMIT :most", {"most": most})  # noqa: S608 - one of the views above
    export_answer(ArchiveAnswer(view, table.columns, table.rows), file)
    rows = f"{len(table.rows)} row{'' if len(table.rows) == 1 else 's'}"
    console = make_console()
    console.show(f"{rows}  {file}")
    if table.malformed:
        console.show(MALFORMED, style="yellow")


def _answer(name: str, archive: str | None, asked: Query, export: Path | None) -> None:
    from ocmm_shop.archive.questions import QUESTIONS, export_answer

    question = next(one for one in QUESTIONS if one.name == name)
    with opened(place_of(archive, None), read_only=True) as open_one:
        answer = question.answer(open_one, asked)
    console = make_console()
    _print_answer(console, answer)
    if export is not None:
        export_answer(answer, export)
        console.print(f"{lead('Table  ')}{export}")


@archive_app.command()
def rebuild(
    new: str, folders: Annotated[list[Path] | None, typer.Argument(readable=False)], *,
    archive: str | None, stations: list[str] | None,
) -> None:  # fmt: skip
    """Rebuild an archive from job files alone: those in folders, or those in another archive."""
    from ocmm_shop.archive.checks import files_in, files_of, key_and_name, stations_of
    from ocmm_shop.archive.checks import rebuild as rebuild_archive
    from ocmm_shop.archive.stores import open_archive

    console = make_console()
    names = dict(map(key_and_name, stations or []))
    unread: list[str] = []
    old = None if folders else opened(place_of(archive, None), read_only=True)
    with contextlib.ExitStack() as stack:
        if old is not None:
            from_archive = stack.enter_context(old)
            contents = files_in(from_archive, unread.append)
            names = stations_of(from_archive) | names
        else:
            contents = files_of(folders or [], unread.append)
        target = stack.enter_context(open_archive(new))
        with progress_line() as tell:
            done = rebuild_archive(target, contents, names, tell)
    for sentence in (*unread, *done.unread):
        console.show(sentence, style="yellow")
    jobs = f"{done.kept} job{'' if done.kept == 1 else 's'}"
    console.show(f"Kept {jobs} in {new}")
    raise typer.Exit(1 if unread or done.unread else 0)


@archive_app.command()
def verify(
    folders: Annotated[list[Path] | None, typer.Argument(readable=False)], *, archive: str | None,
    against: str, quick: bool, mark: bool, who: str,
) -> None:  # fmt: skip
    """Hold the archive against its own files, against job files, or against another archive.

    Names every job that was altered after it was archived; ends with 1 where there is one.
    """
    from ocmm_shop.archive.checks import differences, mark_altered, verify_archive, verify_files
    from ocmm_shop.archive.records import shown_text
    from ocmm_shop.archive.stores import open_archive

    console = make_console()
    if mark and not who:
        raise InputError("archive.by", "Who marks them?", "Give --by NAME.")
    place = place_of(archive, None)
    with opened(place, read_only=not mark) as open_one:
        if against:
            with open_archive(against, read_only=True) as other:
                told = differences(open_one, other)
            for sentence in told:
                console.show(shown_text(sentence), style="yellow")
            console.print(
                tr("The same rows.")
                if not told
                else tr("1 difference.")
                if len(told) == 1
                else tr(f"{len(told)} differences."),
                highlight=True,
            )
            raise typer.Exit(1 if told else 0)
        with progress_line() as tell:
            found: Checked = (
                verify_files(open_one, folders)
                if folders
                else verify_archive(open_one, deep=not quick, tell=tell)
            )
        # The outbox belongs to the archive of the settings.
        lost = [] if archive or folders else _lost(place.outbox, open_one)
        for item in lost:
            line = tr(
                f"{item.name} was delivered, and is not in the archive any more. Send it again: "
                f"ocmm archive send {item.path}"
            )
            console.print(shown_text(line), style="yellow")
        for job, why in found.faults:
            line = shown_text(f"{job[:8]}  {tr(why)}")
            console.print(line, style="yellow")
        if mark:
            marked = mark_altered(open_one, found, who)
            console.print(
                tr("Marked 1 job: it counts in no statistic.")
                if marked == 1
                else tr(f"Marked {marked} jobs: they count in no statistic.")
            )
    wrong = len(found.faults) + len(lost)
    console.show(f"Checked {found.looked_at}, wrong {wrong}")
    raise typer.Exit(1 if wrong else 0)


def _lost(outbox: Path, archive: OpenArchive) -> list[Item]:
    from ocmm_shop.archive.outbox import Outbox, lost_deliveries

    if not Outbox.is_in(outbox):
        return []
    with Outbox(outbox) as box:
        return lost_deliveries(box, archive)


def _print_answer(console: PlainConsole, answer: ArchiveAnswer) -> None:
    from ocmm_shop.archive.records import shown_text

    rows = [[_cell(cell) for cell in row] for row in answer.rows]
    print_grid(console, answer.columns, rows, answer.title)
    for note in answer.notes:
        console.show(shown_text(note), style="yellow")
    for trend in answer.trends:
        if trend.chart is not None:
            counted = [part for part in trend.parts if part.value is not None]
            for index, why in trend.chart.signals[-8:]:
                console.print(f"{counted[index].job}: {tr_word(why.rule)}, {tr_word(why.value)}.")
    if answer.study is not None:
        console.show(f"Gauge R&R: {answer.study.word}.")


def _cell(cell: object) -> Text:
    from rich.text import Text

    from ocmm_core.tolerances.decisions import PartWord, Verdict
    from ocmm_shop.archive.records import shown_text

    styles = {
        PartWord.CONFORMS.value: "green",
        Verdict.CONFORM.value: "green",
        PartWord.DOES_NOT_CONFORM.value: "bold red",
        Verdict.NOT_CONFORM.value: "bold red",
        Verdict.NOT_PROVEN.value: "yellow",
        PartWord.NOT_PROVEN.value: "yellow",
        PartWord.NOT_COMPLETE.value: "yellow",
    }
    # Names come from anywhere: print them as text, never as markup.
    if cell is None:
        return Text("–")
    if isinstance(cell, float):
        return Text(f"{cell:.4f}")
    return Text(shown_text(str(cell)), styles.get(str(cell), ""))
