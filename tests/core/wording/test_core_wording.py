"""Sentences of the core are recognised and shown in another language, or stay unchanged."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from docs.make_core_texts import TEXTS, Texts, catalogue, collect, faults, load_shown
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.wording import (
    ENGLISH,
    LANGUAGES,
    Pattern,
    Translation,
    in_language,
    language_of,
    load_translation,
)
from tests.sources import uncollected

GERMAN = load_translation("de")
COMMAND = "run: python -m docs.make_core_texts, and translate what it lists"


@pytest.fixture(scope="module")
def texts() -> Texts:
    with uncollected():
        return collect()


def test_the_catalogue_is_what_the_sources_say(texts: Texts) -> None:
    stored = load_shown("de").sentences.keys()
    assert stored == texts.sentences.keys(), COMMAND
    english = catalogue(texts.sentences, texts.words, remedies=texts.remedies)
    assert (TEXTS / "core.json").read_text(encoding="utf-8") == english, COMMAND


@pytest.mark.parametrize("language", LANGUAGES[1:])
def test_a_language_has_every_sentence_with_the_same_names(texts: Texts, language: str) -> None:
    assert faults(texts, load_shown(language)) == [], COMMAND


def test_a_fault_of_a_catalogue_is_named(texts: Texts) -> None:
    shown = load_shown("de")
    shown.sentences["Take more points."] = ""
    shown.sentences["{name} is not measured."] = "{nmae} ist nicht gemessen."
    shown.sentences["{name} is measured."] = "{name ist gemessen."
    said = "\n".join(faults(texts, shown))
    assert "not translated: 'Take more points.'" in said
    assert "other names than '{name} is not measured.'" in said
    assert "nobody says: '{name} is measured.'" in said
    assert "braces that do not close: '{name ist gemessen.'" in said


def _by_places(said: str, told: str) -> str:
    """Return a translated sentence with the places of its fields for their names."""
    places = {name: str(place) for place, name in enumerate(Pattern.from_template(said).names)}
    shown = Pattern.from_template(told)
    return shown.filled({name: f"{{{places[name]}}}" for name in shown.names})


def test_sentences_that_differ_by_their_names_alone_are_translated_alike() -> None:
    """The two could not be distinguished, and neither would be shown."""
    stored, shown = json.loads((TEXTS / "core.json").read_text("utf-8")), load_shown("de")
    alike: dict[tuple[str, ...], list[str]] = {}
    for said in shown.sentences:
        alike.setdefault(Pattern.from_template(said).literals, []).append(said)
    for group in alike.values():
        # The code of an error distinguishes them.
        uncoded = [said for said in group if not stored["sentences"][said]]
        told = {_by_places(said, shown.sentences[said]) for said in uncoded}
        assert len(told) <= 1, uncoded


def test_there_are_sentences_of_every_kind(texts: Texts) -> None:
    """A source that is read otherwise would empty the catalogue and all tests of it."""
    assert len(texts.sentences) > 4000
    assert sum(bool(codes) for codes in texts.sentences.values()) > 1500
    assert "NOT CONFORM" in texts.words
    assert texts.sentences["Only {count} of {expected} frames agree."] == ["point.few_inliers"] or (
        "Only {count} of {expected} frames agree." in texts.sentences
    )


def test_what_was_filled_in_stands_in_the_other_sentence_as_it_was() -> None:
    error = OcmmError(
        "plan.field",
        "/data/ä b/x.toml: field 'features[2].name' is empty: nothing to measure.",
        "Correct that field of the plan.",
    )
    assert in_language(error, "de") == (
        "/data/ä b/x.toml: Feld „features[2].name“ ist leer: nichts zu messen.",
        "Dieses Feld des Prüfplans berichtigen.",
    )
    assert in_language(error, ENGLISH) == (error.what, error.remedy)


def test_several_sentences_are_shown_together_or_not_at_all() -> None:
    both = "Undo the points that do not belong here and take them again. Take more points."
    assert GERMAN.translate(both) == (
        "Punkte, die nicht hierher gehören, zurücknehmen und neu aufnehmen. Mehr Punkte aufnehmen."
    )
    half = "Take more points. This sentence is from a later version."
    assert GERMAN.translate(half) == half


def test_what_is_not_known_stays_english() -> None:
    for text in ("", "17.3", "No such sentence.", "{", "}{", "%s", "\0", "Take more\npoints."):
        assert GERMAN.translate(text) == text


def test_a_text_that_can_be_read_in_two_ways_stays_english() -> None:
    either = Translation({"{first} and {second} differ.": "{second} weicht von {first} ab."}, {})
    assert either.translate("A and B differ.") == "B weicht von A ab."
    assert either.translate("A and B and C differ.") == "A and B and C differ."
    same = Translation({"{kind} {name} is missing.": "{kind} {name} fehlt."}, {})
    assert same.translate("Round slot A 1 is missing.") == "Round slot A 1 fehlt."


def test_two_sentences_that_say_the_same_words_stay_english() -> None:
    two = Translation({"{a} is bad.": "{a} ist schlecht.", "{b} is bad.": "{b} taugt nichts."}, {})
    assert two.translate("It is bad.") == "It is bad."
    with_code = Translation(
        {"{a} is bad.": "{a} ist schlecht.", "{b} is bad.": "{b} taugt nichts."},
        {},
        {"{a} is bad.": ["x.one"], "{b} is bad.": ["x.two"]},
    )
    assert with_code.translate("It is bad.", "x.two") == "It taugt nichts."


def test_a_number_is_a_number() -> None:
    pattern = Pattern.from_template("{size:n} mm of {total:n} mm")
    assert pattern.fillings("1.5 mm of -2e-3 mm") == (("1.5", "-2e-3"),)
    assert pattern.fillings("x mm of 2 mm") == ()
    assert pattern.fillings("1.5 mm of 2 mm of 3 mm") == ()


_TOKENS = ("Ring-7", "a/b.toml", "12", "BORE 1", "x")


def _filled(pattern: Pattern, values: dict[str, str]) -> str:
    return pattern.filled(values)


def _values(pattern: Pattern, rng: np.random.Generator, hostile: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for name, mark in zip(pattern.names, pattern.marks, strict=True):
        if mark == "n":
            found[name] = f"{rng.normal(0.0, 100.0):.3f}"
        elif mark == "k":
            found[name] = "CONFORM"
        elif mark == "s":
            found[name] = "too many spots could be LEDs"
        else:
            found[name] = str(rng.choice(hostile or _TOKENS))
    return found


def _expected(said: Pattern, shown: Pattern, values: dict[str, str]) -> str:
    """Return the German sentence with its values, their words and sentences translated."""
    words = {}
    for name, mark in zip(said.names, said.marks, strict=True):
        value = values[name]
        words[name] = value
        if mark in ("w", "k"):
            words[name] = GERMAN.word(value)
        elif mark == "s":
            words[name] = GERMAN.translate(value)
    return shown.filled(words)


def test_every_sentence_is_recognised(texts: Texts) -> None:
    """Over all sentences: the German one, or the English one, and nothing else."""
    rng = np.random.default_rng(82)
    shown = load_shown("de").sentences
    english: list[tuple[str, str, str]] = []
    other: list[tuple[str, str, str]] = []
    for template, codes in texts.sentences.items():
        said, german = Pattern.from_template(template), Pattern.from_template(shown[template])
        values = _values(said, rng, ())
        text = _filled(said, values)
        got = GERMAN.translate(text, codes[0] if codes else "")
        wanted = _expected(said, german, values)
        if got == wanted:
            continue
        (english if got == text else other).append((template, text, got))
    assert other == []
    assert len(english) < 0.01 * len(texts.sentences), english


_HOSTILE = (
    "", " ", "is missing.", "x. Take more points.", "{name}", "{0.__class__}", "%s %n", "3.5 mm",
    "a and b", "'", "„“", "A, B and C", "frame 3 of 4", "\N{RIGHT-TO-LEFT OVERRIDE}abc",
    "<b>x</b>", "of 3 frames agree.", "Camera 'A'", "/data/a b: c (d).toml", "-1e999", "é" * 300,
)  # fmt: skip


def test_hostile_names_change_no_number_and_make_no_other_sentence(texts: Texts) -> None:
    """Values are copied; if they turn it into another sentence, its numbers stay the same."""
    rng = np.random.default_rng(8292)
    shown = load_shown("de").sentences
    strange = []
    with_fields = [one for one in texts.sentences if "{" in one]
    for template in rng.choice(with_fields, 400, replace=False):
        codes = texts.sentences[template]
        said, german = Pattern.from_template(template), Pattern.from_template(shown[template])
        for _ in range(3):
            values = _values(said, rng, _HOSTILE)
            text = _filled(said, values)
            got = GERMAN.translate(text, codes[0] if codes else "")
            if got in (text, text.strip(), _expected(said, german, values)):
                continue
            if _digits(got) != _digits(text):
                strange.append((template, values, got))
    assert strange == []


def _digits(text: str) -> Counter[str]:
    return Counter(re.findall(r"\d+", text))


def test_no_translation_adds_or_loses_a_number(texts: Texts) -> None:
    shown = load_shown("de").sentences
    assert {said: told for said, told in shown.items() if _digits(said) != _digits(told)} == {}


def test_time_does_not_explode_with_a_hostile_text() -> None:
    """Places that led nowhere are not tried again: steps, not seconds, are bounded."""
    pattern = Pattern.from_template("{a}a{b}a{c}a{d}a{e}a{f:n} mm")
    assert pattern.fillings("a" * 1500 + " mm") == ()


def test_the_language_is_that_of_the_variable_the_setting_or_the_system() -> None:
    assert language_of({}) == ENGLISH
    assert language_of({"LANG": "de_DE.UTF-8"}) == "de"
    assert language_of({"LANG": "de_DE.UTF-8", "LC_MESSAGES": "C"}) == ENGLISH
    assert language_of({"LC_ALL": "fr_FR", "LANG": "de_DE"}) == ENGLISH
    assert language_of({"LANG": "de_DE"}, "en") == ENGLISH
    assert language_of({"LANG": "C"}, "de") == "de"
    assert language_of({"OCMM_LANGUAGE": "en"}, "de") == ENGLISH
    assert language_of({"OCMM_LANGUAGE": "de"}, "en") == "de"
    assert language_of({"OCMM_LANGUAGE": "klingon", "LANG": "de"}) == "de"


def test_a_damaged_catalogue_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "core.json").write_text("[]")
    monkeypatch.setattr(
        "ocmm_core.wording._translation.resource", lambda *parts: tmp_path.joinpath(*parts[1:])
    )
    with pytest.raises(InputError, match="speaks English"):
        load_translation.__wrapped__("de")


_LEFT = re.compile(r"\{\w+(?::n)?\} ((?:\w+ )?)(\w{3,}?)s (?:\w+ )*?(?:to go|missing|left out)\b")


def test_what_is_still_to_do_has_a_sentence_for_one(texts: Texts) -> None:
    """A countdown reaches one in the end."""
    counted = [(one, found) for one in texts.sentences if (found := _LEFT.search(one))]
    assert len(counted) > 8
    alone = [
        one
        for one, found in counted
        # "3 of 12 attitudes to go" stays right with one.
        if not one[: found.end(2)].partition(" of ")[2]
        and not any(_says_one(other, found) for other in texts.sentences)
    ]
    assert not alone


def _says_one(sentence: str, found: re.Match[str]) -> bool:
    head, tail = re.escape(found.string[: found.start()]), re.escape(found[1] + found[2])
    return re.match(rf"{head}(1|\{{\w+(:n)?\}}) {tail}\b(?!s)", sentence) is not None


def test_a_known_phrase_of_many_words_is_a_word() -> None:
    away, weg = "leaning away from the cameras", "von den Kameras weg geneigt"
    translation = Translation({"Hold it {hold:w}.": "{hold} halten.", away: weg}, {})
    assert translation.translate(f"Hold it {away}.") == f"{weg} halten."
    assert translation.translate("Hold it leaning away from the door.").startswith("Hold")


def test_a_sentence_is_not_taken_for_a_name() -> None:
    translation = Translation(
        {
            "{name} does not count. {why:s}": "{name} zählt nicht. {why}",
            "{job} has no such characteristic.": "{job} hat kein solches Merkmal.",
        },
        {},
    )
    text = "Bore X does not count. DEMO-001 has no such characteristic."
    assert translation.translate(text) == "Bore X zählt nicht. DEMO-001 hat kein solches Merkmal."
