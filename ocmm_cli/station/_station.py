"""``ocmm station doctor``: whether this computer is fit to measure, and changes that mend it."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import agrees, make_console, print_grid, progress_line, shown, tr, tr_word
from ocmm_core.errors import InputError, StorageError
from ocmm_core.host import require_linux

if TYPE_CHECKING:
    from ocmm_cli.station._doctor import Mended
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.doctor import Computer, DoctorReport, SystemChange


station_app = typer.Typer(no_args_is_help=True, help="The computer that the station runs on.")

_ONE_IS_RED = 1


@station_app.command()
def doctor(
    *, interface: str, jobs: Path | None, seconds: float, as_json: bool, fix: bool, yes: bool,
    take_back: bool,
) -> None:  # fmt: skip
    """Check this computer as a technician would, and say what to do: a line for each check.

    GREEN: as it should be. AMBER: the station measures, but cycles can come late, or something
    ends soon. RED: the station cannot measure, or what it measures is not kept, proven or
    protected. NOT CHECKED: the computer did not tell; the line says why.

    Measures for a minute how late the computer wakes up: leave it alone, or let run on it what
    runs while it measures parts.

    Exit code 0 where no line is RED, 1 where one is, 2 where the command could not do what was
    asked.
    """
    import msgspec

    from ocmm_cli.station._doctor import measured_checks
    from ocmm_core.doctor import Light, examine, this_computer

    require_linux("The doctor of a station")
    if take_back and fix:
        raise InputError("doctor.both", "--fix and --undo contradict each other.", "Give one.")
    computer = this_computer(interface=interface, jobs=jobs)
    if take_back:
        _take_back(computer)
        return
    if fix:
        _fix(computer, examine(computer)[1], yes=yes)
    with progress_line() as progress:
        report, changes = examine(computer, measured_checks(seconds), progress)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(report), indent=1).decode())
    else:
        console = make_console()
        print_report(report, console)
        print_hint(computer, () if fix else changes, console)
    raise typer.Exit(_ONE_IS_RED if report.light is Light.RED else 0)


def _fix(computer: Computer, changes: tuple[SystemChange, ...], *, yes: bool) -> None:
    """Show the changes, confirm, apply, and print failures."""
    from ocmm_cli.station._doctor import may_mend, mend

    # Separate from output that programs read.
    console = make_console(stderr=True)
    if not changes:
        console.show("Nothing can be put right without a technician.")
        return
    if not may_mend(computer):
        raise StorageError(
            "doctor.no_rights",
            "This user may not change the computer; nothing was changed.",
            f"Type: sudo {Path(sys.argv[0]).absolute()} station doctor --fix",
        )
    console.show("This would be changed:")
    print_changes(changes, console)
    if not yes and not agrees(tr("Change it?")):
        console.show("Nothing was changed.")
        return
    print_mended(mend(computer, changes), tr("changed"), console)
    console.show(
        "Values of kernel and adapter hold until the next start. "
        "To take all of it back: ocmm station doctor --undo\n"
    )


def _take_back(computer: Computer) -> None:
    from ocmm_cli.station._doctor import undo

    done = undo(computer)
    console = make_console()
    print_mended(done, tr("taken back"), console)
    if any(one.failed for one in done):
        raise StorageError(
            "doctor.undo_refused",
            "Not all could be taken back.",
            "Restart the computer, then type it once more.",
        )


def print_report(report: DoctorReport, console: PlainConsole) -> None:
    """Print the checks: the light as a word, then finding and remedy."""
    from rich.text import Text

    from ocmm_core.doctor import Light

    styles = {
        Light.GREEN: "bold green",
        Light.AMBER: "bold yellow",
        Light.RED: "bold red",
        Light.NOT_CHECKED: "bold cyan",
    }
    rows = []
    for one in report.results:
        text = Text(shown(tr(one.what)))
        if one.remedy:
            # In front: a command at the end of the line can be copied.
            fix = f"{tr('With --fix, or:')} " if one.fixable else ""
            text.append(f"\n-> {fix}{shown(tr(one.remedy))}", style="italic")
        light = Text(tr_word(one.light.value), style=styles[one.light])
        rows.append((light, tr_word(one.title), text))
    print_grid(console, ("", "", ""), rows)
    counts = [(light, len(report.having(light))) for light in Light]
    console.print()
    console.print(Text(f"{tr(f'This computer is {report.light.value}:')} ", style="bold").append(
        ", ".join(f"{count} {tr_word(light.value)}" for light, count in counts if count) + "."
    ))  # fmt: skip


def print_hint(computer: Computer, changes: Sequence[SystemChange], console: PlainConsole) -> None:
    """Print the effect of --fix and --undo here, if any."""
    from ocmm_cli.station._doctor import can_undo

    if changes:
        console.show(
            "--fix puts right what says so: it shows the changes, asks, and can be undone."
        )
    if can_undo(computer):
        console.show("--undo takes back what --fix changed.")


def print_changes(changes: Sequence[SystemChange], console: PlainConsole) -> None:
    """Print changes; those that differ only by a number share a line."""
    alike: dict[str, list[str]] = {}
    for one in changes:
        alike.setdefault(re.sub(r"(cpu|irq/|state)\d+", r"\1N", one.summary), []).append(
            one.summary
        )
    for pattern, words in alike.items():
        console.print(
            tr(f"  {pattern} ({len(words)} times)") if len(words) > 1 else f"  {tr(words[0])}",
            highlight=True,
        )


def print_mended(done: Sequence[Mended], what: str, console: PlainConsole) -> None:
    for one in done:
        if one.complaint:
            console.print(
                f"  {tr('Not done:')} {one.change.place}: {tr(one.complaint)}", highlight=True
            )
    good = sum(not one.complaint for one in done)
    console.print(f"{tr(f'{good:d} of {len(done)}')} {what}.", highlight=True)
