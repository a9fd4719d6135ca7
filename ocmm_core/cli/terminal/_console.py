"""The console of the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

_WIDE = 118


def make_console() -> Console:
    """Return the console; a pipe or file is wide enough for the whole table."""
    console = Console()
    return console if console.is_terminal else Console(width=_WIDE)


@contextmanager
def progress_line() -> Iterator[Callable[[str, float], None]]:
    """Give what tells how far a command is, in a line of the terminal that goes again.

    It gets what is done and the share that is done. Where nobody looks, nothing is printed.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda what, share: None
        return
    with console.status("Starting") as status:
        yield lambda what, share: status.update(f"{what} ({share:.0%})")
