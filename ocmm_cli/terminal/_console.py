"""Translated messages, the console, and Ctrl-C.

JSON, CSV, files, exit codes and the last line of a measurement are not translated: programs read
them. Numbers keep their decimal point. Printed text is never read as markup or control codes.
"""

from __future__ import annotations

import functools
import os
import re
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol

from rich.console import Console
from rich.text import Text

from ocmm_core.errors import OcmmError
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


def say(text: str) -> str:
    """Translate a sentence; unknown ones stay in English."""
    said = text.strip()
    before, _, behind = text.partition(said) if said else (text, "", "")
    found = _translation().of(said)
    return f"{before}{_translation().word(said) if found == said else found}{behind}"


def say_word(text: str) -> str:
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


def say_later(text: str) -> str:
    """Mark a text of a module for translation; the printing code calls `say`."""
    return text


def told(one: _Told) -> str:
    """Return what happened and what to do about it, translated."""
    return f"{say(one.what)} {say(one.remedy)}".strip()


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

    def say(self, text: str, **options: Any) -> None:
        """Print a translated sentence."""
        self.print(say(text), **options)


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
        console.print(told(note), style="yellow")


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
        console.say(sentence, style="yellow" if is_assumed else "dim")


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
