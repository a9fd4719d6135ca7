"""Every file excludes misuse in words, and undecided values neither pass nor fail in any."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import openpyxl
import pytest
from lxml import etree

from ocmm_core.documents import resource
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import EXPORTERS, preview, preview_text
from ocmm_core.export.aqdef._head import read_transfer
from ocmm_core.export.qif._writer import NAMESPACE
from ocmm_core.export.report import (
    Profile,
    ReportData,
    load_profile,
    polyworks_profile,
    read_report,
)
from ocmm_core.export.report._tables import (
    FEATURE_COLUMNS,
    JOB_STATE,
    POINT_COLUMNS,
    REPORT_COLUMNS,
)
from ocmm_core.inspection.evaluation import FeatureState, JobView
from ocmm_core.tolerances.decisions import PartWord, Verdict
from tests.core.export.sample_report import HEAD, RESULTS, result, sample_report, sample_view
from tests.core.export.sample_report import write_incomplete as write_report
from tests.core.export.spoiling_disk import spoil_files

Q = f"{{{NAMESPACE}}}"
ALL = tuple(EXPORTERS)
PROFILES = sorted(resource("profiles").glob("*.toml"))
DECIDED = re.compile(r"\b(pass(ed)?|fail(ed)?|ok|good|bad|conform|not conform)\b", re.IGNORECASE)


def whole_view(*, simulated: bool = False) -> JobView:
    """Return a job in which everything is measured and conforms."""
    view = sample_view()
    features = tuple(replace(item, state=FeatureState.DONE) for item in view.features)
    return replace(
        view, features=features, active="", complete=True, simulated=simulated,
        characteristics=RESULTS[:1],
    )  # fmt: skip


def with_verdict(verdict: Verdict) -> ReportData:
    """Return a job with one characteristic that has a value and this verdict."""
    doubtful = result("Bore diameter", 20.001, verdict)
    return sample_report(replace(whole_view(), characteristics=(doubtful,)))


def wide(profile: Profile, *, header: bool = True) -> Profile:
    """Return a profile with all columns that there are."""
    return msgspec.structs.replace(
        profile,
        points=msgspec.structs.replace(profile.points, header=header, columns=[*POINT_COLUMNS]),
        features=msgspec.structs.replace(
            profile.features, header=header, columns=[*FEATURE_COLUMNS], when_needed=[]
        ),
        report=msgspec.structs.replace(
            profile.report, header=header, columns=[*REPORT_COLUMNS], when_needed=[]
        ),
    )


def narrow(profile: Profile) -> Profile:
    """Return a profile that shows as little as it can."""
    return msgspec.structs.replace(
        profile,
        points=msgspec.structs.replace(profile.points, header=True, columns=["Name"]),
        features=msgspec.structs.replace(
            profile.features, header=True, columns=["Name"], when_needed=[]
        ),
        report=msgspec.structs.replace(
            profile.report, header=True, columns=["Name", "Test"], when_needed=[]
        ),
    )


def profiles() -> list[Profile]:
    """Return all profiles of ours, and possible variants by users."""
    ours = [load_profile(path) for path in PROFILES]
    assert len(ours) >= 2
    return [
        one
        for profile in ours
        for one in (profile, wide(profile), wide(profile, header=False), narrow(profile))
    ]


def words_of(path: Path) -> list[str]:
    """Return every text of a file, cell by cell if it has cells.

    Without the head, which lists the numbers of all verdicts.
    """
    content = path.read_bytes()
    if path.suffix == ".xlsx":
        book = openpyxl.load_workbook(path)
        if "Verdict" in book.sheetnames:
            front = book["Verdict"]
            first = next(row for row in front.iter_rows() if row[0].value == "Item")[0].row
            for row in front.iter_rows(min_row=first):
                row[0].value = None
        cells = [cell.value for one in book for row in one.iter_rows() for cell in row]
        return [cell for cell in cells if isinstance(cell, str)]
    if path.suffix == ".qif":
        root = etree.fromstring(content)
        words = [one.text or "" for one in root.iter("{*}*")]
        return [*words, *(one.get("value", "") for one in root.iter("{*}AttributeStr"))]
    if path.suffix == ".json":
        return re.findall(r'"((?:[^"\\]|\\.)*)"', content.decode())
    if path.suffix == ".dfq":
        return re.split(r"[\x0f\x14\r\n]+", content.decode("cp1252"))
    if path.suffix == ".pwmacro":
        return [content.decode("utf-16")]
    if path.suffix == ".parquet":
        import pyarrow.parquet

        table = pyarrow.parquet.read_table(path)
        head = [text.decode() for text in table.schema.metadata.values()]
        return [*head, *(cell for column in table.to_pydict().values() for cell in set(column)
                         if isinstance(cell, str))]  # fmt: skip
    if path.suffix == ".ply":
        content = content.partition(b"end_header")[0]
    lines = content.decode("utf-8-sig").splitlines()
    if path.name.endswith("_job.csv"):
        lines = [re.split("[,;]", line, maxsplit=1)[1] for line in lines]
    return [cell for line in lines for cell in re.split("[,;]+", line)]


@pytest.mark.parametrize("verdict", [Verdict.NOT_MEASURED, Verdict.PROVISIONAL, Verdict.NOT_PROVEN])
def test_what_is_not_decided_passes_and_fails_in_no_format_by_no_profile(
    tmp_path: Path, verdict: Verdict
) -> None:
    data = with_verdict(verdict)
    for number, profile in enumerate(profiles()):
        paths = write_report(data, ALL, tmp_path / str(number), profile)
        for path in paths:
            for text in words_of(path):
                assert not DECIDED.search(text), (path.name, text)
        told = {path.suffix: path for path in paths if not path.name.endswith("_points.json")}
        (status,) = {one.text for one in etree.parse(told[".qif"]).iter(f"{Q}InspectionStatusEnum")}
        assert status == "UNKNOWN"
        assert read_report(told[".json"].read_bytes()).results[0].verdict == verdict.value
        transfer = read_transfer(told[".dfq"].read_bytes())
        assert transfer.text("K0009", 1) == verdict.value
        if verdict is not Verdict.NOT_PROVEN:
            fields = transfer.values[0][0]
            assert (fields["K0001"], fields["K0002"]) == ("", "256")
            assert "20.001" not in "".join(words_of(told[".qif"]))


@pytest.mark.parametrize(
    "extra",
    [
        '[tests]\n"NOT MEASURED" = "Pass"\n',
        'pass = ["NOT MEASURED", "NOT PROVEN"]\n',
        '[report.tests]\n"Not proven" = "OK"\n',
    ],
)
def test_a_profile_that_would_give_verdicts_other_words_is_refused(
    tmp_path: Path, extra: str
) -> None:
    text = resource("profiles", "polyworks.toml").read_text("utf-8")
    (tmp_path / "hostile.toml").write_text(
        text + extra if extra.startswith("[") else extra + text, "utf-8"
    )
    with pytest.raises(InputError, match=r"tests|pass"):
        load_profile(tmp_path / "hostile.toml")


@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("complete", [False, True])
def test_every_file_says_simulated_and_incomplete_where_it_is_so_and_only_there(
    tmp_path: Path, *, simulated: bool, complete: bool
) -> None:
    view = whole_view() if complete else sample_view()
    data = sample_report(replace(view, simulated=simulated))
    holds = {"SIMULATED": simulated, "INCOMPLETE": not complete}
    for number, profile in enumerate(profiles()):
        for path in write_report(data, ALL, tmp_path / str(number), profile):
            inside = " ".join(words_of(path))
            for word, is_so in holds.items():
                assert (word in path.name) == is_so
                # A cloud, a macro and a table without a header have no room but their names.
                bare = path.name.endswith(("_cloud.asc", ".pwmacro")) or (
                    path.name.endswith("_points.csv") and not profile.points.header
                )
                if not bare:
                    assert (word in inside) == is_so, (path.name, word)
                elif not is_so:
                    assert word not in inside


def test_every_sheet_says_it_above_its_table_and_the_front_says_the_verdict_large(
    tmp_path: Path,
) -> None:
    (path,) = write_report(
        sample_report(replace(sample_view(), simulated=True)), ("xlsx",), tmp_path
    )
    book = openpyxl.load_workbook(path)
    front = book.worksheets[0]
    assert front.title == "Verdict"
    assert front["A1"].value == "PART DOES NOT CONFORM"
    assert front["A1"].font.sz >= 30
    assert front["A1"].fill.fgColor.rgb == "FFFFC7CE"
    lines = [row[0].value for row in front.iter_rows()]
    assert lines[1:3] == ["SIMULATED", "INCOMPLETE"]
    for reason in sample_report().part.reasons:
        assert reason in lines
    for sheet in book.worksheets[1:]:
        assert sheet["A1"].value == "SIMULATED, INCOMPLETE"
    with zipfile.ZipFile(path) as archive:
        for number in range(1, len(book.worksheets) + 1):
            # On every sheet of paper as well.
            xml = archive.read(f"xl/worksheets/sheet{number}.xml")
            assert b"<oddHeader>&amp;C&amp;BSIMULATED, INCOMPLETE</oddHeader>" in xml
    (path,) = write_report(sample_report(whole_view()), ("xlsx",), tmp_path)
    book = openpyxl.load_workbook(path)
    assert book.worksheets[0]["A1"].fill.fgColor.rgb == "FFC6EFCE"
    assert book["Characteristics"]["A1"].value == "Name"


def test_every_row_of_a_table_with_a_header_says_it_whatever_the_profile_shows(
    tmp_path: Path,
) -> None:
    data = sample_report(whole_view(simulated=True))
    paths = write_report(data, ("polyworks",), tmp_path, narrow(polyworks_profile()))
    for path in paths:
        if path.suffix == ".csv" and "_job" not in path.name:
            rows = list(csv.DictReader(io.StringIO(path.read_text("ascii"))))
            assert rows
            assert {row[JOB_STATE] for row in rows} == {"SIMULATED"}


def test_the_verdict_on_the_part_stands_first_in_every_format(tmp_path: Path) -> None:
    data = sample_report()
    paths = {path.name: path for path in write_report(data, ALL, tmp_path)}
    first = paths["Block_07_INCOMPLETE_job.csv"].read_text("ascii").splitlines()[1]
    assert first == "Part verdict,PART DOES NOT CONFORM"
    plain = json.loads(paths["Block_07_INCOMPLETE.json"].read_text("utf-8"))
    assert list(plain)[:3] == ["schema", "unit", "part_verdict"]
    assert plain["part_verdict"] == {
        "word": "PART DOES NOT CONFORM",
        "verdict": "NOT CONFORM",
        "complete": False,
        "not_conform": ["Bore too big", "Bore too small"],
        "not_proven": ["Bore in doubt"],
        "missing": ["BALL", "Ball diameter"],
        "counts": {"NOT CONFORM": 2, "NOT PROVEN": 1, "NOT MEASURED": 1, "CONFORM": 1},
        "requirements": "",
    }
    assert plain["state"] == ["INCOMPLETE"]
    assert (plain["job"]["complete"], plain["simulated"]) == (False, False)
    assert [(item["verdict"], item["deciding"]) for item in plain["features"]] == [
        ("NOT CONFORM", "Bore too big"),
        (None, ""),
        ("NOT MEASURED", "Ball diameter"),
    ]
    root = etree.parse(paths["Block_07_INCOMPLETE.qif"])
    assert {one.text for one in root.iter(f"{Q}InspectionStatusEnum")} == {"FAIL"}
    attributes = root.findall(f".//{Q}MeasurementResults/{Q}Attributes/*")
    assert [one.get("value") for one in attributes[:2]] == ["PART DOES NOT CONFORM", "INCOMPLETE"]
    transfer = read_transfer(paths["Block_07_INCOMPLETE.dfq"].read_bytes())
    remark = transfer.text("K0009")
    assert remark is not None
    assert remark.startswith("INCOMPLETE; PART DOES NOT CONFORM; NOT CONFORM: Bore too big, Bore")
    assert [line.index for line in transfer.lines if line.key == "K0009"] == [0, 2, 3, 4, 5]
    for name in ALL:
        assert PartWord.DOES_NOT_CONFORM.value in preview_text(preview(data, name))


@pytest.mark.parametrize(
    ("view", "status"),
    [
        (whole_view(), "PASS"),
        (sample_view(), "FAIL"),
        (replace(whole_view(), characteristics=RESULTS[3:4]), "UNKNOWN"),
        (replace(whole_view(), characteristics=(RESULTS[0], RESULTS[4])), "UNKNOWN"),
        (replace(whole_view(), characteristics=()), "UNKNOWN"),
    ],
)
def test_qif_passes_the_part_only_where_it_conforms(
    tmp_path: Path, view: JobView, status: str
) -> None:
    (path,) = write_report(sample_report(view), ("qif",), tmp_path)
    found = [one.text for one in etree.parse(path).iter(f"{Q}InspectionStatusEnum")]
    # Status of the results, and of the component.
    assert found == [status, status]


def _replaced(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    def spoil(content: bytes) -> bytes:
        if not content.startswith(b"PK"):
            return content.replace(old, new)
        changed = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(content)) as before, zipfile.ZipFile(changed, "w") as new_:
            for part in before.namelist():
                new_.writestr(part, before.read(part).replace(old, new))
        return changed.getvalue()

    return spoil


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"PART DOES NOT CONFORM", b"PART CONFORMS"),
        (b"SIMULATED", b"MEASURED"),
        (b"INCOMPLETE", b"COMPLETE"),
        (b"Bore in doubt", b"Bore in order"),
    ],
)
@pytest.mark.parametrize("name", ALL)
def test_a_verdict_or_a_state_that_does_not_come_back_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, old: bytes, new: bytes
) -> None:
    data = sample_report(replace(sample_view(), simulated=True))
    if name in ("cloud", "points") and old == b"Bore in doubt":
        # Files of points name no characteristic.
        assert old not in b"".join(EXPORTERS[name].contents((data,), polyworks_profile()).values())
        return
    spoil = _replaced(old, new)
    spoil_files(monkeypatch, lambda _path, content: spoil(content))
    with pytest.raises(StorageError) as caught:
        write_report(data, (name,), tmp_path)
    assert caught.value.code == "export.differs"
    assert list(tmp_path.iterdir()) == []


def test_the_status_of_the_part_in_qif_is_read_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil = _replaced(b"<InspectionStatusEnum>FAIL", b"<InspectionStatusEnum>PASS")
    spoil_files(monkeypatch, lambda _path, content: spoil(content))
    with pytest.raises(StorageError, match="status of the part is not FAIL"):
        write_report(sample_report(), ("qif",), tmp_path)


def test_simulated_values_do_not_count_in_statistics_nor_stand_beside_real_ones(
    tmp_path: Path,
) -> None:
    jobs = [
        sample_report(
            replace(whole_view(simulated=simulated), job=f"Block_{number}"),
            head=replace(HEAD, serial=f"S{number}"),
        )
        for number, simulated in enumerate((True, True, False))
    ]
    (path,) = write_report(jobs[:2], ("dfq",), tmp_path)
    assert path.name == "BLOCK_2_parts_SIMULATED.dfq"
    transfer = read_transfer(path.read_bytes())
    assert {fields["K0002"] for values in transfer.values for fields in values} == {"255"}
    assert transfer.text("K1900", 0) is not None
    assert str(transfer.text("K1900")).startswith("SIMULATED; 2 of 2 PART CONFORMS")
    with pytest.raises(StorageError, match="Block_1 is SIMULATED and Block_2 is not"):
        write_report(jobs[1:], ("dfq",), tmp_path)


def test_no_name_is_lost_however_many_fail(tmp_path: Path) -> None:
    names = [f"A characteristic with a rather long name {number}" for number in range(60)]
    failing = tuple(result(name, 20.5, Verdict.NOT_CONFORM) for name in names)
    data = sample_report(replace(whole_view(), characteristics=failing))
    paths = {path.name: path for path in write_report(data, ("polyworks", "xlsx"), tmp_path)}
    told = paths["Block_07_job.csv"].read_text("ascii").split("\r\nJob,")[0]
    front = openpyxl.load_workbook(paths["Block_07.xlsx"]).worksheets[0]
    shown = " ".join(str(row[0].value) for row in front.iter_rows())
    for name in names:
        assert name in told
        assert name in shown


def test_a_report_of_a_version_without_verdicts_is_still_read() -> None:
    data = sample_report()
    (content,) = EXPORTERS["json"].contents((data,), polyworks_profile()).values()
    old = json.loads(content)
    for name in ("part_verdict", "state", "simulated"):
        del old[name]
    for item in old["features"]:
        del item["verdict"], item["deciding"]
    found = read_report(json.dumps(old).encode())
    assert found.part_verdict is None
    assert found.state == ()
    assert found.features[0].verdict is None


def test_a_long_name_leaves_room_for_all_states(tmp_path: Path) -> None:
    view = replace(sample_view(), job="J" * 60, simulated=True, unproven="Not calibrated.")
    (path,) = write_report(sample_report(view), ("json",), tmp_path)
    assert path.name == f"{'J' * 60}_SIMULATED_INCOMPLETE_UNCALIBRATED.json"
