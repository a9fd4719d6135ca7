"""The head of a report by the list of ISO/IEC 17025:2017, 7.8.2 and 7.8.3, and its templates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ocmm_core.calibration.probe_design import Temperature, TemperatureState
from ocmm_core.errors import InputError
from ocmm_core.export.report import (
    NOT_STATED,
    ReportData,
    paper_facts,
    plan_deviations,
    report_number,
)
from ocmm_core.export.template import Particulars, load_paper, standard_template
from ocmm_core.measuring import Climate
from tests.core.export.sample_report import HEAD, sample_report, sample_view

# By the standard, clause by clause: contents of a test report.
STANDARD = {
    "7.8.2.1 a": "a title",
    "7.8.2.1 b": "name and address of the laboratory",
    "7.8.2.1 c": "where it was done",
    "7.8.2.1 d": "a number of its own on every page, and a clear end",
    "7.8.2.1 e": "name and contact of the customer",
    "7.8.2.1 f": "the method",
    "7.8.2.1 g": "the item, identified, and its condition",
    "7.8.2.1 h": "when it was received",
    "7.8.2.1 i": "when it was done",
    "7.8.2.1 j": "when the report was issued",
    "7.8.2.1 l": "that it relates only to the items",
    "7.8.2.1 m": "results with their units",
    "7.8.2.1 n": "additions to, deviations or exclusions from the method",
    "7.8.2.1 o": "who authorises it",
    "7.8.2.2": "what the customer told is marked",
    "7.8.3.1 a": "environmental conditions",
    "7.8.3.1 b": "statement of conformity, with its rule",
    "7.8.3.1 c": "measurement uncertainty",
}

TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
place = "Room 2"
[laboratory]
name = "Laboratory"
address = ["1 Street", "Town"]
[machine]
name = "Optical CMM"
serial = "0001"
"""
GIVEN = Particulars(
    customer="Customer AG", customer_address="2 Road, Town", received="2026-03-01, undamaged",
    drawing="D-1", revision="B",
)  # fmt: skip
WARM = TemperatureState(now=Temperature(20.4, 0.1, "thermometer"))


def written(folder: Path, text: str) -> Path:
    path = folder / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return path


def stated(folder: Path) -> ReportData:
    data = replace(sample_report(), climate=Climate(probe=WARM))
    return replace(data, paper=load_paper(written(folder, TEMPLATE), GIVEN))


def open_clauses(data: ReportData) -> tuple[str, ...]:
    said = {fact.clause for fact in paper_facts(data) if fact.stated}
    return tuple(clause for clause in STANDARD if clause not in said)


def test_the_list_is_that_of_the_standard() -> None:
    assert {fact.clause for fact in paper_facts(sample_report())} - {""} == set(STANDARD)


def test_nothing_is_open_where_everything_is_known(tmp_path: Path) -> None:
    assert open_clauses(stated(tmp_path)) == ()


def test_what_nobody_knows_is_not_stated_and_never_guessed() -> None:
    data = sample_report()
    assert open_clauses(data) == (
        "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 e", "7.8.2.1 h", "7.8.3.1 a",
    )  # fmt: skip
    facts = {fact.name: fact.value for fact in paper_facts(data)}
    for name in ("Laboratory", "Customer", "Drawing", "Place", "Environment", "Certificates"):
        assert facts[name] == NOT_STATED
    assert facts["Begin (UTC)"] == "2026-03-02 07:08:09"
    assert facts["End (UTC)"] == "2026-03-02 07:10:07"


def test_temperatures_stand_with_their_uncertainty(tmp_path: Path) -> None:
    facts = {fact.name: fact.value for fact in paper_facts(stated(tmp_path))}
    assert facts["Environment"].startswith("Probe 20.40 °C, u = 0.10 K (thermometer).")
    assert facts["Machine"] == "Optical CMM, no. 0001"
    assert (facts["Part"], facts["Serial number"]) == ("Block", "=4711")


def test_serial_numbers_and_certificates_come_from_the_documents_of_the_job() -> None:
    rig = '{"cameras": [{"name": "left", "serial": 77}], "valid_until_utc": "2027-01-01T0", ' \
          '"artefacts": [{"name": "bar", "serial": "B1", "certificate": "C-1", ' \
          '"due_utc": "2026-12-01T00"}]}'  # fmt: skip
    facts = {fact.name: fact.value for fact in paper_facts(sample_report(head=replace(
        HEAD, rig_text=rig)))}  # fmt: skip
    assert facts["Cameras"] == "left 77"
    assert facts["Certificates"] == (
        "bar no. B1: C-1, due 2026-12-01 (cameras). Calibration of the cameras valid until "
        "2027-01-01."
    )
    for text in ("{", "[" * 100_000, "", "cameras = 3", '{"cameras": [1]}'):
        broken = sample_report(head=replace(HEAD, rig_text=text))
        assert {fact.name: fact.value for fact in paper_facts(broken)}["Cameras"] == NOT_STATED


def test_deviations_are_those_of_the_job_and_those_that_were_told(tmp_path: Path) -> None:
    data = replace(stated(tmp_path), view=replace(sample_view(), simulated=True, held=(3,)))
    data = replace(data, annulled=(9,))
    given = replace(GIVEN, deviations=("The part was clamped otherwise.",))
    data = replace(data, paper=replace(data.paper, given=given))
    told = plan_deviations(data)
    assert told[0] == "The part was clamped otherwise."
    assert "Points taken back: 9." in told
    assert "Points held back: 3." in told
    assert any(line.startswith("Not measured: BALL") for line in told)
    assert any(line.startswith("SIMULATED") for line in told)


def test_two_states_of_a_job_have_two_numbers() -> None:
    data = sample_report()
    assert report_number(data) == "Block_07-0d2b2d3c"
    given = Particulars(number="  M-1\n2 ")
    assert report_number(replace(data, paper=replace(data.paper, given=given))) == "M-1 2"


def test_the_shipped_template_is_a_plain_one() -> None:
    paper = load_paper(standard_template())
    assert paper.template.title == "Measurement report"
    assert paper.logo == b""


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('sections = ["results"]', "leaves out basis"),
        ('sections = ["results", "basis", "results"]', "names a section twice"),
        ('sections = ["results", "basis", "adverts"]', "sections"),
        ("signatures = []", "has 0 lines"),
        (f'statements = ["{"x" * 401}"]', "is too long"),
        ("unknown = 3", "unknown"),
    ],
)
def test_a_template_that_is_wrong_is_refused_with_its_field(
    tmp_path: Path, line: str, message: str
) -> None:
    head, rest = TEMPLATE.split("[laboratory]")
    path = written(tmp_path, f"{head}{line}\n[laboratory]{rest}")
    with pytest.raises(InputError, match=message):
        load_paper(path)


@pytest.mark.parametrize("logo", ["../secret.png", "/etc/passwd", "text.png", "missing.png"])
def test_a_logo_is_a_picture_beside_the_template_and_nothing_else(
    tmp_path: Path, logo: str
) -> None:
    (tmp_path / "text.png").write_text("no picture")
    path = written(tmp_path, TEMPLATE.replace("[machine]", f'logo = "{logo}"\n[machine]'))
    with pytest.raises(InputError):
        load_paper(path)
