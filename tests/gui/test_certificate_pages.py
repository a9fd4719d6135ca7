"""The pages of certificates about the machine, by the command and as drawn."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.calibration.records import CalibrationStore
from ocmm_core.export.certificate import Certificate, certificate_facts, certificate_of_folder
from ocmm_core.export.template import plain_paper
from ocmm_gui.reports import _certificate as pages
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.export.unsigned_dcc import dcc_bytes
from tests.gui.pdf_texts import texts

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)


@pytest.fixture(name="folder")
def _folder(tmp_path: Path) -> Path:
    store = CalibrationStore(tmp_path / "cameras")
    record = make_record()
    store.accept(record, "Ada", "first", NOW)
    plain = make_verification(record)
    many = tuple(
        msgspec.structs.replace(
            plain.checks[0], name=f"line {number}", certified_mm=100.0 * number,
            measured_mm=100.0 * number + 0.001 * number,
        )
        for number in range(1, 36)
    )  # fmt: skip
    store.verify(msgspec.structs.replace(plain, checks=many), NOW)
    return tmp_path / "cameras"


@pytest.fixture(name="paper")
def _paper(folder: Path) -> Certificate:
    return certificate_of_folder(folder, plain_paper())


@pytest.mark.usefixtures("qapp")
def test_every_fact_and_every_error_is_on_the_pages(paper: Certificate) -> None:
    said = " ".join(texts(pages.lay_out(paper)).split())
    for fact in certificate_facts(paper):
        assert fact.value in said, fact
    for line in paper.runs[-1].lines:
        for number in (f"{line.error:+.4f}", f"{line.limit:.4f}", f"{line.expanded:.4f}"):
            assert number in said
    assert "Calibration certificate" not in said
    assert said.endswith(f"End of {paper.number}")


@pytest.mark.usefixtures("qapp")
def test_what_did_not_pass_says_so_first(paper: Certificate) -> None:
    failed = replace(paper, runs=(replace(paper.runs[0], passed=False),))
    said = texts(pages.lay_out(failed))
    assert "NOT PASSED" in said
    assert said.index("NOT PASSED") < said.index("Laboratory")


@pytest.mark.usefixtures("qapp")
def test_the_pages_are_a_whole_pdf(paper: Certificate) -> None:
    assert pages.certificate_pdf(paper, {}).startswith(b"%PDF")
    assert pages.certificate_pdf(replace(paper, runs=()), {}).startswith(b"%PDF")


@pytest.mark.usefixtures("qapp")
def test_a_state_that_was_not_determined_stands_on_the_pages(folder: Path) -> None:
    paper = certificate_of_folder(folder, plain_paper(), calibration=True)
    said = " ".join(texts(pages.lay_out(paper)).split())
    assert "As found: not determined" in said
    assert "This is the first calibration of these cameras." in said
    for one in paper.values:
        assert one.name in said
    bare = replace(paper, runs=(), not_after="the calibration was not verified")
    said = " ".join(texts(pages.lay_out(bare)).split())
    assert "NO STATEMENT OF CONFORMITY" in said
    assert "PASSED" not in said


@pytest.mark.slow
def test_the_command_writes_certificate_signature_and_pages_and_checks_them(
    folder: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    runner = CliRunner()
    done = runner.invoke(app, ["certificate", "make", str(folder), "--out", str(out)])
    assert done.exit_code == 0, done.output
    names = sorted(path.name for path in out.iterdir())
    assert [name.partition(".")[2] for name in names] == ["dcc.xml", "pdf"]
    again = ["certificate", "make", str(folder), "--calibration", "--out", str(tmp_path / "cal")]
    assert runner.invoke(app, again).exit_code == 0
    assert {path.name[:2] for path in (tmp_path / "cal").iterdir()} == {"C-"}
    told = runner.invoke(app, ["certificate", "check", str(out / names[0])])
    assert told.exit_code == 0, told.output
    assert "XML signature VALID (this station" in told.output
    content = (out / names[0]).read_text("utf-8")
    (out / names[0]).write_text(content.replace("0.001", "0.002", 1), "utf-8")
    told = runner.invoke(app, ["certificate", "check", str(out / names[0])])
    assert told.exit_code == 1, told.output
    assert "XML signature INVALID" in told.output


def _in(paper: Certificate, **changes: str) -> Certificate:
    template = msgspec.structs.replace(paper.paper.template, **changes)
    return replace(paper, paper=replace(paper.paper, template=template))


@pytest.mark.usefixtures("qapp")
def test_a_paper_in_inch_says_so_in_every_head_and_keeps_its_dcc(paper: Certificate) -> None:
    inch = _in(paper, lengths="inch")
    said = " ".join(texts(pages.lay_out(inch)).split())
    for head in ("Measured, in", "Certified, in", "Error, in", "U (k = 2), in", "MPE, in"):
        assert head in said
    assert "Measured, mm" not in said
    assert " µm" not in said
    assert "in inch (1 in = 25.4 mm)" in said
    for line in inch.runs[-1].lines:
        for number in (f"{line.error / 25.4:+.5f}", f"{line.limit / 25.4:.5f}"):
            assert number in said
    assert dcc_bytes(inch) == dcc_bytes(paper)


@pytest.mark.usefixtures("qapp")
def test_a_german_paper_is_german_in_its_head_and_verdict(folder: Path, paper: Certificate) -> None:
    german = _in(paper, language="de")
    said = " ".join(texts(pages.lay_out(german)).split())
    for words in ("Verifikationsprotokoll", "BESTANDEN", "Bestanden, nach der Regel"):
        assert words in said
    for english in ("PASSED", "passed", "as found", "after adjustment", "Lengths in", "humidity"):
        assert english not in said
    # Names, numbers and hashes stay unchanged.
    assert german.number in said
    calibrated = _in(certificate_of_folder(folder, plain_paper(), calibration=True), language="de")
    assert "Verzeichnung k1" in " ".join(texts(pages.lay_out(calibrated)).split())


@pytest.mark.usefixtures("qapp")
def test_a_graph_over_one_length_alone_is_left_out(paper: Certificate) -> None:
    graph = "Errors between the permissible errors"
    assert graph in " ".join(texts(pages.lay_out(paper)).split())
    alone = tuple(replace(run, lines=run.lines[:1]) for run in paper.runs[-1:])
    assert graph not in " ".join(texts(pages.lay_out(replace(paper, runs=alone))).split())
