"""Pages as PDF/A-3: valid, tagged, the same each time, with words that can be copied."""

from __future__ import annotations

import io
import subprocess
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pypdfium2  # type: ignore[import-untyped]
import pytest
from pypdf import PdfReader, PdfWriter

from ocmm_core.calibration.records import CalibrationStore
from ocmm_core.export.certificate import certificate_of_cameras, read_dcc, write_certificates
from ocmm_core.export.template import Paper, plain_paper
from ocmm_core.wording import Speech
from ocmm_gui.reports import _batch as batch
from ocmm_gui.reports import _certificate as certificate
from ocmm_gui.reports import _pdf as report
from ocmm_gui.reports import _recall as recall
from ocmm_gui.reports._archival import attached
from ocmm_gui.reports._canvas import BOTTOM, HEADING, SMALL, PageCanvas
from ocmm_gui.reports._paper import letterhead, paint_with_foot, write_end, written_pdf
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.export.sample_report import sample_report
from tests.core.export.test_batch_table import COMPARISON
from tests.gui.pdf_texts import texts
from tests.gui.pdf_validity import structure_faults, verapdf
from tests.gui.test_recall_pdf import RECORD
from tests.host import amount, needs_tools

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)
LABORATORY = (
    "Akkreditiertes Kalibrierlaboratorium für dimensionelle Messgrößen und optische "
    "Koordinatenmesstechnik der Nordwest GmbH"
)
GERMAN = "de"
pytestmark = pytest.mark.usefixtures("qapp")
Made = dict[str, bytes]


def headed(language: str, name: str = LABORATORY) -> Paper:
    paper = plain_paper()
    house = msgspec.structs.replace(paper.template.laboratory, name=name, address=("1 Street",))
    template = msgspec.structs.replace(paper.template, language=language, laboratory=house)
    return replace(paper, template=template)


@pytest.fixture(name="made", scope="module")
def _made(tmp_path_factory: pytest.TempPathFactory, qapp: object) -> Made:
    """Return a file of each writer, in both languages if available."""
    _ = qapp
    folder = tmp_path_factory.mktemp("site")
    store, record = CalibrationStore(folder / "cameras"), make_record()
    store.accept(record, "Ada", "first", NOW)
    checks = make_verification(record)
    lines = tuple(
        msgspec.structs.replace(
            checks.checks[0], name=f"line {n}", certified_mm=100.0 * n, measured_mm=100.0 * n
        )
        for n in range(1, 30)
    )
    store.verify(msgspec.structs.replace(checks, checks=lines), NOW)
    found: Made = {"recall": recall.pdf_bytes(RECORD)}
    for language in ("en", GERMAN):
        sheet = headed(language)
        paper = certificate_of_cameras(store, sheet)
        write_certificates(
            [(paper, partial(certificate.certificate_pdf, paper))], folder / language
        )
        found[f"certificate {language}"] = next((folder / language).glob("*.pdf")).read_bytes()
        data = replace(sample_report(), paper=sheet)
        found[f"report {language}"] = report.pdf_file(data)[1]
        found[f"batch {language}"] = batch.batch_pdf(COMPARISON, sheet)
    return found


def test_each_writer_makes_valid_pdf_a3(made: Made, tmp_path: Path) -> None:
    paths = []
    names = list(made) if amount(1, 2) > 1 else ["certificate de", "recall"]
    for name in names:
        paths.append(tmp_path / f"{name}.pdf")
        paths[-1].write_bytes(made[name])
    writer = PdfWriter(clone_from=io.BytesIO(made["recall"]))
    del writer.root_object["/OutputIntents"]
    with (tmp_path / "without.pdf").open("wb") as file:
        writer.write(file)
    told = verapdf([*paths, tmp_path / "without.pdf"])
    assert dict(zip(names, told, strict=False)) == dict.fromkeys(names, "VALID")
    assert told[-1].startswith("INVALID | 6.2.")


def test_structure_is_complete(made: Made) -> None:
    for name, content in made.items():
        language = GERMAN if name.endswith(f" {GERMAN}") else "en"
        assert structure_faults(content, language) == [], name
    files = {name: attached(content)[1] for name, content in made.items()}
    assert [len(one) for one in files.values()] == [1] * len(made)
    (dcc,) = files["certificate en"].values()
    assert read_dcc(dcc).signature.word != "NONE"


def test_tables_and_headings_are_tagged(made: Made) -> None:
    reader: Any = PdfReader(io.BytesIO(made["report de"]))
    tree = reader.trailer["/Root"]["/StructTreeRoot"]["/K"]
    roles = [kid["/S"] for kid in tree["/K"]]
    assert roles.count("/H1") == 1
    assert {"/H2", "/P", "/Table"} <= set(roles)
    table = next(kid for kid in tree["/K"] if kid["/S"] == "/Table")
    rows = [[cell["/S"] for cell in row["/K"]] for row in table["/K"]]
    assert set(rows[0]) == {"/TH"}
    assert all(set(row) == {"/TD"} and len(row) == len(rows[0]) for row in rows[1:])


def by_pdftotext(content: bytes) -> str:
    needs_tools("pdftotext")
    return subprocess.run(
        ["pdftotext", "-enc", "UTF-8", "-", "-"], input=content, check=True, capture_output=True
    ).stdout.decode()


def by_pdfium(content: bytes) -> str:
    return "\n".join(
        page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(content)
    )


def by_pypdf(content: bytes) -> str:
    return "\n".join(page.extract_text() for page in PdfReader(io.BytesIO(content)).pages)


@pytest.mark.parametrize("read", [by_pdftotext, by_pdfium, by_pypdf])
def test_words_are_copied_as_they_are_written(read: Callable[[bytes], str]) -> None:
    canvas = PageCanvas(Speech(GERMAN))
    hashes = [f"{'ff3ffi' * 10}{n:04x}" for n in (0xFF1, 0xF1F)]
    words = [*hashes, "Effizienz", "fluffig", "Aufl", "Größe", "±0,01", "≤", "µm", "⌀", "✓"]
    for size in (SMALL, HEADING):
        for word in words:
            canvas.text(f"{word} {word}", size)
    made = written_pdf(
        canvas, lambda painter, index: paint_with_foot(painter, canvas, index, "Foot"), {},
        title="A page", software="1", utc="2026-11-28T08:00:00+00:00",
    )  # fmt: skip
    said = read(made)
    assert "\t" not in said
    for word in words:
        # Poppler leaves out a space between two narrow signs.
        assert "".join(said.split()).count(word) == 4, word


def test_all_words_of_a_report_can_be_copied(made: Made) -> None:
    data = replace(sample_report(), paper=headed(GERMAN))
    said = "".join(by_pdfium(made["report de"]).split())
    for word in texts(report.lay_out(data)).split():
        assert word.replace("&amp;", "&").replace("&lt;", "<") in said, word


def test_the_same_report_is_the_same_file() -> None:
    data = sample_report()
    assert report.pdf_file(data) == report.pdf_file(data)
    assert recall.pdf_bytes(RECORD) == recall.pdf_bytes(RECORD)


@pytest.mark.parametrize("sentences", [0, 3])
def test_signatures_are_never_alone_on_a_page(sentences: int) -> None:
    split = 0
    for filled in range(1, 75):
        canvas = PageCanvas()
        for _ in range(filled):
            canvas.text("A line of the results")
        write_end(canvas, ["A statement. " * 20] * sentences, ["Measured by"] * 3, "End")
        split += len(canvas.pages) > 1
        assert len(canvas.pages[-1]) >= sentences + 3
        assert canvas.y <= BOTTOM
    assert split > 2


@pytest.mark.parametrize("name", [LABORATORY, "L" * 120, f"{LABORATORY} {LABORATORY}", "Lab"])
def test_names_of_laboratories_are_whole(name: str) -> None:
    canvas = PageCanvas()
    letterhead(canvas, headed("en", name))
    said = texts(canvas)
    assert name.replace(" ", "") in said.replace(" ", "")
    assert "…" not in said
