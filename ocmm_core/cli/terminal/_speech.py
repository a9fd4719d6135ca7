"""What a command says to whoever reads the terminal, in their language.

JSON, CSV, files, exit codes and the last line of a measurement stay as they are: programs read
them. Numbers keep their decimal point.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping
from typing import Protocol

from ocmm_core.errors import OcmmError
from ocmm_core.wording import Translation, language_of, load_translation


class _Told(Protocol):
    """An error, a finding, a note: what is so, and what to do."""

    @property
    def what(self) -> str: ...

    @property
    def remedy(self) -> str: ...


def language(environment: Mapping[str, str]) -> str:
    """Return the language of the commands: `--language`, that of the window, or the system's."""
    from ocmm_core.settings import SettingsStore

    chosen = ""
    if not environment.get("OCMM_LANGUAGE"):
        try:
            chosen = str(SettingsStore.of_this_user().load().values["window.language"])
        except OcmmError:
            chosen = ""  # settings that cannot be read are told elsewhere
    return language_of(environment, chosen)


def say(text: str) -> str:
    """Return what the program says in the language; English where a sentence is not known."""
    said = text.strip()
    before, _, behind = text.partition(said) if said else (text, "", "")
    found = _translation().of(said)
    return f"{before}{_translation().word(said) if found == said else found}{behind}"


def say_word(text: str) -> str:
    """Return a word of the program in the language: a heading, a verdict."""
    return _translation().word(text)


def heads(*words: str) -> tuple[str, ...]:
    """Return the heads of a table in the language."""
    return tuple(_translation().word(word) for word in words)


def lead(label: str) -> str:
    """Return what stands before a value, as wide in every language where it fits."""
    word = label.strip()
    before = label[: len(label) - len(label.lstrip())]
    shown = f"{before}{_translation().word(word)}"
    return f"{shown} " if len(shown) >= len(label) else shown.ljust(len(label))


def say_later(text: str) -> str:
    """Mark a text of a module for translation; whoever prints it calls `say`."""
    return text


def told(one: _Told) -> str:
    """Return what is so and what to do about it, in the language."""
    return f"{say(one.what)} {say(one.remedy)}".strip()


@functools.cache
def _translation() -> Translation:
    try:
        return load_translation(language(os.environ))
    except OcmmError:
        return Translation({}, {})
