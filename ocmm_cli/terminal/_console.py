"""Translated messages, the console, and Ctrl-C.

JSON, CSV, files, exit codes and the last line of a measurement are not translated: programs read
them. Numbers keep their decimal point. Printed text is never read as markup or control codes.
"""

from __future__ import annotations

import functools
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

import typer
from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.wording import Translation, language_of, load_translation

if TYPE_CHECKING:
    from ocmm_core.settings import Note
    from ocmm_core.tables import TableAccount


class _Told(Protocol):
    """An error, a finding, a note: what happened, and what to do."""

    @property
    def what(self) -> str: ...

    @property
    def remedy(self) -> str: ...


def language(environment: Mapping[str, str]) -> str:
    """Return the language of the commands: `--language`, the window's setting, or the system's."""
    from ocmm_core.settings import SettingsStore

    chosen = ""
    if not environment.get("OCMM_LANGUAGE"):
        try:
            chosen = str(SettingsStore.of_this_user().load().values["window.language"])
        except OcmmError:
            chosen = ""  # unreadable settings are reported elsewhere
    return language_of(environment, chosen)


def tr(text: str) -> str:
    """Translate a sentence; unknown ones stay in English."""
    said = text.strip()
    before, _, behind = text.partition(said) if said else (text, "", "")
    found = _translation().translate(said)
    return f"{before}{_translation().word(said) if found == said else found}{behind}"


def tr_word(text: str) -> str:
    """Translate a word: a heading, a verdict."""
    return _translation().word(text)


def heads(*words: str) -> tuple[str, ...]:
    return tuple(_translation().word(word) for word in words)


def lead(label: str) -> str:
    """Translate the label before a value, padded to the same width if it fits."""
    word = label.strip()
    before = label[: len(label) - len(label.lstrip())]
    shown = f"{before}{_translation().word(word)}"
    return f"{shown} " if len(shown) >= len(label) else shown.ljust(len(label))


def tr_later(text: str) -> str:
    """Mark a text of a module for translation; the printing code calls `tr`."""
    return text


def error_text(one: _Told) -> str:
    """Return what happened and what to do about it, translated."""
    return f"{tr(one.what)} {tr(one.remedy)}".strip()


@functools.cache
def _translation() -> Translation:
    try:
        return load_translation(language(os.environ))
    except OcmmError:
        return Translation({}, {})


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

    Brackets are no markup, control characters show their code; numbers are not coloured. Style by
    ``style=`` or `Text`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, highlight=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a literal text; every printed string passes here."""
        options["markup"] = options["emoji"] = False
        return super().render_str(shown(text), **options)

    def show(self, text: str, **options: Any) -> None:
        """Print a translated sentence."""
        self.print(tr(text), **options)

    def print_line(self, text: str) -> None:
        """Print a text as one line, which only the terminal breaks."""
        self.print(text, soft_wrap=True)

    def show_line(self, text: str) -> None:
        """Print a translated sentence as `print_line`."""
        self.print_line(tr(text))


def make_console(*, soft_wrap: bool = False, stderr: bool = False) -> PlainConsole:
    """Return the console; ``soft_wrap`` keeps long lines, as pipes and files do."""
    console = PlainConsole(soft_wrap=soft_wrap, stderr=stderr)
    if console.is_terminal:
        return console
    return PlainConsole(width=_UNLIMITED, stderr=stderr)


def print_notes(notes: Iterable[Note], *, stderr: bool = False) -> None:
    """Print what was ignored or is suspect, and what to do, a line each."""
    console = make_console(soft_wrap=True, stderr=stderr)
    for note in notes:
        console.print(error_text(note), style="yellow")


def agrees(question: str) -> bool:
    """Ask at the terminal whether to go on; InputError without a terminal."""
    if not sys.stdin.isatty():
        raise InputError(
            "terminal.nobody_to_ask", "Nobody can be asked here; nothing was changed.",
            "Add --yes, or run it in a terminal.",
        )  # fmt: skip
    return typer.confirm(question, err=True)


@contextmanager
def progress_line() -> Iterator[Callable[[str, float], None]]:
    """Yield a progress function, shown in a transient line of the terminal.

    It takes the current step and the share done. Without a terminal nothing is printed.
    """
    console = PlainConsole(stderr=True)
    if not console.is_terminal:
        yield lambda what, share: None
        return
    with console.status(tr("Starting")) as status:
        yield lambda what, share: status.update(Text(shown(f"{what} ({share:.0%})")))


def print_table_account(account: TableAccount) -> None:
    """Print accepted and omitted data of a reader to stderr; an assumed unit in yellow."""
    console = make_console(stderr=True)
    for sentence in account.sentences():
        is_assumed = sentence.startswith("Unit ") and not account.unit_from
        console.show(sentence, style="yellow" if is_assumed else "dim")


class DeferredInterrupt:
    """Raises KeyboardInterrupt at the next `check`; a second Ctrl-C raises it at once.

    Raised between two steps of any code, it could leave a lock of the station taken, and closing
    the station would wait for that lock forever. `words`: what is kept, and how to continue.
    """

    def __init__(self, words: str = "") -> None:
        self._asked, self._words = False, words
        self._before = None
        # Only the main thread receives signals, and jobs in the background of a shell ignore this.
        in_main = threading.current_thread() is threading.main_thread()
        if in_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._before = signal.signal(signal.SIGINT, self._note)

    def check(self) -> bool:
        """Raise KeyboardInterrupt with the words if it was asked for; return False otherwise."""
        if self._asked:
            raise KeyboardInterrupt(self._words)
        return False

    def close(self) -> None:
        """Restore the handler of before."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.check()
        self._asked = True


_WHOLE = 24
"""A cell up to this width that holds a digit is a value: it stays on one line."""
_LEAST = 14
"""Width down to which the words of a name are kept whole."""
_NUMBER = re.compile(r"[-+−±<>≤≥~ ]*[\d–-][^A-Za-z]*([^\d\s]{0,4})?$")


def print_grid(
    console: PlainConsole,
    heads: Sequence[str],
    rows: Iterable[Sequence[str | Text]],
    title: str = "",
    spare: Sequence[Sequence[str]] = (),
) -> None:
    """Print rows below ``heads``; a console that is too narrow gets a block of lines each row.

    ``spare``: groups of heads left out, one after the other, before the table becomes blocks.
    """
    cells = [[_text(cell) for cell in row] for row in rows]
    for count in range(len(spare) + 1):
        left_out = {head for group in spare[:count] for head in group}
        kept = [place for place, head in enumerate(heads) if head not in left_out]
        chosen = [[row[place] for place in kept] for row in cells]
        widths = _widths([heads[place] for place in kept], chosen, console.width)
        if widths is not None:
            break
    else:
        _print_blocks(console, heads, cells, title)
        return
    bare = not any(heads)
    table = Table(
        title=Text(shown(title)) if title else None, title_justify="left",
        box=None if bare else box.SIMPLE_HEAD, show_header=not bare, pad_edge=not bare,
        padding=(0, 3, 0, 0) if bare else (0, 1),
    )  # fmt: skip
    for at, (place, width) in enumerate(zip(kept, widths, strict=True)):
        right = at > 0 and _is_numeric(row[at] for row in chosen)
        table.add_column(
            Text(shown(heads[place])), width=width, justify="right" if right else "left",
            overflow="fold",
        )  # fmt: skip
    for row in chosen:
        table.add_row(*row)
    console.print(table, soft_wrap=False, crop=False)
    if left_out:
        hidden = ", ".join(head for head in heads if head in left_out)
        console.show(f"A wider terminal also shows {hidden}.", style="dim")


def _text(cell: str | Text) -> Text:
    return cell if isinstance(cell, Text) else Text(shown(cell))


def _is_numeric(column: Iterable[Text]) -> bool:
    texts = [cell.plain for cell in column if cell.plain.strip("–- ")]
    return bool(texts) and all(_NUMBER.match(text) for text in texts)


def _is_whole(text: str) -> bool:
    """Return whether a line of a cell is a number with its unit, or a verdict."""
    return text.isupper() or (len(text) <= _WHOLE and any(map(str.isdigit, text)))


def _least(text: str, *, named: bool) -> int:
    """Return the width below which a number or verdict of a line of a cell would be cut."""
    if _NUMBER.match(text) or (_is_whole(text) and not named):
        return cell_len(text)
    words = text.split()
    return max(
        (cell_len(word) if _is_whole(word) and cell_len(word) <= _WHOLE
         else min(cell_len(word), _LEAST) for word in words),
        default=0,
    )  # fmt: skip


def _widths(heads: Sequence[str], rows: list[list[Text]], width: int) -> list[int] | None:
    """Return the width of each column, None if values would be cut."""
    least, most = [], []
    for place, head in enumerate(heads):
        lines = [line for row in rows for line in row[place].plain.split("\n")]
        words = max(map(cell_len, head.split()), default=1)
        least.append(max(words, *(_least(line, named=place == 0) for line in lines), 1))
        most.append(max(least[-1], cell_len(head), *map(cell_len, lines)))
    # A margin on both sides, and three columns between two others.
    left = width - sum(least) - 3 * len(heads) - 1
    if left < 0:
        return None
    while left > 0:
        short = [place for place in range(len(heads)) if least[place] < most[place]]
        if not short:
            break
        least[min(short, key=least.__getitem__)] += 1
        left -= 1
    return least


def _print_blocks(
    console: PlainConsole, heads: Sequence[str], rows: list[list[Text]], title: str
) -> None:
    """Print the first cell of each row, and below it a line for each other cell."""
    if title:
        console.print(title, style="italic")
    label = max(map(cell_len, heads[1:]), default=0) + 4
    for first, *others in rows:
        name = first.plain
        if _NUMBER.match(name) and heads[0]:
            first = Text(f"{shown(heads[0])} ") + first
        if name:
            console.print(first)
        for head, cell in zip(heads[1:], others, strict=True):
            if not cell.plain:
                continue
            said = Text(f"  {shown(head)}")
            if "\n" not in cell.plain and label + cell_len(cell.plain) <= console.width:
                said.pad_right(label - cell_len(said.plain))
                console.print(said + cell)
                continue
            if head:
                console.print(said)
            for line in cell.wrap(console, console.width - 4, overflow="fold"):
                console.print(Text("    ") + line)
