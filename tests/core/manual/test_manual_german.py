"""German pages of the manual: same content and order as the English ones, and up to date."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from pathlib import Path

import pytest

from docs import translations
from ocmm_core.manual import Manual, Place, load_manual, mark_of

_DOCS = Path(__file__).resolve().parents[3] / "docs"
_PAGES = translations.pages(_DOCS / "de")
_LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s]*)\)")
_FENCED = re.compile(r"^( *)```.*?^\1```", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"(?<=\n\n)(?: {4}\S.*\n)+")
_CODE = re.compile(r"`([^`]+)`")
_ENGLISH = re.compile(r"\b(?:the|and|which|with|that|from)\b")


@pytest.fixture(scope="module")
def english() -> Manual:
    """Return the manual in English."""
    return load_manual()


@pytest.fixture(scope="module")
def german() -> Manual:
    """Return the manual as a German window shows it."""
    return load_manual(language="de")


def _raw(name: str, folder: str = "") -> str:
    return (_DOCS / folder / name).read_text(encoding="utf-8")


def _folder(name: str) -> str:
    return posixpath.dirname(name)


def _blocks(text: str) -> list[str]:
    return [found.group().strip("\n") for found in _FENCED.finditer(text)] + [
        found.group() for found in _INDENTED.finditer(_FENCED.sub("", text))
    ]


def _links(text: str, folder: str) -> Counter[str]:
    """Return the targets of links, below the folder of the manual, in any language."""
    found = []
    for _picture, link in _LINK.findall(_FENCED.sub("", text)):
        path, mark, anchor = link.partition("#")
        if path and ":" not in path:
            path = posixpath.normpath(posixpath.join(folder, path)).removeprefix("de/")
        found.append(path + mark + anchor)
    return Counter(found)


def test_no_german_page_is_behind_the_english_one() -> None:
    behind = translations.behind()
    assert not behind, (
        f"Changed in English since: {behind}. Translate what changed in docs/de, then run: "
        f"python -m docs.translations {' '.join(behind)}"
    )


def test_what_an_inspector_and_a_technician_meet_is_there_in_german(german: Manual) -> None:
    """The pages that F1 opens while a part is measured, and those of calibrations and tips."""
    wanted = {
        "start", "colours", "inspecting", "calibrating", "help", "plans", "wizards", "settings",
        "calibration", "calibration_in_use", "probe_calibration", "tip", "probe_in_use",
        "reference_body", "acceptance", "recall", "archive", "exports", "doctor",
    }  # fmt: skip
    assert wanted <= {Path(name).stem for name in _PAGES}
    held = {one.name for one in german.chapters if one.language == "de"}
    assert held == set(_PAGES)


@pytest.mark.parametrize("name", _PAGES)
def test_a_german_page_has_headings_pictures_code_and_links_of_the_english_one(
    name: str, english: Manual, german: Manual
) -> None:
    of_english, of_german = english.chapter(name), german.chapter(name)
    assert of_english is not None
    assert of_german is not None
    assert of_german.language == "de"
    assert of_german.part is of_english.part
    assert [(one.anchor, one.level) for one in of_german.sections] == [
        (one.anchor, one.level) for one in of_english.sections
    ]
    # Both pages have the same numbers of elements: no half page, no table with missing rows.
    for shape in (r"^\|", r"^- ", r"^\d+\. "):
        counts = [
            len(re.findall(shape, one.markdown, re.MULTILINE)) for one in (of_english, of_german)
        ]
        assert counts[0] == counts[1], shape
    assert _blocks(_raw(name, "de")) == _blocks(_raw(name))
    assert _links(_raw(name, "de"), f"de/{_folder(name)}") == _links(_raw(name), _folder(name))


@pytest.mark.parametrize("name", _PAGES)
def test_every_link_and_picture_of_a_german_page_leads_to_a_file_and_to_its_section(
    name: str, german: Manual
) -> None:
    text = _raw(name, "de")
    assert translations.linked(name, text) == text, "run: python -m docs.translations"
    for picture, link in _LINK.findall(_FENCED.sub("", text)):
        path, _, anchor = link.partition("#")
        if ":" in path:
            continue
        if path:
            assert (_DOCS / "de" / _folder(name) / path).is_file(), link
        if picture:
            assert german.picture(name, link) is not None, link
        elif not path or path.endswith(".md"):
            place = german.resolve(name, link)
            # README files next to the sources are not part of the manual.
            assert place is not None or path.startswith("../../../"), link
            assert place is None or place.anchor == anchor, link


@pytest.mark.parametrize("name", _PAGES)
def test_a_german_page_has_the_names_in_code_of_the_english_one_and_is_german(name: str) -> None:
    codes = [
        set(_CODE.findall(" ".join(_FENCED.sub("", _raw(name, folder)).split())))
        for folder in ("", "de")
    ]
    assert codes[0] == codes[1]
    plain = _CODE.sub("", _INDENTED.sub("", _FENCED.sub("", _raw(name, "de"))))
    left = [
        line for line in _LINK.sub("", plain).split("\n")[1:] if len(_ENGLISH.findall(line)) > 1
    ]
    assert not left


def _both(tmp_path: Path, english_text: str, german_text: str) -> Manual:
    (tmp_path / "de").mkdir()
    (tmp_path / "tip.md").write_text(english_text)
    (tmp_path / "plans.md").write_text("# Plans\n## One\n")
    (tmp_path / "picture.png").write_bytes(b"x")
    (tmp_path / "de" / "tip.md").write_text(german_text)
    return load_manual(tmp_path, "de")


def test_links_of_a_german_page_lead_to_the_sections_by_their_english_names(tmp_path: Path) -> None:
    text = "# Tip\n## How it is done\n"
    manual = _both(
        tmp_path, text, f"<!-- English: {mark_of(text)} -->\n# Tastspitze\n## So geht es\nGröße\n"
    )
    section = manual.section(Place.from_reference("tip.md#how-it-is-done"))
    assert section is not None
    assert section.title == "So geht es"
    chapter = manual.chapter("tip.md")
    assert chapter is not None
    assert not chapter.is_behind
    assert chapter.anchors_by_heading()["so-geht-es"] == "how-it-is-done"
    assert manual.resolve("tip.md", "#how-it-is-done") == Place("tip.md", "how-it-is-done")
    for link in ("../plans.md#one", "plans.md#one"):
        assert manual.resolve("tip.md", link) == Place("plans.md", "one")
    assert manual.picture("tip.md", "../picture.png") == tmp_path / "picture.png"
    assert manual.picture("tip.md", "../../picture.png") is None
    plans = manual.chapter("plans.md")
    assert plans is not None
    assert plans.language == "en"


def test_a_page_that_is_behind_says_so_and_one_with_other_sections_is_not_shown(
    tmp_path: Path,
) -> None:
    old = f"<!-- English: {mark_of('# Tip')} -->\n# Spitze\n"
    behind = _both(tmp_path, "# Tip\nnew\n", old).chapter("tip.md")
    assert behind is not None
    assert behind.is_behind
    (tmp_path / "de" / "tip.md").write_text("# Spitze\n")
    unmarked = load_manual(tmp_path, "de").chapter("tip.md")
    assert unmarked is not None
    assert unmarked.is_behind
    (tmp_path / "de" / "tip.md").write_text("# Spitze\n## Noch eine\n")
    other = load_manual(tmp_path, "de").chapter("tip.md")
    assert other is not None
    assert other.language == "en"


@pytest.mark.parametrize(
    ("question", "document", "anchor"),
    [
        ("ausrichtung", "inspector/inspecting.md", "alignment-f5"),
        ("nicht nachgewiesen", "inspector/colours.md", "features-and-characteristics"),
        ("unsicherheit", "", ""),
        ("strg+b support", "inspector/help.md", "support-bundle-ctrlb"),
        ("handschuhe", "inspector/settings.md", ""),
        ("gelbe streifen", "inspector/colours.md", "yellow-bands"),
        ("kegelsitz schwenk", "technician/wizards.md", "both-hands-on-the-probe"),
        ("größer", "", ""),
    ],
)
def test_a_search_in_german_finds_the_german_section(
    german: Manual, question: str, document: str, anchor: str
) -> None:
    hits = german.search(question)[:4]
    assert hits
    fits = [
        one
        for one in hits
        if document in (one.document, "") and anchor in (one.anchor, "")
    ]  # fmt: skip
    assert fits, hits
    assert any(
        chapter is not None and chapter.language == "de"
        for chapter in (german.chapter(one.document) for one in fits)
    )


def test_a_part_of_a_german_word_is_found_but_not_of_an_english_one(tmp_path: Path) -> None:
    manual = _both(tmp_path, "# Tip\n", "# Spitze\nDie Messunsicherheit\n")
    (hit,) = manual.search("unsicherheit")
    assert "Messunsicherheit" in hit.excerpt
    (tmp_path / "de" / "tip.md").unlink()
    (tmp_path / "tip.md").write_text("# Tip\nretouch\n")
    assert load_manual(tmp_path, "de").search("touch") == ()
