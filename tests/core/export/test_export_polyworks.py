"""The PolyWorks files, byte for byte, from a job that was put together by hand."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import io
import locale
import os
import shutil
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import StorageError
from ocmm_core.export.polyworks import FEATURES_HEADER, REPORT_HEADER, export_polyworks
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.features.shapes import Shape, element, make_fit
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.view import FeatureState, FeatureView, JobView
from ocmm_core.measuring.point import MeasuredPoint
from ocmm_core.tolerances.result import CharacteristicResult, Verdict

# A quarter turn about z and a shift: part x is world y, part y is minus world x.
PART_FROM_WORLD = RigidTransform(
    np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.0, 0.0, -1000.0])
)


def point(number: int, tip: tuple[float, ...], direction: tuple[float, ...]) -> MeasuredPoint:
    return MeasuredPoint(
        number=number,
        feature="any",
        time_s=0.0,
        first_frame=0,
        last_frame=9,
        n_frames=10,
        tip_world=np.array(tip),
        random_covariance=np.eye(3) * 1e-6,
        direction=np.array(direction),
        tip_radius=1.5,
        rotation_world_from_probe=np.eye(3),
        spots=np.full((2, 4, 2), np.nan),
        chi2_per_dof=1.0,
        approach="trail",
    )


def feature(
    name: str,
    shape: Shape,
    points: list[MeasuredPoint],
    geometry: list[float] | None,
    residuals: list[float],
) -> FeatureView:
    fit = None
    if geometry is not None:
        jacobian = np.zeros((12, 3 * len(points)))
        measured = element(geometry[0:3], geometry[3:6], geometry[6])
        fit = make_fit(shape, measured, jacobian, np.array(residuals))
    state = FeatureState.DONE if fit else FeatureState.PENDING
    return FeatureView(name, shape, len(points), state, tuple(points), fit, None, "")


def result(name: str, measured: float | None, verdict: Verdict) -> CharacteristicResult:
    return CharacteristicResult(
        name=name,
        kind="diameter",
        features=("BORE 1",),
        nominal=20.0,
        lower=-0.01,
        upper=0.02,
        measured=measured,
        deviation=None if measured is None else measured - 20.0,
        uncertainty=None if measured is None else 0.00384,
        verdict=verdict,
    )


def sample_job() -> JobView:
    bore = [
        point(1, (8.5, 0.0, 1000.0), (-1.0, 0.0, 0.0)),
        point(2, (-8.5, 0.0, 1000.0), (1.0, 0.0, 0.0)),
        point(3, (0.0, 8.5, 1000.0), (0.0, -1.0, 0.0)),
        point(4, (-0.00001, -8.5, 999.99999), (0.0, 1.0, -1e-9)),
    ]
    face = [point(5 + i, (40.0 * i, 7.0, 1001.5), (0.0, 0.0, 1.0)) for i in range(3)]
    return JobView(
        job="Block_07",
        part="Block",
        operator="A. Tester",
        features=(
            feature(
                "BORE 1", Shape.CIRCLE, bore,
                [-0.00001, 1.25, 1000.0, 0.0, 0.0, 1.0, 10.00123], [0.002, -0.001, 0.002, -0.001],
            ),
            feature("FACE", Shape.PLANE, face, [40.0, 7.0, 1000.0, 0.0, 0.0, 1.0, 0.0], [0.0] * 3),
            feature("BALL", Shape.SPHERE, [], None, []),
        ),
        active="BALL",
        characteristics=(
            result("Bore diameter", 20.00246, Verdict.CONFORM),
            result("Bore too big", 20.0312, Verdict.NOT_CONFORM),
            result("Bore too small", 19.9812, Verdict.NOT_CONFORM),
            result("Bore in doubt", 20.0195, Verdict.NOT_PROVEN),
            result("Ball diameter", None, Verdict.NOT_MEASURED),
        ),
        refusal=None,
        complete=False,
    )  # fmt: skip


NOMINALS = [
    NominalFeature(
        name="BORE 1", shape=Shape.CIRCLE, points=4, point=(1.25, 0.0, 0.0), diameter=20.0,
        direction=(0.0, 0.0, 2.0), side="inner",
    ),
    NominalFeature(name="FACE", shape=Shape.PLANE, points=3, point=(7.0, -40.0, 0.0)),
    NominalFeature(
        name="BALL", shape=Shape.SPHERE, points=5, point=(100.0, -0.00001, 50.0), diameter=19.989
    ),
]  # fmt: skip

STATE = "VALID 0123456789ab"
TIP = "VALID standard/6 mm 0123456789ab due 2027-01-01"
export = partial(
    export_polyworks,
    calibration=STATE,
    temperature="Probe 21 C",
    probe=TIP,
    reference="plate 0123456789ab",
)
LAST = f"{STATE},Probe 21 C,{TIP},plate 0123456789ab"

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
    b"Name,Type,Component,X,Y,Z,I,J,K,Diameter,Length,Angle,Form,RMS,NbPoints,CoordinateSystem,Unit"
    b"\r\n"
    b"BORE 1,Circle,Nominal,1.2500,0.0000,0.0000,0.000000,0.000000,1.000000,20.0000,,,,,,Part,mm"
    b"\r\n"
    b"BORE 1,Circle,Measured,1.2500,0.0000,0.0000,0.000000,0.000000,1.000000,20.0025,,,0.0030,"
    b"0.0016,4,Part,mm\r\n"
    b"FACE,Plane,Nominal,7.0000,-40.0000,0.0000,0.000000,0.000000,1.000000,,,,,,,Part,mm\r\n"
    b"FACE,Plane,Measured,7.0000,-40.0000,0.0000,0.000000,0.000000,1.000000,,,,,,3,Part,mm\r\n"
    b"BALL,Sphere,Nominal,100.0000,0.0000,50.0000,,,,19.9890,,,,,,Part,mm\r\n"
)
REPORT = (
    "Name,Control,Nominal,Measured,Deviation,TolLower,TolUpper,Test,OutTol,Uncertainty,Unit,"
    "Calibration,Temperature,Probe,Reference\r\n"
    "Bore diameter,Diameter,20.0000,20.0025,0.0025,-0.0100,0.0200,Pass,0.0000,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore too big,Diameter,20.0000,20.0312,0.0312,-0.0100,0.0200,Fail,0.0112,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore too small,Diameter,20.0000,19.9812,-0.0188,-0.0100,0.0200,Fail,0.0088,0.0038,mm,"
    f"{LAST}\r\n"
    "Bore in doubt,Diameter,20.0000,20.0195,0.0195,-0.0100,0.0200,Fail,0.0000,0.0038,mm,"
    f"{LAST}\r\n"
    "Ball diameter,Diameter,20.0000,,,-0.0100,0.0200,Fail,,,mm,"
    f"{LAST}\r\n"
).encode("ascii")


def test_the_three_files_are_as_agreed_to_the_byte(tmp_path: Path) -> None:
    paths = export(
        sample_job(), NOMINALS, tmp_path / "new" / "folder", T_part_from_world=PART_FROM_WORLD
    )
    assert [path.name for path in paths] == [
        "Block_07_points.csv", "Block_07_features.csv", "Block_07_report.csv",
    ]  # fmt: skip
    assert [path.read_bytes() for path in paths] == [POINTS_PART, FEATURES_PART, REPORT]
    assert sorted(paths) == sorted((tmp_path / "new" / "folder").iterdir())


def test_without_an_alignment_what_was_measured_stays_in_the_world(tmp_path: Path) -> None:
    points, features, report = export(
        sample_job(), NOMINALS, tmp_path, T_part_from_world=None
    )
    first = points.read_bytes().split(b"\r\n")[0]
    assert first == b"BORE 1.001,10.0000,0.0000,1000.0000,-1.000000,0.000000,0.000000"
    rows = list(csv.DictReader(io.StringIO(features.read_text("ascii"))))
    assert {(row["Component"], row["CoordinateSystem"]) for row in rows} == {
        ("Nominal", "Part"),
        ("Measured", "World"),
    }
    assert [rows[1][axis] for axis in "XYZ"] == ["0.0000", "1.2500", "1000.0000"]
    assert report.read_bytes() == REPORT


def test_other_programs_read_the_files(tmp_path: Path) -> None:
    points, features, report = export(
        sample_job(), NOMINALS, tmp_path, T_part_from_world=PART_FROM_WORLD
    )
    table = np.loadtxt(points, delimiter=",", usecols=range(1, 7))
    assert table.shape == (7, 6)
    # Surface points lie on the bore: 4 decimals allow half of 1e-4 per axis.
    assert np.hypot(table[:4, 0], table[:4, 1]) == pytest.approx(10.0, abs=1e-4)
    assert np.linalg.norm(table[:, 3:], axis=1) == pytest.approx(1.0, abs=2e-6)
    for path, header in ((features, FEATURES_HEADER), (report, REPORT_HEADER)):
        with path.open(newline="", encoding="ascii") as stream:
            rows = list(csv.reader(stream))
        assert ",".join(rows[0]) == header
        assert {len(row) for row in rows} == {len(rows[0])}


@pytest.fixture
def comma_locale(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Run the test in a locale with a decimal comma, made for it where none is installed."""
    before = locale.setlocale(locale.LC_ALL)
    names = ["de_DE.UTF-8", "fr_FR.UTF-8", "German_Germany.1252"]
    with pytest.MonkeyPatch.context() as patch:
        if shutil.which("localedef"):
            folder = tmp_path_factory.mktemp("locales")
            made = folder / "ocmm_comma.UTF-8"
            command = ["localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", str(made)]
            if subprocess.run(command, capture_output=True, check=False).returncode == 0:
                patch.setenv("LOCPATH", str(folder))
                names.insert(0, made.name)
        for name in names:
            with contextlib.suppress(locale.Error):
                locale.setlocale(locale.LC_ALL, name)
                break
        else:
            pytest.skip("no locale with a decimal comma (apt install locales or locales-all)")
        try:
            yield
        finally:
            locale.setlocale(locale.LC_ALL, before)


@pytest.mark.usefixtures("comma_locale")
def test_a_comma_locale_changes_nothing(tmp_path: Path) -> None:
    assert locale.format_string("%.1f", 0.5) == "0,5"
    paths = export(sample_job(), NOMINALS, tmp_path, T_part_from_world=PART_FROM_WORLD)
    assert [path.read_bytes() for path in paths] == [POINTS_PART, FEATURES_PART, REPORT]


@pytest.mark.parametrize(
    "name",
    ["A,B", 'A"B', "A\r\nB", "A\n", "=1+1", "+A", "-A", "@A", "$X", "", "x" * 61, "Größe", "../A",
     "A/B", "A;B", " A", "\tA"],
)  # fmt: skip
@pytest.mark.parametrize("where", ["job", "feature", "characteristic"])
def test_a_hostile_name_is_refused_and_nothing_is_written(
    tmp_path: Path, name: str, where: str
) -> None:
    job = sample_job()
    if where == "job":
        job = dataclasses.replace(job, job=name)
    elif where == "feature":
        bad = dataclasses.replace(job.features[1], name=name)
        job = dataclasses.replace(job, features=(job.features[0], bad))
    else:
        bad_result = dataclasses.replace(job.characteristics[2], name=name)
        job = dataclasses.replace(job, characteristics=(*job.characteristics[:2], bad_result))
    with pytest.raises(StorageError) as caught:
        export(job, NOMINALS, tmp_path, T_part_from_world=None)
    assert caught.value.code == "export.name"
    assert where in caught.value.what
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_no_number_is_refused(tmp_path: Path, value: float) -> None:
    job = sample_job()
    bad = dataclasses.replace(job.characteristics[0], measured=value)
    with pytest.raises(StorageError, match="'Bore diameter' is"):
        export(
            dataclasses.replace(job, characteristics=(bad,)),
            NOMINALS,
            tmp_path,
            T_part_from_world=None,
        )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["measured", "deviation", "uncertainty"])
def test_a_result_without_one_of_its_numbers_never_passes(tmp_path: Path, missing: str) -> None:
    complete = result("Bore diameter", 20.001, Verdict.CONFORM)
    parts = {
        "measured": dataclasses.replace(complete, measured=None),
        "deviation": dataclasses.replace(complete, deviation=None),
        "uncertainty": dataclasses.replace(complete, uncertainty=None),
    }
    job = dataclasses.replace(sample_job(), characteristics=(parts[missing],))
    report = export(job, NOMINALS, tmp_path, T_part_from_world=None)[2]
    row = report.read_text("ascii").splitlines()[1]
    assert row == f"Bore diameter,Diameter,20.0000,,,-0.0100,0.0200,Fail,,,mm,{LAST}"


def test_a_value_that_is_not_trusted_is_not_printed(tmp_path: Path) -> None:
    doubtful = result("Bore diameter", 20.001, Verdict.NOT_MEASURED)
    job = dataclasses.replace(sample_job(), characteristics=(doubtful,))
    report = export(job, NOMINALS, tmp_path, T_part_from_world=None)[2]
    row = report.read_text("ascii").splitlines()[1]
    assert row == f"Bore diameter,Diameter,20.0000,,,-0.0100,0.0200,Fail,,,mm,{LAST}"


def test_a_feature_that_the_plan_does_not_know_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="'FACE' of the job is not in the plan"):
        export(sample_job(), NOMINALS[:1], tmp_path, T_part_from_world=None)


@pytest.mark.parametrize("folder", ["file.txt", "file.txt/below", "/proc/ocmm", "/dev/null"])
def test_an_unwritable_folder_is_one_sentence(tmp_path: Path, folder: str) -> None:
    (tmp_path / "file.txt").write_text("a file, no folder")
    with pytest.raises(StorageError) as caught:
        export(sample_job(), NOMINALS, tmp_path / folder, T_part_from_world=None)
    assert caught.value.code == "export.not_writable"
    assert "Block_07_points.csv" in caught.value.what
    assert (tmp_path / "file.txt").read_text() == "a file, no folder"


@pytest.mark.parametrize("existing", [True, False])
@pytest.mark.parametrize("blocked", ["points", "features", "report"])
def test_all_three_files_or_none(tmp_path: Path, blocked: str, existing: bool) -> None:
    # A folder of the file's name cannot be replaced, whoever runs this.
    (tmp_path / f"Block_07_{blocked}.csv").mkdir()
    others = [name for name in ("points", "features", "report") if name != blocked]
    if existing:
        for name in others:
            (tmp_path / f"Block_07_{name}.csv").write_bytes(b"older export")
    before = sorted(os.listdir(tmp_path))  # noqa: PTH208 - hidden leftovers count, names suffice
    with pytest.raises(StorageError, match=f"Block_07_{blocked}"):
        export(sample_job(), NOMINALS, tmp_path, T_part_from_world=None)
    assert sorted(os.listdir(tmp_path)) == before  # noqa: PTH208 - see above
    for name in others if existing else []:
        assert (tmp_path / f"Block_07_{name}.csv").read_bytes() == b"older export"


def test_the_files_of_a_job_that_proves_nothing_say_so(tmp_path: Path) -> None:
    job = dataclasses.replace(sample_job(), unproven="Measured as uncalibrated.")
    paths = export_polyworks(
        job, NOMINALS, tmp_path, T_part_from_world=None, calibration="UNCALIBRATED 0123456789ab"
    )
    assert [path.name for path in paths] == [
        f"Block_07_UNCALIBRATED_{kind}.csv" for kind in ("points", "features", "report")
    ]
    with paths[2].open(newline="", encoding="ascii") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["Calibration"] for row in rows} == {"UNCALIBRATED 0123456789ab"}


def test_a_second_export_replaces_the_first(tmp_path: Path) -> None:
    export(sample_job(), NOMINALS, tmp_path, T_part_from_world=None)
    paths = export(sample_job(), NOMINALS, tmp_path, T_part_from_world=PART_FROM_WORLD)
    assert paths[0].read_bytes() == POINTS_PART
    assert len(list(tmp_path.iterdir())) == 3
