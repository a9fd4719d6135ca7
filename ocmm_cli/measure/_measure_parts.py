"""Prompt between two parts of a batch on the terminal."""

from __future__ import annotations

from rich.console import Console

from ocmm_cli.terminal import say
from ocmm_core.errors import MeasuringError

_NO = ("q", "quit", "n", "no", "nein")


def await_part(console: Console, number: int, parts: int, serial: str, *, replayed: bool) -> None:
    """Wait for the confirmation that the next part is in place; else raise MeasuringError."""
    console.print(
        say(f"Part {number} of {parts} is next, serial {serial}.")
        + " "
        + (
            say("The recording restarts from the beginning.")
            if replayed
            else say("Put it in place and keep hands and probe off it.")
        )
    )
    try:
        answer = console.input(say("Enter: measure it; q and Enter: stop: "))
    except EOFError:
        console.print()
        raise _ended(number, parts, serial, "no answer: end of input") from None
    if not console.is_terminal:
        # No Enter has ended the line.
        console.print()
    if answer.strip().lower() in _NO:
        raise _ended(number, parts, serial, "stopped by the operator")


def _ended(number: int, parts: int, serial: str, why: str) -> MeasuringError:
    left = parts - number + 1
    return MeasuringError(
        "measure.parts_left",
        f"Part {number} of {parts} was not started ({why}).",
        f"The parts before it are complete. Continue with --serial {serial} --parts {left}.",
    )
