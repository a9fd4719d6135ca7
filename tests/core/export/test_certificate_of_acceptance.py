"""The paper of an acceptance test: its verdicts are those of its procedure, word for word."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from lxml import etree

from ocmm_core.acceptance import AcceptanceRecord, AcceptanceVerdict, RoomAir, save_record
from ocmm_core.errors import InputError
from ocmm_core.export.certificate import certificate_facts, certificate_of_folder
from ocmm_core.export.template import plain_paper
from tests.core.acceptance.acceptance_site import ROOM, Machine, begin
from tests.core.export.dcc_schema import dcc_schema
from tests.core.export.unsigned_dcc import dcc_bytes

Q = "{https://ptb.de/dcc}"


@pytest.fixture(name="record", scope="module")
def _record(tmp_path_factory: pytest.TempPathFactory) -> AcceptanceRecord:
    session = begin(tmp_path_factory.mktemp("acceptance") / "test.jsonl", "SPHERE-25")
    machine = Machine(sigma=0.002)
    machine.run(session)
    return session.finish(machine.now, ROOM)


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
    dcc_schema(reference).assertValid(root)
    (run,) = paper.runs
    assert len(run.lines) == len(record.values) > 0
    for line, value in zip(run.lines, record.values, strict=True):
        assert line.error == pytest.approx(value.error_mm, abs=1e-9)
        assert (line.expanded, line.limit) == (value.expanded_mm, value.limit_mm)
    words = {
        AcceptanceVerdict.PASS: "pass",
        AcceptanceVerdict.FAIL: "fail",
        AcceptanceVerdict.LEANING_IN: "conditionalPass",
        AcceptanceVerdict.LEANING_OUT: "conditionalFail",
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
    void = kept(tmp_path / "void", record, **real(record), verdict=AcceptanceVerdict.VOID,
                void_reasons=("The temperature ran away.",))  # fmt: skip
    paper = certificate_of_folder(void, plain_paper())
    assert paper.title.startswith("Test report (in-house)")
    assert paper.runs[0].word == "noPass"
    assert not paper.passed
    facts = {fact.name: fact.value for fact in certificate_facts(paper)}
    assert "VOID: it shows nothing" in facts["Conformity"]
    assert "The temperature ran away." in facts["Deviations"]


def adjusted(record: AcceptanceRecord, **changes: object) -> AcceptanceRecord:
    """Return the same test a week later, after a new calibration of the cameras."""
    given: dict[str, object] = {
        "number": "a" * 12,
        "condition": "after adjustment",
        "begun_utc": "2026-12-02T08:00:00+00:00",
        "ended_utc": "2026-12-02T09:00:00+00:00",
        "instrument": msgspec.structs.replace(record.instrument, calibration="d" * 64),
    }
    return msgspec.structs.replace(record, **{**given, **changes})


def condition_of(path: Path, as_found: Path | None = None) -> str:
    paper = certificate_of_folder(path, plain_paper(), as_found=as_found)
    return {fact.name: fact.value for fact in certificate_facts(paper)}["Condition"]


def test_a_test_after_an_adjustment_is_paired_with_the_one_as_found(
    record: AcceptanceRecord, tmp_path: Path, reference: Path
) -> None:
    found = save_record(tmp_path, record)
    after = save_record(tmp_path, adjusted(record))
    paper = certificate_of_folder(after, plain_paper())
    assert [run.status for run in paper.runs] == ["beforeAdjustment", "afterAdjustment"]
    assert paper.begin_utc == record.begun_utc
    assert paper.previous == found.stem
    root = etree.fromstring(dcc_bytes(paper))
    dcc_schema(reference).assertValid(root)
    assert condition_of(after) == "As found and after adjustment, both below."
    # The test as found is complete: later events are not part of it.
    assert condition_of(found) == "As found; nothing was adjusted."
    elsewhere = save_record(tmp_path / "b", adjusted(record))
    assert condition_of(elsewhere, found) == condition_of(after)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"condition": "after adjustment"}, "it must be as found"),
        ({"ended_utc": "2026-12-03T09:00:00+00:00"}, "no earlier test"),
        ({"procedure_sha256": "0" * 64}, "no earlier test"),
    ],
)
def test_another_test_is_not_the_state_before(
    record: AcceptanceRecord, tmp_path: Path, changes: dict[str, object], why: str
) -> None:
    found = save_record(tmp_path, msgspec.structs.replace(record, **changes))
    after = save_record(tmp_path, adjusted(record))
    assert condition_of(after).startswith("As found: not determined (")
    assert why in condition_of(after)
    with pytest.raises(InputError, match="is not the state before"):
        condition_of(after, found)


def test_without_an_adjustment_there_is_no_state_before(
    record: AcceptanceRecord, tmp_path: Path
) -> None:
    found = save_record(tmp_path, record)
    same = save_record(tmp_path, adjusted(record, instrument=record.instrument))
    assert "nothing was adjusted" in condition_of(same)
    with pytest.raises(InputError, match="nothing was adjusted"):
        condition_of(same, found)
    (tmp_path / "broken.json").write_text("{}")
    alone = save_record(tmp_path / "alone", adjusted(record))
    (tmp_path / "alone" / "broken.json").write_text("{}")
    assert "1 file beside it is no sound record" in condition_of(alone)


def test_unproven_cameras_stand_in_title_facts_and_dcc(
    record: AcceptanceRecord, tmp_path: Path
) -> None:
    doubt = "Cameras 'Plain spots': no common clock."
    known = msgspec.structs.replace(
        record.instrument, simulated=False, camera_doubts=(doubt,), age_doubts=("no common clock",)
    )
    paper = certificate_of_folder(kept(tmp_path, record, instrument=known), plain_paper())
    assert paper.title.startswith("CAMERAS UNPROVEN: Test report")
    facts = {fact.name: fact.value for fact in certificate_facts(paper)}
    assert facts["Deviations"].startswith(f"CAMERAS UNPROVEN: {doubt}")
    assert b"CAMERAS UNPROVEN" in dcc_bytes(paper)
    assert paper.states == (f"CAMERAS UNPROVEN: {doubt}",)


def test_humidity_and_pressure_of_the_record_are_on_paper_and_in_the_dcc(
    record: AcceptanceRecord, tmp_path: Path, reference: Path
) -> None:
    # An older record lacks this field, and keeps its hash.
    assert b'"air"' not in msgspec.json.encode(record)
    air = RoomAir.read("45,5 %", "1013")
    paper = certificate_of_folder(kept(tmp_path, record, air=air), plain_paper())
    facts = {fact.name: fact.value for fact in certificate_facts(paper)}
    assert facts["Environment"] == "as found: 20.0 °C, Humidity 45.5 %, Air pressure 1013 hPa"
    root = etree.fromstring(dcc_bytes(paper))
    dcc_schema(reference).assertValid(root)
    conditions = root.findall(f".//{Q}influenceCondition")
    assert len(conditions) == 3
    told = ["".join(map(str, one.itertext())).split() for one in conditions]
    assert "45.5" in told[1]
    assert "1013.0" in told[2]
    for humidity, pressure in (("damp", ""), ("101", ""), ("", "1.013"), ("nan", ""), ("", "inf")):
        with pytest.raises(InputError, match="is"):
            RoomAir.read(humidity, pressure)
