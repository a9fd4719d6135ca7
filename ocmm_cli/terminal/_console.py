"""Console of the command line: printed text is never read as markup or control codes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from ocmm_cli.terminal import say, told

if TYPE_CHECKING:
    from ocmm_core.settings import Note
    from ocmm_core.tables import TableAccount


_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def shown(text: str) -> str:
    """Return a text with control characters replaced by their codes."""
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


_UNLIMITED = 100_000
"""Width of a pipe or file: nothing is wrapped there. COLUMNS does not count: readline sets it in
programs that start commands."""


class PlainConsole(Console):
    """A console that prints texts literally: most contain foreign names and paths.

    Brackets are no markup, control characters show their code; style by ``style=`` or `Text`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a literal text; every printed string passes here."""
        options["markup"] = options["emoji"] = False
        return super().render_str(shown(text), **options)


def make_console(*, soft_wrap: bool = False, stderr: bool = False) -> Console:
    """Return the console; ``soft_wrap`` keeps long lines, as pipes and files do."""
    console = PlainConsole(soft_wrap=soft_wrap, stderr=stderr)
    if console.is_terminal:
        return console
    return PlainConsole(width=_UNLIMITED, stderr=stderr)


def print_notes(notes: Iterable[Note], *, stderr: bool = False) -> None:
    """Print what was ignored or is suspect, and what to do, a line each."""
    console = make_console(soft_wrap=True, stderr=stderr)
    for note in notes:
        console.print(told(note), style="yellow", highlight=False, markup=False)


@contextmanager
def progress_line() -> Iterator[Callable[[str, float], None]]:
    """Yield a progress function, shown in a transient line of the terminal.

    It takes the current step and the share done. Without a terminal nothing is printed.
    """
    console = PlainConsole(stderr=True)
    if not console.is_terminal:
        yield lambda what, share: None
        return
    with console.status(say("Starting")) as status:
        yield lambda what, share: status.update(Text(shown(f"{what} ({share:.0%})")))


def print_table_account(account: TableAccount) -> None:
    """Print accepted and omitted data of a reader to stderr; an assumed unit in yellow."""
    console = make_console(stderr=True)
    for sentence in account.sentences():
        is_assumed = sentence.startswith("Unit ") and not account.unit_from
        console.print(say(sentence), style="yellow" if is_assumed else "dim", highlight=False)
