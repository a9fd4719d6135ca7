"""Report of the doctor on a terminal: the light as a word, then finding and remedy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from ocmm_cli.terminal import print_grid, say, say_word, shown
from ocmm_core.doctor import Light, can_undo

if TYPE_CHECKING:
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.doctor import Computer, DoctorReport, Mended, SystemChange

_STYLES = {
    Light.GREEN: "bold green",
    Light.AMBER: "bold yellow",
    Light.RED: "bold red",
    Light.NOT_CHECKED: "bold cyan",
}


def print_report(report: DoctorReport, console: PlainConsole) -> None:
    rows = []
    for one in report.results:
        text = Text(shown(say(one.what)))
        if one.remedy:
            # In front: a command at the end of the line can be copied.
            fix = f"{say('With --fix, or:')} " if one.fixable else ""
            text.append(f"\n-> {fix}{shown(say(one.remedy))}", style="italic")
        light = Text(say_word(one.light.value), style=_STYLES[one.light])
        rows.append((light, say_word(one.title), text))
    print_grid(console, ("", "", ""), rows)
    counts = [(light, len(report.having(light))) for light in Light]
    console.print()
    console.print(Text(f"{say(f'This computer is {report.light.value}:')} ", style="bold").append(
        ", ".join(f"{count} {say_word(light.value)}" for light, count in counts if count) + "."
    ))  # fmt: skip


def print_hint(computer: Computer, changes: Sequence[SystemChange], console: PlainConsole) -> None:
    """Print the effect of --fix and --undo here, if any."""
    if changes:
        console.say("--fix puts right what says so: it shows the changes, asks, and can be undone.")
    if can_undo(computer):
        console.say("--undo takes back what --fix changed.")


def print_changes(changes: Sequence[SystemChange], console: PlainConsole) -> None:
    """Print changes; those that differ only by a number share a line."""
    alike: dict[str, list[str]] = {}
    for one in changes:
        alike.setdefault(re.sub(r"(cpu|irq/|state)\d+", r"\1N", one.words), []).append(one.words)
    for pattern, words in alike.items():
        console.print(
            say(f"  {pattern} ({len(words)} times)") if len(words) > 1 else f"  {say(words[0])}",
            highlight=True,
        )


def print_mended(done: Sequence[Mended], what: str, console: PlainConsole) -> None:
    for one in done:
        if one.complaint:
            console.print(
                f"  {say('Not done:')} {one.change.place}: {say(one.complaint)}", highlight=True
            )
    good = sum(not one.complaint for one in done)
    console.print(f"{say(f'{good:d} of {len(done)}')} {what}.", highlight=True)
