"""Workbook, transfer file and JSON as a stranger reads them; nothing hides in a name."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from ocmm_core.documents import resource
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export import ENDING, EXPORTERS, preview, preview_text
from ocmm_core.export.aqdef._head import read_transfer
from ocmm_core.export.report import (
    ReportData,
    clean_text,
    load_profile,
    polyworks_profile,
    read_report,
)
from ocmm_core.export.report._names import check_file_stem, spreadsheet_text
from ocmm_core.tolerances.decisions import Verdict
from tests.core.export.sample_report import HEAD, result, sample_report, sample_view, with_name
from tests.core.export.sample_report import write_incomplete as write_report
from tests.core.export.spoiling_disk import spoil_files

EUROPEAN = load_profile(resource("profiles", "european.toml"))


def test_the_workbook_holds_numbers_as_numbers_and_text_as_text(tmp_path: Path) -> None:
    (path,) = write_report(sample_report(), ("xlsx",), tmp_path)
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["Verdict", "Characteristics", "Features", "Points"]
    head = {row[0].value: row[1] for row in book["Verdict"].iter_rows(min_row=2)}
    # A serial number that looks like a formula is text, and stays so when the cell is edited.
    assert (head["Serial number"].value, head["Serial number"].data_type) == ("=4711", "s")
    assert head["Serial number"].quotePrefix
    assert head["Operator"].value == "Zoë Müller"
    sheet = book["Characteristics"]
    # The state of the job is above the table.
    columns = [cell.value for cell in sheet[2]]
    measured = sheet.cell(3, columns.index("Measured") + 1)
    assert (measured.value, measured.data_type) == (20.00246, "n")
    assert measured.number_format == "0.0000"
    assert sheet.cell(7, columns.index("Measured") + 1).value is None
    types = {cell.data_type for one in book for row in one.iter_rows() for cell in row}
    assert types <= {"s", "n"}
    assert len(list(book["Points"].iter_rows())) == 9


def test_the_transfer_file_is_as_agreed_to_the_byte(tmp_path: Path) -> None:
    (path,) = write_report(sample_report(), ("dfq",), tmp_path)
    lines = path.read_bytes().split(b"\r\n")
    assert lines[0] == b"K0100 5"
    assert b"K2002/1 Bore diameter" in lines
    assert b"K2101/1 20.0000" in lines
    assert b"K2110/1 19.9900" in lines
    assert b"K2111/1 20.0200" in lines
    assert b"K0014/0 =4711" in lines
    (values,) = [line for line in lines if b"\x14" in line]
    first, *_, last = values.split(b"\x0f")
    assert first.split(b"\x14")[:3] == [b"20.0025", b"0", b"02.03.2026/07:10:04"]
    # The operator is in the catalogue, the value has the number of the entry.
    assert first.split(b"\x14")[6] == b"1"
    assert "K4092/1 Zoë Müller".encode("cp1252") in lines
    # No number replaces a missing one.
    assert last.split(b"\x14")[:2] == [b"", b"256"]


def test_several_jobs_are_several_values_of_one_file(tmp_path: Path) -> None:
    jobs = []
    for number in range(3):
        view = sample_view()
        items = (
            result("Bore diameter", 20.001 + 0.001 * number, Verdict.CONFORM),
            *view.characteristics[1:],
        )
        view = replace(view, job=f"Block_{number}", characteristics=items)
        jobs.append(sample_report(view, head=replace(HEAD, serial=f"S{number}")))
    (path,) = write_report(jobs, ("dfq",), tmp_path)
    assert path.name == "BLOCK_3_parts_INCOMPLETE.dfq"
    found = read_transfer(path.read_bytes())
    assert [values[0]["K0001"] for values in found.values] == ["20.0010", "20.0020", "20.0030"]
    assert [line.text for line in found.lines if line.key == "K0014"] == ["S0", "S1", "S2"]
    other = replace(jobs[1], view=replace(jobs[1].view, characteristics=()))
    with pytest.raises(StorageError, match="another plan"):
        write_report([jobs[0], other], ("dfq",), tmp_path)


def test_values_that_prove_nothing_do_not_count_in_statistics(tmp_path: Path) -> None:
    view = sample_view()
    held = sample_report(replace(view, held=(2,)))
    unproven = sample_report(replace(view, unproven="Measured as uncalibrated."))
    for data in (held, unproven):
        (path,) = write_report(data, ("dfq",), tmp_path)
        (values,) = read_transfer(path.read_bytes()).values
        assert [fields["K0002"] for fields in values] == ["255"] * 4 + ["256"]


def test_json_holds_every_observation_bit_for_bit(tmp_path: Path) -> None:
    data = sample_report()
    (path,) = write_report(data, ("json",), tmp_path)
    plain = json.loads(path.read_text("utf-8"))
    assert (plain["schema"], plain["unit"]) == ("ocmm.report/1", "mm")
    for told, point in zip(plain["observations"], data.observations, strict=True):
        assert np.array_equal(np.array(told["tip_world"]), point.tip_world)
        spots = np.array(told["spots"], dtype=float)
        assert np.array_equal(spots, point.spots, equal_nan=True)
    assert [item["measured"] for item in plain["results"]] == [
        item.measured for item in data.results
    ]
    assert read_report(path.read_bytes()).job.uuid == HEAD.job_uuid


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"{", b'{"schema": "ocmm.report/1"}', b"[" * 100_000, b"\xff\xfe"]
)
def test_what_is_no_report_is_refused(content: bytes) -> None:
    with pytest.raises(InputError, match="Not a job report"):
        read_report(content)


@pytest.mark.usefixtures("comma_locale")
def test_a_comma_locale_changes_no_format(tmp_path: Path) -> None:
    paths = write_report(sample_report(), tuple(EXPORTERS), tmp_path)
    told = {
        path.suffix: path.read_bytes()
        for path in paths
        if "_fai" not in path.name and not path.name.endswith("_points.json")
    }
    assert b"20.00246" in told[".qif"]
    assert b"20.00246" in told[".json"]
    assert b"\x0f20.0312\x14" in told[".dfq"]
    with zipfile.ZipFile(io.BytesIO(told[".xlsx"])) as archive:
        assert b"<v>20.00246</v>" in archive.read("xl/worksheets/sheet2.xml")


def test_the_same_job_gives_the_same_bytes(tmp_path: Path) -> None:
    first = write_report(sample_report(), tuple(EXPORTERS), tmp_path / "a")
    second = write_report(sample_report(), tuple(EXPORTERS), tmp_path / "b")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


def test_an_outlier_is_flagged_and_only_held_points_are_left_out(tmp_path: Path) -> None:
    view = sample_view()
    flagged = replace(view.features[0], outliers=(3,))
    data = sample_report(replace(view, features=(flagged, *view.features[1:]), held=(3, 4)))
    paths = write_report(data, ("polyworks", "json"), tmp_path, EUROPEAN)
    rows = list(csv.DictReader(io.StringIO(paths[1].read_text("utf-8-sig")), delimiter=";"))
    assert [row["Flag"] for row in rows[:4]] == ["", "", "held back + outlier", "held back"]
    # Nothing in a cloud or a macro could tell that a point is held back.
    (cloud,) = (path for path in paths if path.name.endswith("_cloud.asc"))
    assert len(cloud.read_text("ascii").splitlines()) == len(rows) - 2
    (macro,) = (path for path in paths if path.suffix == ".pwmacro")
    assert macro.read_text("utf-16").count("CREATE") == len(rows) - 2
    plain = json.loads(paths[-1].read_text("utf-8"))
    assert plain["features"][0]["outliers"] == [3]
    assert len(plain["observations"]) == 7


@pytest.mark.parametrize("name", ["dfq", "xlsx", "json", "qif"])
def test_a_preview_shows_values_and_verdicts_or_attributes(name: str) -> None:
    text = preview_text(preview(sample_report(), name))
    assert "Bore in doubt" in text
    assert "20.0195" in text


def _digit(content: bytes, place: int) -> bytes:
    """Return content with one digit of a result changed."""
    found = content.index(b"20.0") + 4 + place
    other = b"%d" % ((content[found] - 48 + 3) % 10)
    return content[:found] + other + content[found + 1 :]


def _sheet(content: bytes, place: int) -> bytes:
    """Return a workbook with one digit of its third sheet changed."""
    changed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(changed, "w") as new:
        for part in old.namelist():
            data = old.read(part)
            new.writestr(part, _digit(data, place) if part.endswith("sheet2.xml") else data)
    return changed.getvalue()


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(
    ("name", "spoil"), [("dfq", _digit), ("xlsx", _sheet), ("json", _digit), ("qif", _digit)]
)
def test_every_format_is_read_back_and_a_difference_leaves_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    spoil: Callable[[bytes, int], bytes],
    place: int,
) -> None:
    def spoiled(path: Path, content: bytes) -> bytes:
        return content if ENDING in path.name else spoil(content, place)

    spoil_files(monkeypatch, spoiled)
    with pytest.raises(StorageError) as caught:
        write_report(sample_report(), (name,), tmp_path)
    assert caught.value.code == "export.differs"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("cut", [0, 1, 40, 200])
@pytest.mark.parametrize("name", list(EXPORTERS))
def test_a_file_that_is_cut_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, cut: int
) -> None:
    spoil_files(monkeypatch, lambda _path, content: content[:cut])
    with pytest.raises(StorageError) as caught:
        write_report(sample_report(), (name,), tmp_path)
    assert caught.value.code == "export.differs"
    assert list(tmp_path.iterdir()) == []


HOSTILE = [
    "=cmd|'/c calc'!A0", "+1", "-1+1", "@SUM(A1)", "\t=1", "\u00a0=1", "$PATH", 'A" , ) SYSTEM',
    "SYSTEM COMMAND EXEC", "../../etc/passwd", "..", "C:\\x", "/abs", "CON", "con.1", "NUL", "LPT1",
    "COM1.txt", "a.", "a ", "<b>&amp;</b>", "]]>", "<!ENTITY x SYSTEM 'file:///'>", "K0001/1 5",
    "\x0f\x14", "a\r\nK0001 1", "\u202egnp", "\ud800", "\x00", "http://evil", "_x0041_", "x" * 500,
    "Größe", "=", "'", '"', "",
]  # fmt: skip


@pytest.mark.parametrize("where", ["job", "feature", "characteristic"])
def test_nothing_hides_in_a_name(tmp_path_factory: pytest.TempPathFactory, where: str) -> None:
    for name in HOSTILE:
        check_harmless(tmp_path_factory.mktemp("fuzz"), with_name(sample_report(), where, name))


@pytest.mark.parametrize("name", HOSTILE)
def test_nothing_hides_in_free_text(tmp_path_factory: pytest.TempPathFactory, name: str) -> None:
    data = with_name(with_name(sample_report(), "operator", name), "serial", name)
    check_harmless(tmp_path_factory.mktemp("fuzz"), data)


@settings(
    max_examples=25, derandomize=True, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(
    name=st.text(max_size=70) | st.from_regex(r"[=+@$\"'<&\-./\\A-Z0-9 \x0f\x14\r\n]{1,12}"),
    where=st.sampled_from(["job", "feature", "characteristic", "operator", "serial"]),
)
def test_no_text_breaks_a_format(
    tmp_path_factory: pytest.TempPathFactory, name: str, where: str
) -> None:
    check_harmless(tmp_path_factory.mktemp("fuzz"), with_name(sample_report(), where, name))


def check_harmless(folder: Path, data: ReportData) -> None:
    """Write all formats and check for anything that another program could execute."""
    inside = folder / "inside"
    for profile, formats in ((polyworks_profile(), tuple(EXPORTERS)), (EUROPEAN, ("polyworks",))):
        refused = None
        try:
            paths = write_report(data, formats, inside, profile)
        except OcmmError as error:
            refused = error
        if refused is not None:
            assert refused.code == "export.name"
            assert not inside.exists()
            return
        assert {path.parent for path in paths} == {inside}
        assert [path.name for path in folder.iterdir()] == ["inside"]
        for path in paths:
            check_content(path, profile.separator)


def check_content(path: Path, separator: str) -> None:
    content = path.read_bytes()
    if path.suffix == ".csv":
        for line in content.decode("utf-8-sig").split("\r\n"):
            for cell in line.split(separator):
                is_number = re.fullmatch(r"-?\d+[.,]\d+", cell)
                assert is_number or cell[:1] not in ("=", "+", "-", "@", "\t"), cell
                assert '"' not in cell
    elif path.suffix == ".pwmacro":
        lines = content.decode("utf-16").split("\r\n")
        assert lines[0] == 'version "5.0"'
        for line in lines[1:-1]:
            assert line.startswith("FEATURE PRIMITIVE POINT CREATE ( ")
            assert line.count('"') == 4
            assert "$" not in line
    elif path.suffix == ".xlsx":
        book = openpyxl.load_workbook(path)
        types = {cell.data_type for one in book for row in one.iter_rows() for cell in row}
        assert types <= {"s", "n"}
    elif path.suffix == ".qif":
        assert etree.fromstring(content).getroottree().docinfo.internalDTD is None
    elif path.suffix == ".dfq":
        assert content.count(b"K0100") == 1
        assert len(read_transfer(content).values) == 1
    elif path.suffix == ".json":
        json.loads(content)


@pytest.mark.parametrize("name", ["CON", "con", "NUL.1", "com7", "Lpt0", "a.", "b..", "PRN.x"])
def test_a_device_or_a_trailing_dot_is_no_name_of_a_file(name: str) -> None:
    with pytest.raises(StorageError, match="every system"):
        check_file_stem(name)


def test_text_loses_controls_and_only_text_is_prefixed() -> None:
    assert clean_text("a\x0fb\u202ec\r\nd\x00") == "a b c d"
    assert spreadsheet_text("=1+1") == "'=1+1"
    assert spreadsheet_text("-4711") == "'-4711"
    assert spreadsheet_text("4711") == "4711"


def test_a_note_that_a_spreadsheet_would_compute_is_prefixed_and_numbers_are_not(
    tmp_path: Path,
) -> None:
    view = sample_view()
    note = replace(view.characteristics[2], note="=HYPERLINK(A1);+1")
    data = sample_report(replace(view, characteristics=(note,)))
    paths = write_report(data, ("polyworks",), tmp_path, EUROPEAN)
    (row,) = csv.DictReader(io.StringIO(paths[3].read_text("utf-8-sig")), delimiter=";")
    assert row["Note"] == "'=HYPERLINK(A1),+1"
    assert row["Deviation"] == "-0,0188"


def test_two_jobs_of_one_name_do_not_overwrite_each_other(tmp_path: Path) -> None:
    view = sample_view()
    jobs = [sample_report(view), sample_report(replace(view, job="BLOCK_07"))]
    with pytest.raises(StorageError, match="Two jobs"):
        write_report(jobs, ("json",), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_format_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'pdf'"):
        write_report(sample_report(), ("pdf",), tmp_path)
    with pytest.raises(InputError, match="Nothing to report"):
        write_report([], ("json",), tmp_path)
