"""In which language a paper speaks: its sentences, its words, and the sign before its decimals."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.errors import OcmmError
from ocmm_core.wording._translation import ENGLISH, Translation, load_translation, with_comma


@dataclass(frozen=True, slots=True)
class Speech:
    """What is written on a paper, in its language; English is what the sources say.

    Names of people, parts and features go past it: only what the program says is translated.
    """

    language: str = ENGLISH
    """One of `LANGUAGES`."""

    def say(self, text: str) -> str:
        """Return sentences of the program; English where one of them is not known."""
        if self.language == ENGLISH:
            return text
        told = self._told()
        whole = told.of(text) if "\n" in text else text
        return whole if whole != text else "\n".join(_line(told, one) for one in text.split("\n"))

    def word(self, text: str) -> str:
        """Return a word of the program: a heading, a verdict, a shape."""
        return text if self.language == ENGLISH else self._told().word(text)

    def number(self, text: str) -> str:
        """Return formatted numbers with the decimal sign of the language."""
        return text if self.language == ENGLISH else with_comma(text)

    def _told(self) -> Translation:
        try:
            return load_translation(self.language, comma=True)
        except OcmmError:
            return Translation({}, {})


def _line(told: Translation, text: str) -> str:
    """Return a word and a sentence, or a sentence with or without the full stop of a paper."""
    head, _, rest = text.partition(": ")
    if told.word(head) != head and told.of(rest) != rest:
        return f"{told.word(head)}: {told.of(rest)}"
    named, mark, identity = text.rpartition(" (")
    if mark and " " not in identity and told.of(named) != named:
        # A rule with its identity, which is the same in every language.
        return f"{told.of(named)} ({identity}"
    for without, after in ((text, ""), (text.removesuffix("."), ".")):
        said = told.of(without)
        if said != without:
            return said if said.endswith(after) else said + after
    return told.word(text)
