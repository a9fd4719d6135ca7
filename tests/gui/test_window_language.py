"""The language of the window: German is complete, chosen in the settings, and put to use."""

from __future__ import annotations

import re
import string
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QTranslator
from PySide6.QtWidgets import QApplication, QPushButton
from pytestqt.qtbot import QtBot

from docs.make_texts import LRELEASE, LUPDATE, compiled, extract, languages
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_gui import app
from ocmm_gui.home import StartPurpose, StartWindow
from ocmm_gui.kit import LANGUAGES, NoticeCentre, chosen_language, language_in_use, tr, use_language
from ocmm_gui.kit._texts import language_file
from tests.host import needs_tools

_COMMAND = "Run: python -m docs.make_texts, and translate what is new in resources/i18n/ocmm_de.ts"


@pytest.fixture
def german(qapp: QApplication) -> Iterator[QApplication]:
    """Show German for one test."""
    assert use_language(qapp, "de")
    yield qapp
    use_language(qapp, "en")


def _messages(path: Path) -> list[ElementTree.Element]:
    return list(ElementTree.parse(path).iter("message"))  # noqa: S314 - a file of ours


def _translations(message: ElementTree.Element) -> list[str]:
    """Return the translation, or one for each form of the plural."""
    found = message.find("translation")
    assert found is not None
    return [one.text or "" for one in found.iter("numerusform")] or [found.text or ""]


def _source(message: ElementTree.Element) -> str:
    return message.findtext("source") or ""


def test_every_language_but_english_has_its_file() -> None:
    assert {path.stem for path in languages()} == {f"ocmm_{name}" for name in LANGUAGES[1:]}


@pytest.mark.parametrize("path", languages(), ids=lambda path: path.stem)
def test_lupdate_finds_nothing_new(path: Path, tmp_path: Path) -> None:
    needs_tools(LUPDATE)
    copy = tmp_path / path.name
    copy.write_bytes(path.read_bytes())
    extract(copy)
    before, after = ({_source(one) for one in _messages(file)} for file in (path, copy))
    assert not after - before, f"New sentences: {sorted(after - before)}. {_COMMAND}"
    assert not before - after, f"Sentences that are gone: {sorted(before - after)}. {_COMMAND}"


@pytest.mark.parametrize("path", languages(), ids=lambda path: path.stem)
def test_every_sentence_is_translated(path: Path) -> None:
    missing = [
        _source(message)
        for message in _messages(path)
        if message.find("translation[@type]") is not None or not all(_translations(message))
    ]
    assert not missing, f"{len(missing)} sentences are not translated: {missing[:20]}. {_COMMAND}"


def _fields(sentence: str) -> set[tuple[str, str]]:
    """Return the fields of a sentence with their formats."""
    return {
        (name, form or "")
        for _, name, form, _ in string.Formatter().parse(sentence)
        if name is not None
    }


def _edges(text: str) -> tuple[bool, bool, int]:
    """Return leading and trailing blanks of a sentence part, and its number of lines."""
    return text[:1].isspace(), text[-1:].isspace(), text.count("\n")


@pytest.mark.parametrize("path", languages(), ids=lambda path: path.stem)
def test_a_translation_fills_in_what_the_sentence_does(path: Path) -> None:
    wrong = []
    for message in _messages(path):
        source = _source(message)
        counted = message.get("numerus") == "yes"
        for text in _translations(message):
            same = _fields(text) == _fields(source) if "{" in source else "{" not in text
            counts = not counted or text.count("%n") <= source.count("%n")
            if not (same and counts and _edges(text) == _edges(source)):
                wrong.append((source, text))
        if counted and "%n" not in _translations(message)[-1]:
            wrong.append((source, _translations(message)[-1]))
    assert wrong == []


@pytest.mark.parametrize("path", languages(), ids=lambda path: path.stem)
def test_the_compiled_file_is_up_to_date(path: Path, tmp_path: Path) -> None:
    needs_tools(LRELEASE)
    target = tmp_path / "fresh.qm"
    compiled(path, target)
    shipped = language_file(path.stem.removeprefix("ocmm_"))
    assert shipped.read_bytes() == target.read_bytes(), _COMMAND


@pytest.mark.parametrize(
    ("setting", "wanted", "language"),
    [
        ("de", ["en-US"], "de"),
        ("en", ["de-DE"], "en"),
        ("system", ["de-AT", "en"], "de"),
        ("system", ["de_CH"], "de"),
        ("system", ["DE"], "de"),
        ("system", ["fr-FR", "de", "en"], "de"),
        ("system", ["fr-FR"], "en"),
        ("system", ["dev-XX"], "en"),
        ("system", [], "en"),
        ("", ["", "-", "C"], "en"),
    ],
)
def test_the_language_is_that_of_the_settings_or_of_the_system(
    setting: str, wanted: list[str], language: str
) -> None:
    assert chosen_language(setting, wanted) == language


def test_german_is_put_to_use_and_taken_away(qapp: QApplication) -> None:
    assert tr("Settings") == "Settings"
    for _ in range(3):
        assert use_language(qapp, "de")
        assert language_in_use() == "de"
        assert tr("Settings") == "Einstellungen"
        assert tr("%n outliers.", "1 outlier.", 1) == "1 Ausreißer."
        assert tr("%n outliers.", "1 outlier.", 3) == "3 Ausreißer."
        # Of Qt itself.
        assert qapp.translate("QPlatformTheme", "Cancel") == "Abbrechen"
    assert len(qapp.findChildren(QTranslator)) == 2
    assert use_language(qapp, "en")
    assert tr("Settings") == "Settings"
    assert tr("%n outliers.", "1 outlier.", 1) == "1 outlier."
    assert language_in_use() == "en"


def test_without_the_file_the_window_is_in_english(qapp: QApplication) -> None:
    assert not use_language(qapp, "eo")
    assert tr("Settings") == "Settings"
    use_language(qapp, "en")


def test_a_language_chosen_on_the_start_page_makes_it_anew(
    qtbot: QtBot, tmp_path: Path, german: QApplication
) -> None:
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "u.toml")
    )
    window = StartWindow(store, NoticeCentre())
    qtbot.addWidget(window)
    window.show()
    assert any("Einstellungen" in one.text() for one in window.findChildren(QPushButton))
    window.settings.change("window.language", "en")
    assert window.choice is not None
    assert window.choice.errand is StartPurpose.START
    assert window.choice.section == "window"
    assert not window.isVisible()


_MENTIONS = re.compile(r"neu ?start|restart", re.IGNORECASE)


def test_nobody_is_told_to_start_anew() -> None:
    for path in languages():
        for message in _messages(path):
            for text in _translations(message):
                assert not _MENTIONS.search(text), text


def test_the_language_of_the_command_is_that_of_the_window(
    qapp: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = SettingsStore.of_this_user().load().settings
    for variable, setting, language in (("de", "en", "de"), ("", "de", "de"), ("en", "de", "en")):
        monkeypatch.setenv("OCMM_LANGUAGE", variable)
        app.use_language_of(qapp, replace(settings, window_language=setting))
        assert language_in_use() == language
    use_language(qapp, "en")
