"""The manual: sections by their anchors, links that lead somewhere, and a search that finds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ocmm_core.errors import InputError
from ocmm_core.manual import Manual, ManualPart, Place, anchors_of, load_manual

_ROOT = Path(__file__).resolve().parents[3]
_LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s]*)\)")
_OUT = {
    ("inspector/second_screen.md", "../second_screen.schema.json"),
    ("quality/exports.md", "../report.schema.json"),
    ("technician/doctor.md", "../doctor.schema.json"),
    ("technician/doctor.md", "../../installer/station/README.md"),
    ("technician/wire.md", "../../benchmarks/README.md"),
}  # fmt: skip
"""Links to files for developers, which the manual does not hold."""


@pytest.fixture(scope="module")
def manual() -> Manual:
    """Return the manual of this checkout."""
    return load_manual()


def _folder(tmp_path: Path, **documents: str) -> Manual:
    for name, text in documents.items():
        (tmp_path / f"{name}.md").write_text(text)
    return load_manual(tmp_path)


def test_every_document_of_the_folder_is_a_chapter_and_those_of_the_inspector_come_first(
    manual: Manual,
) -> None:
    names = {chapter.name for chapter in manual.chapters}
    docs = _ROOT / "docs"
    held = {path.relative_to(docs).as_posix() for path in docs.rglob("*.md")}
    assert names == {name for name in held if not name.startswith("de/")}
    parts = [chapter.part for chapter in manual.chapters]
    assert parts == sorted(parts, key=list(ManualPart).index)
    assert [one.name for one in manual.chapters[:4]] == [
        "README.md", "inspector/README.md", "inspector/start.md", "inspector/inspecting.md",
    ]  # fmt: skip


def test_every_link_and_picture_of_the_manual_leads_somewhere(manual: Manual) -> None:
    lost = []
    for chapter in manual.chapters:
        for picture, link in _LINK.findall(chapter.markdown):
            if ":" in link.partition("#")[0] or (chapter.name, link) in _OUT:
                continue
            if picture:
                found: object = manual.picture(chapter.name, link)
            else:
                found = manual.resolve(chapter.name, link)
                wanted = link.partition("#")[2]
                # A section that is not there falls back to its document: here that is a fault.
                if wanted and isinstance(found, Place) and found.anchor != wanted:
                    found = None
            if found is None:
                lost.append((chapter.name, link))
    assert not [one for one in lost if not one[0].startswith("decisions/")]
    # Decisions name sources as well.
    assert not [one for one in lost if one[1].endswith(".md")]


def test_anchors_are_those_of_github() -> None:
    titles = ("Alignment: F5", "What is refused, and why", "U (k = 2)", "Rights", "Rights", "A_b c")
    assert anchors_of(titles) == (
        "alignment-f5", "what-is-refused-and-why", "u-k--2", "rights", "rights-1", "a_b-c",
    )  # fmt: skip


def test_what_a_fence_encloses_is_no_heading_and_comments_are_not_shown(tmp_path: Path) -> None:
    text = (
        "# T\n<!-- table x -->\n```sh\n# no heading\n```\n"
        "~~~\n## nor this\n```\n~~~\n## Two `b`\nend\n"
    )
    manual = _folder(tmp_path, inspecting=text)
    (chapter,) = manual.chapters
    assert [(one.level, one.title, one.anchor) for one in chapter.sections] == [
        (1, "T", "t"), (2, "Two b", "two-b"),
    ]  # fmt: skip
    assert "table x" not in chapter.markdown
    assert "# no heading" in chapter.markdown


def test_a_document_without_a_heading_and_an_empty_one_are_chapters(tmp_path: Path) -> None:
    manual = _folder(tmp_path, notes="only words", empty="")
    assert [chapter.title for chapter in manual.chapters] == ["empty.md", "notes.md"]


def test_links_lead_to_sections_of_other_documents_and_never_out_of_the_folder(
    tmp_path: Path,
) -> None:
    (tmp_path.parent / "secret.png").write_bytes(b"x")
    (tmp_path / "decisions").mkdir()
    (tmp_path / "decisions" / "0001-a.md").write_text("# 1. A\n")
    manual = _folder(tmp_path, plans="# Plans\n## One\n", tip="# Tip\n")
    assert manual.resolve("tip.md", "plans.md#one") == Place("plans.md", "one")
    assert manual.resolve("plans.md", "#one") == Place("plans.md", "one")
    assert manual.resolve("decisions/0001-a.md", "../plans.md") == Place("plans.md")
    assert manual.resolve("tip.md", "plans.md#renamed") == Place("plans.md")
    for out in ("https://example.org/plans.md", "file:///etc/passwd", "../plans.md", "nothing.md"):
        assert manual.resolve("tip.md", out) is None
    for out in ("../secret.png", "/etc/hostname", "file:///etc/hostname"):
        assert manual.picture("tip.md", out) is None


@pytest.mark.parametrize(
    ("question", "document", "anchor"),
    [
        ("alignment", "inspector/inspecting.md", "alignment-f5"),
        ("Not proven", "inspector/colours.md", "features-and-characteristics"),
        ("relocation", "technician/calibration.md", "relocation"),
        ("take over mouse", "inspector/inspecting.md", "try-it-without-a-machine"),
        ("outlier delete", "inspector/inspecting.md", ""),
        ("interim check", "quality/acceptance.md", "the-interim-check"),
        ("simulated band", "inspector/colours.md", "yellow-bands"),
    ],
)
def test_the_first_three_hits_have_the_section_that_answers(
    manual: Manual, question: str, document: str, anchor: str
) -> None:
    hits = manual.search(question)[:3]
    assert any(hit.document == document and anchor in (hit.anchor, "") for hit in hits), hits


def test_a_hit_shows_the_words_where_they_stand(tmp_path: Path) -> None:
    long = "word " * 60 + "the Ball of the probe " + "word " * 60
    manual = _folder(tmp_path, tip=f"# Tip\nnothing here\n\n{long}\n", plans="# Plans\nball\n")
    hits = manual.search("ball probe")
    assert [hit.document for hit in hits] == ["tip.md"]
    (hit,) = hits
    assert len(hit.excerpt) < 160
    assert hit.excerpt.startswith("… ")
    assert hit.excerpt.endswith(" …")


def test_a_search_takes_beginnings_headings_first_and_any_input(tmp_path: Path) -> None:
    manual = _folder(
        tmp_path, tip="# Tip\n## Stylus\nx\n## Other\nstylus stylus\n", plans="# Plans\n"
    )
    assert [hit.anchor for hit in manual.search("styl")] == ["stylus", "other"]
    # If no section contains all words, those with most of them are found.
    assert [hit.anchor for hit in manual.search("stylus nonsenseword")] == ["stylus", "other"]
    for nothing in ("", "   ", "?*([", "nonsenseword", "a" * 100_000):
        assert manual.search(nothing) == ()


def test_a_folder_without_documents_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="The manual is not in"):
        load_manual(tmp_path)
