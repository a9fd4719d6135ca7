"""The console of the command line."""

from __future__ import annotations

from rich.console import Console

_WIDE = 118


def make_console() -> Console:
    """Return the console; a pipe or file is wide enough for the whole table."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDE)
