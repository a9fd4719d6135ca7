"""The paper of an acceptance test: its verdicts are those of its procedure, word for word."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from lxml import etree

from ocmm_core.acceptance import AcceptanceRecord, Verdict, save_record
from ocmm_core.export.certificate import certificate_facts, certificate_of_folder, dcc_bytes
from ocmm_core.export.report import plain_paper
from tests.core.acceptance.acceptance_site import Machine, begin

Q = "{https://ptb.de/dcc}"


@pytest.fixture(name="record", scope="module")
def _record(tmp_path_factory: pytest.TempPathFactory) -> AcceptanceRecord:
    session = begin(tmp_path_factory.mktemp("acceptance") / "test.jsonl", "SPHERE-25")
    machine = Machine(sigma=0.002)
    machine.run(session)
    return session.finish(machine.now, 20.0)


def kept(folder: Path, record: AcceptanceRecord, **changes: object) -> Path:
    return save_record(folder, msgspec.structs.replace(record, **changes))


def real(record: AcceptanceRecord) -> dict[str, object]:
    return {
        "instrument": msgspec.structs.replace(record.instrument, simulated=False),
        "procedure": msgspec.structs.replace(record.procedure, accreditation="D-K-00000-00"),
    }


def test_values_limits_and_verdicts_are_those_of_the_record(
    record: AcceptanceRecord, tmp_path: Path, reference: Path
) -> None:
    paper = certificate_of_folder(kept(tmp_path, record), plain_paper())
    root = etree.fromstring(dcc_bytes(paper))
    etree.XMLSchema(etree.parse(reference / "dcc" / "dcc.xsd")).assertValid(root)
    (run,) = paper.runs
    assert len(run.lines) == len(record.values) > 0
    for line, value in zip(run.lines, record.values, strict=True):
        assert line.error == pytest.approx(value.error_mm, abs=1e-9)
        assert (line.expanded, line.limit) == (value.expanded_mm, value.limit_mm)
    words = {
        Verdict.PASS: "pass",
        Verdict.FAIL: "fail",
        Verdict.LEANING_IN: "conditionalPass",
        Verdict.LEANING_OUT: "conditionalFail",
    }
    assert run.word == words[record.verdict]
    stated = [one.text for one in root.iterfind(f".//{Q}result//{Q}conformity")]
    assert stated == [words[value.verdict] for value in record.values]


def test_a_virtual_rig_never_gets_a_certificate(record: AcceptanceRecord, tmp_path: Path) -> None:
    accredited = {"procedure": real(record)["procedure"]}
    paper = certificate_of_folder(kept(tmp_path, record, **accredited), plain_paper())
    assert paper.title.startswith("SIMULATED: Test report (in-house)")
    assert paper.accreditation == ""
    facts = {fact.name: fact.value for fact in certificate_facts(paper)}
    assert facts["Deviations"].startswith("SIMULATED: the virtual rig was tested")


def test_the_words_come_with_the_accreditation_of_the_procedure(
    record: AcceptanceRecord, tmp_path: Path
) -> None:
    paper = certificate_of_folder(kept(tmp_path, record, **real(record)), plain_paper())
    assert paper.title.startswith("Calibration certificate: ")
    assert paper.accreditation == "D-K-00000-00"
    void = kept(tmp_path / "void", record, **real(record), verdict=Verdict.VOID,
                void_reasons=("The temperature ran away.",))  # fmt: skip
    paper = certificate_of_folder(void, plain_paper())
    assert paper.title.startswith("Test report (in-house)")
    assert paper.runs[0].word == "noPass"
    assert not paper.passed
    facts = {fact.name: fact.value for fact in certificate_facts(paper)}
    assert "VOID: it shows nothing" in facts["Conformity"]
    assert "The temperature ran away." in facts["Deviations"]
