"""Find the other language in a window: words of its sentences that the shown one never uses."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache

import msgspec
from PySide6.QtWidgets import QWidget

from ocmm_core.documents import resource
from tests.gui.cut_words import painted_words

_WORD = re.compile(r"[^\W\d_]{3,}")
_READ = ("text", "title", "toolTip", "accessibleName", "accessibleDescription", "placeholderText")

_NAMES = frozenset(
    (
        "ball", "bed", "demo", "inspector", "quick", "recommended", "right", "sphere", "step",
        "study", "versions", "zoom",
    )
)  # fmt: skip
"""In the names of shipped documents and their parts, of programs, and equal in both languages."""

_SETTINGS = frozenset({"window", "locale", "off"})
"""Values of settings, as in the settings file."""

_PATH = re.compile(r"\S*/\S+|\bocmm [a-z]+( [a-z]+)?|\b[A-Za-z]+_\w+|\bvirtual [a-z ]+\d")
"""Paths, commands, symbols such as P_Form, and names of virtual artefacts."""


@cache
def foreign_words(language: str) -> frozenset[str]:
    """Return the words that only the sentences of the other language have, in lower case."""
    english, german = set[str](), set[str]()
    core = msgspec.json.decode(resource("i18n", "core_de.json").read_bytes())
    pairs = {key: text for part in core.values() for key, text in part.items()}
    window = ElementTree.parse(resource("i18n", "ocmm_de.ts"))  # noqa: S314 - a file of ours
    for message in window.iter("message"):
        found = message.find("translation")
        assert found is not None
        pairs[message.findtext("source") or ""] = "".join(found.itertext())
    for source, translation in pairs.items():
        english.update(_words(source))
        german.update(_words(translation))
    foreign = german - english if language == "en" else english - german
    return frozenset(foreign - _NAMES - _SETTINGS)


def english_in(widget: QWidget) -> Iterator[str]:
    """Yield every text of visible widgets with a word that is English only."""
    yield from foreign_in(widget, "de")


def foreign_in(widget: QWidget, language: str) -> Iterator[str]:
    """Yield every text of visible widgets with a word of the other language than ``language``."""
    foreign = foreign_words(language)
    for one in (widget, *widget.findChildren(QWidget)):
        if not one.isVisibleTo(widget):
            continue
        for attribute in _READ:
            read = getattr(one, attribute, None)
            text = read() if callable(read) else read
            if isinstance(text, str) and foreign.intersection(_words(text)):
                yield f"{type(one).__name__}.{attribute}: {text}"
    for name, text in painted_words(widget):
        if foreign.intersection(_words(text)):
            yield f"painted by {name}: {text}"


def _words(text: str) -> set[str]:
    bare = re.sub(r"\{[^}]*\}|<[^>]*>", " ", _PATH.sub(" ", text))
    return {word.lower() for word in _WORD.findall(bare)}
