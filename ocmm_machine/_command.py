"""``ocmm correct``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import typer

from ocmm_cli.terminal import PlainConsole, heads, lead, make_console, print_grid, tr, tr_word
from ocmm_core.errors import MeasuringError
from ocmm_core.lazy_exports import TYPE_CHECKING

if TYPE_CHECKING:
    # Loaded by the commands, not by their help.
    from ocmm_machine import CorrectionLine, Machine, Proposal

correct_app = typer.Typer(
    no_args_is_help=True, help="Correct the offsets of a machine tool from finished jobs."
)
_Dialect = Literal["linuxcnc", "fanuc", "heidenhain", "siemens", "mtconnect", "csv"]


@dataclass(frozen=True, slots=True)
class ChosenMachine:
    """Machine of a command, from its options."""

    document: Path
    practice: bool
    records: Path | None

    def open(self) -> Machine:
        from ocmm_machine import Machine

        return Machine.open(self.document, self.records, practice=self.practice)


@correct_app.command()
def preview(
    *, job: Path, machine: ChosenMachine, recut: bool, json: bool, probes: Path | None,
    calibrations: Path | None,
) -> None:  # fmt: skip
    """Show the corrections from a job, and the effect on each characteristic; nothing is written.

    The code at the end confirms exactly this correction: ocmm correct write --confirm CODE.
    """
    found = machine.open().preview(job, recut=recut, probes=probes, calibrations=calibrations)
    if json:
        whole = {"code": found.code, **msgspec.to_builtins(found)}
        typer.echo(msgspec.json.format(msgspec.json.encode(whole), indent=1).decode())
    else:
        _show(make_console(soft_wrap=True), found)


@correct_app.command()
def write(
    *, job: Path, machine: ChosenMachine, dialect: _Dialect, out: Path, who: str, confirm: str,
    recut: bool, probes: Path | None, calibrations: Path | None,
) -> None:  # fmt: skip
    """Record a correction that a person confirms, and write its file for the control.

    Every job corrects once: given again, the same values are written again. On a terminal you are
    asked; elsewhere give --confirm with the code of the preview. Ends with 1 if nothing changes.
    """
    from ocmm_cli.archive import MeasuredJobs
    from ocmm_cli.calibrate import is_yes
    from ocmm_core.storage import read_summary
    from ocmm_shop.archiving import archive_place

    console, opened = make_console(soft_wrap=True), machine.open()
    corrected = MeasuredJobs(None if opened.practice else archive_place(), console)
    found = None
    if not opened.is_last(read_summary(job).head.job_uuid):
        found = opened.preview(job, recut=recut, probes=probes, calibrations=calibrations)
        _show(console, found)
        if not found.changed:
            raise typer.Exit(1)
        if not confirm and console.is_terminal:
            console.show("Write this correction? [y/n] ", end="", highlight=True)
            confirm = found.code if is_yes(console.input()) else ""
        if not confirm:
            raise MeasuringError(
                "correction.confirm",
                "No person has confirmed this correction.",
                "Look at the preview, then give --confirm with its code.",
            )
    corrected.start(job)
    if found is None:
        _print_line(console, opened.write_again(dialect, out, job), out)
        console.show("This correction was recorded before: the same values were written.")
    else:
        line = opened.write(job, found, confirm, who, dialect, out, datetime.now(UTC))
        _print_line(console, line, out)
    corrected.hand_over()


@correct_app.command()
def undo(*, machine: ChosenMachine, dialect: _Dialect, out: Path, who: str, reason: str) -> None:
    """Undo the last correction: write the values before it for the control."""
    line = machine.open().undo(who, reason, dialect, out, datetime.now(UTC))
    _print_line(make_console(soft_wrap=True), line, out)


@correct_app.command(name="set")
def state(
    *, machine: ChosenMachine, values: Annotated[list[str], typer.Argument()], who: str
) -> None:
    """Record values that the control shows, after offsets were changed by hand."""
    given: dict[str, float] = {}
    for name, _, number in (text.rpartition("=") for text in values):
        try:
            given[name] = float(number)
        except ValueError:
            given[name] = math.nan
    line = machine.open().state(given, who, datetime.now(UTC))
    _print_line(make_console(soft_wrap=True), line, None)


@correct_app.command()
def history(*, machine: ChosenMachine) -> None:
    """List all changes of a machine's offsets; an altered register is refused."""
    console, register = make_console(), machine.open().register
    rows = [
        (str(number), one.utc[:19], one.who, tr_word(one.what), one.job, ", ".join(_changes(one)))
        for number, one in enumerate(register.items, 1)
    ]
    print_grid(console, heads("No", "UTC", "By", "What", "Job", "Change"), rows)
    console.print(f"{lead('Register  ')}{register.path}")


def _changes(line: CorrectionLine) -> list[str]:
    return [f"{one} {line.before[one]:g} → {line.after[one]:g}" for one in line.changed]


def _number(value: float | None, sign: str = "+") -> str:
    return "" if value is None else f"{value:{sign}.4f}"


def _show(console: PlainConsole, found: Proposal) -> None:
    if found.practice:
        console.show("PRACTICE: for no machine.", style="yellow")
    for sentence in (*found.refusals, *found.left_out):
        console.show(sentence, style="yellow")
    if found.changes:
        print_grid(
            console,
            heads("Offset", "Old", "Found", "U", "Needed", "Change", "New", "Note"),
            [
                (one.offset, f"{one.before:g} {one.unit}", _number(one.found),
                 _number(one.expanded, ""), _number(one.needed, ""), _number(one.change),
                 f"{one.after:g} {one.unit}", tr(one.why))
                for one in found.changes
            ],
        )  # fmt: skip
        print_grid(
            console,
            heads("Characteristic", "Verdict", "Deviation", "U", "Lower", "Upper", "After", "Note"),
            [
                (one.characteristic, tr_word(one.verdict), _number(one.deviation),
                 _number(one.expanded, ""), _number(one.lower), _number(one.upper),
                 _number(one.predicted), tr(one.why))
                for one in found.effects
            ],
        )  # fmt: skip
    console.print(f"{lead('Code  ')}{found.code}" if found.changed else tr("Nothing is corrected."))


def _print_line(console: PlainConsole, line: CorrectionLine, out: Path | None) -> None:
    for change in _changes(line):
        console.print(change)
    if out is not None:
        console.print(f"{lead('File  ')}{out}")
        console.show("Check that the control shows the old values, then load the file.")
