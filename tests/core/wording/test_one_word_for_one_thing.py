"""One German word for one thing: in the window, in the sentences of the core and in the manual."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from ocmm_core.documents import resource

_MANUAL = Path(__file__).resolve().parents[3] / "docs" / "de"

_NOT_SAID = {
    r"\bspots?\b": r"[Ll]ichtfleck",
    r"\bjobs?\b": r"\bJobs?\b",
    r"\bartefacts?\b": r"\bNormalen?\b|\bNormals?\b",
    r"\bsweeps?\b": r"\bDurchgang",
    r"\bpart\b": r"\b[Dd]as Teil\b|virtuelles Teil\b",
    r"\brig\b": r"\bAufbau\b",
}
"""Meanings of English words, and German words that deviate from all other texts: Lichtpunkt,
Auftrag, Prüfkörper, Schwenken, Werkstück, Kamerasystem."""


def _window() -> list[tuple[str, str]]:
    tree = ElementTree.parse(resource("i18n", "ocmm_de.ts"))  # noqa: S314 - a file of ours
    return [
        (message.findtext("source") or "", " ".join(told.itertext()))
        for message in tree.iter("message")
        for told in message.iter("translation")
    ]


def _core() -> list[tuple[str, str]]:
    stored = json.loads(resource("i18n", "core_de.json").read_text("utf-8"))
    return [*stored["sentences"].items(), *stored["words"].items()]


@pytest.mark.parametrize("english", _NOT_SAID)
def test_window_and_core_say_the_same_word(english: str) -> None:
    pairs = [pair for pair in (*_window(), *_core()) if re.search(english, pair[0], re.I)]
    assert len(pairs) > 4
    other = [pair for pair in pairs if re.search(_NOT_SAID[english], pair[1])]
    assert not other, other


def test_the_manual_says_the_word_of_the_window() -> None:
    pages = sorted(_MANUAL.rglob("*.md"))
    assert len(pages) > 20
    assert not [page.name for page in pages if "lichtfleck" in page.read_text("utf-8").lower()]
