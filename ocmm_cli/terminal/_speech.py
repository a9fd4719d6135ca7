"""Translated messages of commands.

JSON, CSV, files, exit codes and the last line of a measurement are not translated: programs read
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
