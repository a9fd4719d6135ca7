"""The same report layout for every route: the station's template, and the data given with a job."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export.template import (
    Particulars,
    given_with,
    keep_given,
    keep_template,
    load_paper,
    paper_of,
    standard_template,
    station_template,
    template_in_use,
)

PNG = b"\x89PNG\r\n\x1a\n" + bytes(40)
TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
[laboratory]
name = "Laboratory"
address = ["1 Street", "Town"]
logo = "logo.png"
"""
GIVEN = Particulars(
    customer="Müller & Söhne", order="4711", drawing="D-1", revision="C", deviations=("late",)
)


@pytest.fixture(autouse=True)
def _own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def template_in(folder: Path, text: str = TEMPLATE, logo: str = "logo.png") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / logo).write_bytes(PNG)
    path = folder / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_kept_template_is_that_of_every_report_with_its_logo(tmp_path: Path) -> None:
    job = tmp_path / "PART-001.ocmm"
    assert template_in_use() == standard_template()
    assert paper_of(job).template.laboratory.name == ""
    path = template_in(tmp_path / "lab")
    kept = keep_template(path)
    assert kept == station_template() == template_in_use()
    # It is kept, not pointed at: the folder it came from may go.
    path.unlink()
    (tmp_path / "lab" / "logo.png").unlink()
    paper = paper_of(job)
    assert paper.template.laboratory.name == "Laboratory"
    assert paper.logo == PNG
    assert keep_template(kept) == kept
    assert paper_of(job, template=standard_template()).template.laboratory.name == ""


def test_what_was_given_stays_with_the_job(tmp_path: Path) -> None:
    job = tmp_path / "PART-001.ocmm"
    job.write_bytes(b"sealed")
    assert given_with(job) == Particulars()
    keep_given(job, replace(GIVEN, number="R-7"))
    assert job.read_bytes() == b"sealed"
    # The number is that of one report.
    assert given_with(job) == GIVEN
    assert paper_of(job).given == GIVEN
    other = paper_of(job, Particulars(customer="Other", number="R-8")).given
    assert other == replace(GIVEN, customer="Other", number="R-8")
    assert paper_of(tmp_path / "PART-002.ocmm").given == Particulars()


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{}", b"[]", b"\xff\xfe", b'{"schema": "other/1", "given": {}}',
        b'{"schema": "ocmm.report-particulars/1", "given": {"customer": 1}}',
        b'{"schema": "ocmm.report-particulars/1", "given": {}, "more": 1}',
        b"[" * 50_000, b" " * 70_000,
    ],
    ids=["empty", "bare", "list", "binary", "schema", "type", "more", "deep", "large"],
)  # fmt: skip
def test_a_file_beside_the_job_that_is_none_is_named(tmp_path: Path, content: bytes) -> None:
    job = tmp_path / "PART-001.ocmm"
    path = keep_given(job, GIVEN)
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        paper_of(job)
    assert path.name in caught.value.what


@pytest.mark.parametrize(
    "given",
    [
        Particulars(customer="x" * 1001),
        Particulars(deviations=("x",) * 21),
        Particulars(remarks=("y" * 1001,)),
    ],
)
def test_what_no_paper_can_hold_is_not_kept(tmp_path: Path, given: Particulars) -> None:
    with pytest.raises(InputError, match="too long"):
        keep_given(tmp_path / "a.ocmm", given)
    assert list(tmp_path.glob("*.json")) == []


def test_a_template_that_cannot_be_used_is_not_kept(tmp_path: Path) -> None:
    bad = template_in(tmp_path / "a", TEMPLATE.replace('name = "lab"', "title = 1"))
    with pytest.raises(OcmmError):
        keep_template(bad)
    twice = template_in(
        tmp_path / "b", TEMPLATE.replace("logo.png", "Template.toml"), "Template.toml"
    )
    with pytest.raises(InputError, match="the template itself"):
        keep_template(twice)
    assert not station_template().exists()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("a file")
    with pytest.raises(StorageError, match="cannot be written"):
        keep_template(template_in(tmp_path / "lab"))
    with pytest.raises(StorageError, match="cannot be written"):
        keep_given(tmp_path / "nowhere" / "a.ocmm", GIVEN)


def test_the_kept_file_is_json_that_a_person_can_read(tmp_path: Path) -> None:
    path = keep_given(tmp_path / "PART-001.ocmm", GIVEN)
    assert path.name == "PART-001.ocmm.paper.json"
    read = json.loads(path.read_text("utf-8"))
    assert read["given"]["customer"] == "Müller & Söhne"
    assert load_paper(standard_template(), given_with(tmp_path / "PART-001.ocmm")).given == GIVEN
