"""``ocmm archive``: rebuild from job files, and compare with them."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.archive._app import archive_app, opened, place_of
from ocmm_cli.terminal import make_console, progress_line, say
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_shop.archive.checks import Checked
    from ocmm_shop.archive.outbox import Item
    from ocmm_shop.archive.stores import Archive as OpenArchive


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
            contents, names = (
                files_in(from_archive, unread.append),
                stations_of(from_archive) | names,
            )
        else:
            contents = files_of(folders or [], unread.append)
        target = stack.enter_context(open_archive(new))
        with progress_line() as tell:
            done = rebuild_archive(target, contents, names, tell)
    for sentence in (*unread, *done.unread):
        console.print(say(sentence), style="yellow", highlight=False, markup=False)
    jobs = f"{done.kept} job{'' if done.kept == 1 else 's'}"
    console.print(say(f"Kept {jobs} in {new}"), highlight=False, markup=False)
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
                console.print(
                    say(shown_text(sentence)), style="yellow", highlight=False, markup=False
                )
            console.print(
                say("The same rows.")
                if not told
                else say("1 difference.")
                if len(told) == 1
                else say(f"{len(told)} differences.")
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
            line = say(
                f"{item.name} was delivered, and is not in the archive any more. Send it again: "
                f"ocmm archive send {item.path}"
            )
            console.print(shown_text(line), style="yellow", highlight=False, markup=False)
        for job, why in found.faults:
            line = shown_text(f"{job[:8]}  {say(why)}")
            console.print(line, style="yellow", highlight=False, markup=False)
        if mark:
            marked = mark_altered(open_one, found, who)
            console.print(
                say("Marked 1 job: it counts in no statistic.")
                if marked == 1
                else say(f"Marked {marked} jobs: they count in no statistic."),
                highlight=False,
            )
    wrong = len(found.faults) + len(lost)
    console.print(say(f"Checked {found.looked_at}, wrong {wrong}"), highlight=False)
    raise typer.Exit(1 if wrong else 0)


def _lost(outbox: Path, archive: OpenArchive) -> list[Item]:
    from ocmm_shop.archive.outbox import Outbox, lost_deliveries

    if not Outbox.is_in(outbox):
        return []
    with Outbox(outbox) as box:
        return lost_deliveries(box, archive)
