"""The PolyWorks files, byte for byte, from a job that was put together by hand."""

from __future__ import annotations

import csv
import dataclasses
import io
import locale
import os
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.build import build_version
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import ENDING, EXPORTERS, preview, preview_text
from ocmm_core.export.report import ReportData, load_profile, polyworks_profile
from ocmm_core.export.report._exporter import cell_text
from ocmm_core.features.shapes import NominalFeature, Shape, element
from ocmm_core.tables import read_points_file
from ocmm_core.tolerances.decisions import U_WORDS, Verdict
from tests.core.export.sample_report import (
    COLD,
    HEAD,
    PLATE,
    STATE,
    TIP,
    feature,
    point,
    result,
    sample_report,
    sample_view,
    with_name,
)
from tests.core.export.sample_report import write_incomplete as write_report
from tests.core.export.spoiling_disk import spoil_files

HELD = f"{STATE},{COLD},{TIP},{PLATE}"
LAST = f"{HELD},PART DOES NOT CONFORM,INCOMPLETE"
UNMEASURED = "Bore diameter,Diameter,20.0000,,,-0.0100,0.0200,Not measured,,,mm"
STEM = "Block_07_INCOMPLETE"

POINTS_PART = (
    b"BORE 1.001,0.0000,-10.0000,0.0000,0.000000,1.000000,0.000000\r\n"
    b"BORE 1.002,0.0000,10.0000,0.0000,0.000000,-1.000000,0.000000\r\n"
    b"BORE 1.003,10.0000,0.0000,0.0000,-1.000000,0.000000,0.000000\r\n"
    b"BORE 1.004,-10.0000,0.0000,0.0000,1.000000,0.000000,0.000000\r\n"
    b"FACE.001,7.0000,0.0000,0.0000,0.000000,0.000000,1.000000\r\n"
    b"FACE.002,7.0000,-40.0000,0.0000,0.000000,0.000000,1.000000\r\n"
    b"FACE.003,7.0000,-80.0000,0.0000,0.000000,0.000000,1.000000\r\n"
)
FEATURES_PART = (
    b"Name,Type,Component,X,Y,Z,I,J,K,Diameter,Length,Angle,Form,RMS,NbPoints,CoordinateSystem,Unit,"
    b"Verdict,Deciding,JobState\r\n"
    b"BORE 1,Circle,Nominal,1.2500,0.0000,0.0000,0.000000,0.000000,1.000000,20.0000,,,,,,Part,mm,"
    b",,INCOMPLETE\r\n"
    b"BORE 1,Circle,Measured,1.2500,0.0000,0.0000,0.000000,0.000000,1.000000,20.0025,,,0.0030,"
    b"0.0016,4,Part,mm,NOT CONFORM,Bore too big,INCOMPLETE\r\n"
    b"FACE,Plane,Nominal,7.0000,-40.0000,0.0000,0.000000,0.000000,1.000000,,,,,,,Part,mm,"
    b",,INCOMPLETE\r\n"
    b"FACE,Plane,Measured,7.0000,-40.0000,0.0000,0.000000,0.000000,1.000000,,,,,,3,Part,mm,"
    b",,INCOMPLETE\r\n"
    b"BALL,Sphere,Nominal,100.0000,0.0000,50.0000,,,,19.9890,,,,,,Part,mm,"
    b"NOT MEASURED,Ball diameter,INCOMPLETE\r\n"
)
REPORT = (
    "Name,Control,Nominal,Measured,Deviation,TolLower,TolUpper,Test,OutTol,Uncertainty,Unit,"
    "Calibration,Temperature,Probe,Reference,PartVerdict,JobState\r\n"
    "Bore diameter,Diameter,20.0000,20.0025,0.0025,-0.0100,0.0200,Pass,0.0000,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore too big,Diameter,20.0000,20.0312,0.0312,-0.0100,0.0200,Fail,0.0112,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore too small,Diameter,20.0000,19.9812,-0.0188,-0.0100,0.0200,Fail,0.0088,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore in doubt,Diameter,20.0000,20.0195,0.0195,-0.0100,0.0200,Not proven,0.0000,0.0038,mm,"
    f"{LAST}\r\n"
    "Ball diameter,Diameter,20.0000,,,-0.0100,0.0200,Not measured,,,mm,"
    f"{LAST}\r\n"
).encode("ascii")
CLOUD_PART = b"".join(
    line.partition(b",")[2].replace(b",", b" ") + b"\r\n" for line in POINTS_PART.splitlines()
)
MACRO_PART = (
    'version "5.0"\r\n'
    + "".join(
        f'FEATURE PRIMITIVE POINT CREATE ( {x}, {y}, {z}, "Nominal", "{name}", )\r\n'
        for name, x, y, z, *_ in csv.reader(POINTS_PART.decode("ascii").splitlines())
    )
).encode("utf-16")
JOB = (
    "Item,Value\r\n"
    "Part verdict,PART DOES NOT CONFORM\r\n"
    "Job state,INCOMPLETE\r\n"
    "Characteristics NOT CONFORM,Bore too big; Bore too small\r\n"
    "Characteristics NOT PROVEN,Bore in doubt\r\n"
    "Features INCOMPLETE,BALL\r\n"
    "Characteristics NOT MEASURED,Ball diameter\r\n"
    "Job,Block_07\r\n"
    f"Job identity,{HEAD.job_uuid}\r\n"
    "Part,Block\r\n"
    "Serial number,'=4711\r\n"
    "Operator,Zoe Muller\r\n"
    "Order,\r\n"
    "Batch,\r\n"
    f"Begun (UTC),{HEAD.created_utc}\r\n"
    "Last point (UTC),2026-03-02T07:10:07.000000+00:00\r\n"
    "Plan,BLOCK\r\n"
    f"Plan SHA-256,{HEAD.plan_identity}\r\n"
    "Plan release,not released\r\n"
    "CONFORM,1\r\n"
    "NOT CONFORM,2\r\n"
    "NOT PROVEN,1\r\n"
    "NOT MEASURED,1\r\n"
    "PROVISIONAL,0\r\n"
    f"Decision rule,{cell_text(sample_report().rule_words, polyworks_profile())}\r\n"
    f"Uncertainty,{U_WORDS}\r\n"
    "Frame,Part\r\n"
    "Complete,no\r\n"
    "Not proven because,\r\n"
    "Points held back,\r\n"
    "Points taken back,\r\n"
    f"Cameras,{STATE}{'0' * 52}\r\n"
    f"Probe,{TIP}\r\n"
    f"Reference body,{PLATE}\r\n"
    f"Temperatures,{COLD}\r\n"
    "Reported at 20 C,no\r\n"
    "Measured with,OCMM 0.1.0\r\n"
    f"Reported with,OCMM {build_version()}\r\n"
).encode("ascii")
KINDS = ("job.csv", "points.csv", "features.csv", "report.csv", "cloud.asc", "import.pwmacro")
ALL = dict(
    zip(KINDS, (JOB, POINTS_PART, FEATURES_PART, REPORT, CLOUD_PART, MACRO_PART), strict=True)
)


def export(data: ReportData, folder: Path) -> dict[str, Path]:
    """Write the files and return them by the ends of their names."""
    paths = write_report(data, ("polyworks",), folder)
    return {path.name.removeprefix(f"{data.stem}_"): path for path in paths}


def test_the_files_are_as_agreed_to_the_byte(tmp_path: Path) -> None:
    paths = export(sample_report(), tmp_path / "new" / "folder")
    assert tuple(paths) == KINDS
    assert {kind: path.read_bytes() for kind, path in paths.items()} == ALL
    beside = {path for path in (tmp_path / "new" / "folder").iterdir() if ENDING not in path.name}
    assert set(paths.values()) == beside


def test_without_an_alignment_what_was_measured_stays_in_the_world(tmp_path: Path) -> None:
    paths = export(sample_report(frame=None), tmp_path)
    first = paths["points.csv"].read_bytes().split(b"\r\n")[0]
    assert first == b"BORE 1.001,10.0000,0.0000,1000.0000,-1.000000,0.000000,0.000000"
    rows = list(csv.DictReader(io.StringIO(paths["features.csv"].read_text("ascii"))))
    assert {(row["Component"], row["CoordinateSystem"]) for row in rows} == {
        ("Nominal", "Part"),
        ("Measured", "World"),
    }
    assert [rows[1][axis] for axis in "XYZ"] == ["0.0000", "1.2500", "1000.0000"]
    # Only the job states its frame.
    assert paths["report.csv"].read_bytes() == REPORT


def test_other_programs_read_the_files(tmp_path: Path) -> None:
    paths = export(sample_report(), tmp_path)
    table = np.loadtxt(paths["points.csv"], delimiter=",", usecols=range(1, 7))
    assert table.shape == (7, 6)
    # Surface points lie on the bore: 4 decimals allow half of 1e-4 per axis.
    assert np.hypot(table[:4, 0], table[:4, 1]) == pytest.approx(10.0, abs=1e-4)
    assert np.linalg.norm(table[:, 3:], axis=1) == pytest.approx(1.0, abs=2e-6)
    assert np.array_equal(np.loadtxt(paths["cloud.asc"]), table)
    macro = paths["import.pwmacro"].read_bytes()
    assert macro.startswith(b"\xff\xfe")
    assert macro.decode("utf-16").isascii()
    for kind, columns in (("features.csv", 20), ("report.csv", 17)):
        with paths[kind].open(newline="", encoding="ascii") as stream:
            rows = list(csv.reader(stream))
        assert {len(row) for row in rows} == {columns}


@pytest.mark.usefixtures("comma_locale")
def test_a_comma_locale_changes_nothing(tmp_path: Path) -> None:
    assert locale.format_string("%.1f", 0.5) == "0,5"
    paths = export(sample_report(), tmp_path)
    assert {kind: path.read_bytes() for kind, path in paths.items()} == ALL


@pytest.mark.parametrize(
    "name", ["A\r\nB", "A\n", "=1+1", "+A", "-A", "@A", "", "../A", " A", "\tA", 'A"B', "A\u202eB"]
)
@pytest.mark.parametrize("where", ["job", "feature", "characteristic"])
def test_a_hostile_name_is_refused_and_nothing_is_written(
    tmp_path: Path, name: str, where: str
) -> None:
    with pytest.raises(StorageError) as caught:
        export(with_name(sample_report(), where, name), tmp_path)
    assert caught.value.code == "export.name"
    assert where in caught.value.what
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_no_number_is_refused(tmp_path: Path, value: float) -> None:
    view = sample_view()
    bad = dataclasses.replace(view.characteristics[0], measured=value)
    data = sample_report(dataclasses.replace(view, characteristics=(bad,)))
    with pytest.raises(StorageError, match="'Bore diameter' is"):
        export(data, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["measured", "deviation", "uncertainty"])
def test_a_result_without_one_of_its_numbers_never_passes(tmp_path: Path, missing: str) -> None:
    complete = result("Bore diameter", 20.001, Verdict.CONFORM)
    parts = {
        "measured": dataclasses.replace(complete, measured=None),
        "deviation": dataclasses.replace(complete, deviation=None),
        "uncertainty": dataclasses.replace(complete, uncertainty=None),
    }
    view = dataclasses.replace(sample_view(), characteristics=(parts[missing],))
    row = export(sample_report(view), tmp_path)["report.csv"].read_text("ascii").splitlines()[1]
    assert row == f"{UNMEASURED},{HELD},NOT COMPLETE,INCOMPLETE"


@pytest.mark.parametrize("verdict", [Verdict.NOT_MEASURED, Verdict.PROVISIONAL])
def test_a_value_that_is_not_trusted_is_not_printed(tmp_path: Path, verdict: Verdict) -> None:
    doubtful = result("Bore diameter", 20.001, verdict)
    view = dataclasses.replace(sample_view(), characteristics=(doubtful,))
    row = export(sample_report(view), tmp_path)["report.csv"].read_text("ascii").splitlines()[1]
    assert row == f"{UNMEASURED},{HELD},NOT COMPLETE,INCOMPLETE"


@pytest.mark.parametrize("folder", ["file.txt", "file.txt/below", "/proc/ocmm", "/dev/null"])
def test_an_unwritable_folder_is_one_sentence(tmp_path: Path, folder: str) -> None:
    (tmp_path / "file.txt").write_text("a file, no folder")
    with pytest.raises(StorageError) as caught:
        export(sample_report(), tmp_path / folder)
    assert caught.value.code == "export.not_writable"
    assert f"{STEM}_job.csv" in caught.value.what
    assert (tmp_path / "file.txt").read_text() == "a file, no folder"


@pytest.mark.parametrize("existing", [True, False])
@pytest.mark.parametrize("blocked", KINDS)
def test_all_files_or_none(tmp_path: Path, blocked: str, existing: bool) -> None:
    # A folder with the file's name cannot be replaced, even by root.
    (tmp_path / f"{STEM}_{blocked}").mkdir()
    others = [kind for kind in KINDS if kind != blocked]
    if existing:
        for kind in others:
            (tmp_path / f"{STEM}_{kind}").write_bytes(b"older export")
    before = sorted(os.listdir(tmp_path))  # noqa: PTH208 - hidden leftovers count, names suffice
    with pytest.raises(StorageError, match=f"{STEM}_{blocked}"):
        export(sample_report(), tmp_path)
    assert sorted(os.listdir(tmp_path)) == before  # noqa: PTH208 - see above
    for kind in others if existing else []:
        assert (tmp_path / f"{STEM}_{kind}").read_bytes() == b"older export"


def test_the_files_of_a_job_that_proves_nothing_say_so(tmp_path: Path) -> None:
    view = dataclasses.replace(sample_view(), unproven="Measured as uncalibrated.")
    names = [path.name for path in write_report(sample_report(view), ("polyworks",), tmp_path)]
    assert names == [f"Block_07_INCOMPLETE_UNCALIBRATED_{kind}" for kind in KINDS]


def test_a_second_export_replaces_the_first(tmp_path: Path) -> None:
    export(sample_report(frame=None), tmp_path)
    paths = export(sample_report(), tmp_path)
    assert paths["points.csv"].read_bytes() == POINTS_PART
    assert len(list(tmp_path.iterdir())) == len(KINDS) + 1


def test_points_are_read_back_with_their_normals(tmp_path: Path) -> None:
    paths = export(sample_report(), tmp_path)
    surface = np.loadtxt(paths["cloud.asc"])
    for kind in ("points.csv", "cloud.asc"):
        found = read_points_file(paths[kind])
        assert found.points == pytest.approx(surface[:, :3])
        assert [one.role for one in found.account.columns][-6:] == ["x", "y", "z", "i", "j", "k"]


def test_ball_centres_stand_in_files_of_their_own(tmp_path: Path) -> None:
    profile = msgspec.structs.replace(polyworks_profile(), centres=True)
    paths = write_report(sample_report(), ("polyworks",), tmp_path, profile)
    names = {path.name.removeprefix(f"{STEM}_") for path in paths}
    assert names == {*KINDS, "points_centres.csv", "cloud_centres.asc"}
    surface = np.loadtxt(tmp_path / f"{STEM}_cloud.asc")
    centres = np.loadtxt(tmp_path / f"{STEM}_cloud_centres.asc")
    # The definition of the vector: it leads from the surface to the ball centre, 1.5 mm away.
    assert centres[:, :3] == pytest.approx(surface[:, :3] + 1.5 * surface[:, 3:], abs=1.1e-4)
    assert (tmp_path / f"{STEM}_points.csv").read_bytes() == POINTS_PART


def test_slots_and_cones_carry_width_and_angle(tmp_path: Path) -> None:
    slot = element([0.0, 0.0, 1000.0], [0.0, 0.0, 1.0], 20.0, second=4.0, across=[0.0, 1.0, 0.0])
    cone = element([0.0, 0.0, 1000.0], [0.0, 0.0, 1.0], 5.0, half_angle=np.radians(15.0))
    touch = [point(1, "SLOT", (8.5, 0.0, 1000.0), (-1.0, 0.0, 0.0))]
    view = dataclasses.replace(
        sample_view(),
        features=(
            feature("SLOT", Shape.ROUND_SLOT, touch, slot, [0.0]),
            feature("CONE", Shape.CONE, [], cone, [0.0]),
        ),
        characteristics=(
            dataclasses.replace(
                result("Apex", 30.01, Verdict.CONFORM, kind="angle", nominal=30.0), upper=0.1
            ),
        ),
    )
    nominals = [
        NominalFeature(
            name="SLOT", shape=Shape.ROUND_SLOT, points=5, point=(0.0, 0.0, 0.0), length=40.0,
            width=8.0, across=(2.0, 0.0, 0.0),
        ),
        NominalFeature(
            name="CONE", shape=Shape.CONE, points=6, point=(0.0, 0.0, 0.0), diameter=10.0,
            angle_deg=30.0,
        ),
    ]  # fmt: skip
    paths = export(sample_report(view, nominals=nominals), tmp_path)
    rows = list(csv.DictReader(io.StringIO(paths["features.csv"].read_text("ascii"))))
    assert [(row["Length"], row["Width"], row["U"], row["V"]) for row in rows[:2]] == [
        ("40.0000", "8.0000", "1.000000", "0.000000"),
        ("40.0000", "8.0000", "1.000000", "0.000000"),
    ]
    assert [(row["Diameter"], row["Angle"], row["U"]) for row in rows[2:]] == [
        ("10.0000", "30.0000", ""),
        ("10.0000", "30.0000", ""),
    ]
    (angle,) = csv.DictReader(io.StringIO(paths["report.csv"].read_text("ascii")))
    assert (angle["Measured"], angle["Unit"]) == ("30.0100", "deg")


def test_the_european_profile_has_semicolons_commas_and_the_verdict(tmp_path: Path) -> None:
    profile = load_profile(resource("profiles", "european.toml"))
    paths = write_report(sample_report(), ("polyworks",), tmp_path, profile)
    text = paths[3].read_text("utf-8-sig")
    rows = list(csv.DictReader(io.StringIO(text), delimiter=";"))
    assert [row["Measured"] for row in rows] == ["20,0025", "20,0312", "19,9812", "20,0195", ""]
    verdicts = [item.verdict.value for item in sample_view().characteristics]
    assert [row["Verdict"] for row in rows] == verdicts
    assert rows[2]["Deviation"] == "-0,0188"
    assert rows[0]["Temperature"] == COLD.replace(";", ",")
    # The cloud and the macro have no sign to choose.
    assert paths[4].read_bytes() == CLOUD_PART


def test_inches_are_inches_everywhere_and_degrees_stay(tmp_path: Path) -> None:
    profile = msgspec.structs.replace(polyworks_profile(), lengths="inch", length_decimals=6)
    paths = write_report(sample_report(), ("polyworks",), tmp_path, profile)
    rows = list(csv.DictReader(io.StringIO(paths[3].read_text("ascii"))))
    assert (rows[0]["Measured"], rows[0]["Unit"]) == (f"{20.00246 / 25.4:.6f}", "inch")
    surface = np.loadtxt(paths[4])
    assert surface[0, 1] == pytest.approx(-10.0 / 25.4, abs=1e-6)
    assert surface[0, 4] == 1.0


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('decimal = "."', 'decimal = ","', "so is the decimal sign"),
        ('delimiter = ","', 'delimiter = " "', "delimiter"),
        ('"K"]', '"K", "Colour"]', "'Colour'"),
        ('"K"]', '"K", "X"]', "'X' twice"),
        ("length_decimals = 4", "length_decimals = -1", "length_decimals"),
        ('lengths = "mm"', 'lengths = "feet"', "lengths"),
    ],
)
def test_a_profile_that_no_program_could_read_is_refused(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    text = resource("profiles", "polyworks.toml").read_text("utf-8")
    assert old in text
    (tmp_path / "bad.toml").write_text(text.replace(old, new), "utf-8")
    with pytest.raises(InputError, match=sentence):
        load_profile(tmp_path / "bad.toml")


def test_the_preview_shows_what_the_files_hold() -> None:
    text = preview_text(preview(sample_report(), "polyworks"))
    for wanted in ("BORE 1.001", "-10.0000", "Bore in doubt", "19.9812"):
        assert wanted in text


@pytest.mark.parametrize("where", range(3, 2000, 397))
def test_a_file_that_does_not_come_back_as_written_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: int
) -> None:
    """A disk that changes one digit of the file; the older report stays."""
    (tmp_path / f"{STEM}_points.csv").write_bytes(b"older export")

    def spoiled(path: Path, content: bytes) -> bytes:
        places = [i for i, sign in enumerate(content) if chr(sign).isdigit()]
        if "report.csv" in path.name:
            place = places[where % len(places)]
            other = b"%d" % ((content[place] - 48 + 5) % 10)
            content = content[:place] + other + content[place + 1 :]
        return content

    spoil_files(monkeypatch, spoiled)
    with pytest.raises(StorageError) as caught:
        export(sample_report(), tmp_path)
    assert caught.value.code == "export.differs"
    assert [path.name for path in tmp_path.iterdir()] == [f"{STEM}_points.csv"]
    assert (tmp_path / f"{STEM}_points.csv").read_bytes() == b"older export"


def test_people_and_parts_are_transliterated_without_a_hash() -> None:
    """Names of features are keys and stay different; facts of the job are no keys."""
    data = sample_report()
    head = dataclasses.replace(data.head, operator="Zoë Müller", serial="№ 7 Ø")
    files = EXPORTERS["polyworks"].contents(
        (dataclasses.replace(data, head=head),), polyworks_profile()
    )
    (job,) = (content.decode("ascii") for name, content in files.items() if "_job" in name)
    assert "Operator,Zoe Muller\r\n" in job
    assert "Serial number,No 7 _\r\n" in job
    assert cell_text("Müller", polyworks_profile()) != "Muller"
