"""Accepted points and sections of real job files, by the command line, read by other readers."""

from __future__ import annotations

import csv
import importlib.util
import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import MaterialExpansion, Temperature
from ocmm_core.documents import resource
from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import ReportData, polyworks_profile, report_of_job
from ocmm_core.geometry import Float
from ocmm_core.inspection.finished import ReopenedJob, reopen_job
from ocmm_core.measuring import PartTemperature, joint_factors, reported_points
from ocmm_core.tables import read_points_file
from tests.commands import Ocmm
from tests.core.export.sample_report import sample_report, sample_view
from tests.host import needs_package

JOBS = Path(__file__).parents[1] / "golden/0.2/station/jobs"
TOUCHED = JOBS / "DEMO-001.ocmm"
WITHOUT_FRAME = JOBS / "BALL-001.ocmm"
BALL = np.array([-142.0, 17.0, 35.0])
"""mm, part: nominal centre of the sphere of the demonstration."""
RADIUS = 0.5 * 19.989
# The scale of a warm part is an error of places and radius alike.
WARM = PartTemperature(
    Temperature(25.0, 5.0, "test"), MaterialExpansion("steel", 11.5e-6, 1e-5), compensated=True
)
INCH = 25.4


@pytest.fixture(scope="module")
def touched() -> ReopenedJob:
    return reopen_job(TOUCHED)


def written(folder: Path, ending: str) -> Path:
    (path,) = folder.glob(f"*{ending}")
    assert "_SIMULATED" in path.name
    return path


def surface(data: ReportData) -> Float:
    """Return the compensated points of all features, (n, 3), mm, frame of the report."""
    return np.array([
        data.frame.apply(point.tip_world - point.tip_radius * point.direction)
        for feature in data.features
        for point in feature.seen.points
    ])  # fmt: skip


@pytest.mark.parametrize("lengths", ["mm", "inch"])
def test_points_come_back_from_every_file(
    ocmm_here: Ocmm, tmp_path: Path, touched: ReopenedJob, lengths: str
) -> None:
    profile = resource("profiles", "polyworks.toml").read_text("utf-8")
    (tmp_path / "own.toml").write_text(profile.replace('"mm"\nlength_d', f'"{lengths}"\nlength_d'))
    assert lengths in (tmp_path / "own.toml").read_text()
    done = ocmm_here(
        "report", TOUCHED, "--format", "cloud", "--format", "points", "--out", tmp_path / "out",
        "--profile", tmp_path / "own.toml",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    data = report_of_job(touched)
    wanted = surface(data)
    assert len(wanted) > 80
    scale = INCH if lengths == "inch" else 1.0
    for ending in ("xyz", "asc"):
        file = read_points_file(written(tmp_path / "out", f"_points.{ending}"))
        assert file.unit == lengths
        assert file.points == pytest.approx(wanted, abs=0.51e-4 * scale)
        assert "# state: SIMULATED" in written(tmp_path / "out", f"_points.{ending}").read_text()
    ply = read_points_file(written(tmp_path / "out", "_points.ply"))
    assert ply.points * (1.0 if ply.unit == lengths else scale) == pytest.approx(wanted, abs=1e-9)
    told = json.loads(written(tmp_path / "out", "_points.json").read_text())
    assert (told["unit"], told["frame"]) == (lengths, "Part")
    places = np.array([[one[axis] for axis in "XYZ"] for one in told["points"]])
    assert places * scale == pytest.approx(wanted, abs=1e-9)
    for one in told["points"]:
        found = data.frame.rotation @ data.covariances[one["Number"]] @ data.frame.rotation.T
        assert one["Cxy"] * scale**2 == pytest.approx(found[0, 1], rel=1e-9)
        assert 1e-4 < one["U"] * scale < 0.1
    if importlib.util.find_spec("pyarrow") is not None:
        import pyarrow.parquet

        table = pyarrow.parquet.read_table(written(tmp_path / "out", "_points.parquet"))
        assert table.to_pylist() == told["points"]
        assert table.schema.metadata[b"unit"].decode() == lengths


@pytest.mark.parametrize("part", [PartTemperature(), WARM], ids=["measured", "at 20 C"])
def test_the_uncertainty_of_a_point_is_that_of_all_errors_with_the_radius(
    touched: ReopenedJob, part: PartTemperature
) -> None:
    climate = replace(touched.options.climate, part=part)
    data = report_of_job(replace(touched, options=replace(touched.options, climate=climate)))
    points = reported_points(touched.points, part)
    factors = joint_factors(
        points, touched.sensitivities, touched.rig, touched.body, touched.options.contact, part
    )
    (content,) = (
        content
        for name, content in EXPORTERS["points"].contents((data,), polyworks_profile()).items()
        if name.endswith(".json")
    )
    told = {one["Number"]: one for one in json.loads(content)["points"]}
    for index in (0, 7, len(touched.points) - 1):
        point = touched.points[index]
        by_surface = np.zeros((3, 3 * len(touched.points) + 1))
        by_surface[:, 3 * index : 3 * index + 3] = np.eye(3)
        by_surface[:, -1] = -point.direction
        R = data.frame.rotation
        wanted = R @ factors.covariance_of(by_surface) @ R.T
        found = told[point.number]
        read = [[found[f"C{min(a, b)}{max(a, b)}"] for b in "xyz"] for a in "xyz"]
        # The correlation of spots by the pattern of the sensors is good to 5e-4.
        sigma = np.sqrt(np.diagonal(wanted))
        assert np.abs((np.array(read) - wanted) / np.outer(sigma, sigma)).max() < 1e-3
        normal = R @ point.direction
        assert found["U"] == pytest.approx(2.0 * np.sqrt(normal @ wanted @ normal), rel=1e-3)


def test_only_accepted_points_go_out() -> None:
    view = sample_view()
    bore = replace(view.features[0], outliers=(3,))
    view = replace(view, features=(bore, *view.features[1:]), held=(4,), simulated=True)
    data = replace(sample_report(view), annulled=(9,))
    for name in ("cloud", "points"):
        for file, content in EXPORTERS[name].contents((data,), polyworks_profile()).items():
            assert file.startswith("Block_07_SIMULATED_INCOMPLETE_points.")
            assert b"1 held back, 1 suspect, 1 taken back" in content
            if file.endswith((".xyz", ".asc")):
                rows = np.loadtxt(content.decode().splitlines())
                assert len(rows) == 5
            if file.endswith(".json"):
                numbers = [one["Number"] for one in json.loads(content)["points"]]
                assert numbers == [1, 2, 5, 6, 7]


def test_a_ball_centre_is_named_and_is_in_no_xyz() -> None:
    view = sample_view()
    first, *others = view.features[0].points
    bore = replace(view.features[0], points=(replace(first, direction=np.zeros(3)), *others))
    data = sample_report(replace(view, features=(bore, *view.features[1:])))
    files = {
        name.rpartition(".")[2]: content
        for one in ("cloud", "points")
        for name, content in EXPORTERS[one].contents((data,), polyworks_profile()).items()
    }
    assert b"# ball centres: 1 left out" in files["xyz"]
    assert len(np.loadtxt(files["xyz"].decode().splitlines())) == 6
    assert b"# ball centres: 1 with the vector 0 0 0" in files["asc"]
    asc = np.loadtxt(files["asc"].decode().splitlines())
    assert asc[0] == pytest.approx([*data.frame.apply(first.tip_world), 0.0, 0.0, 0.0], abs=1e-4)
    told = json.loads(files["json"])["points"]
    assert [one["Kind"] for one in told] == ["ball centre", *["surface"] * 6]
    assert told[0]["I"] is None
    # Nothing is known of the covariance of this job: empty, not zero.
    assert {one["U"] for one in told} == {None}


Drawn = dict[tuple[str, str], list[tuple[float, float]]]


def entities(path: Path) -> tuple[Drawn, list[str]]:
    """Return places by entity and layer of an R12 drawing, and its texts: a reader of its own."""
    lines = path.read_text("ascii").splitlines()
    pairs = [(int(code), value) for code, value in zip(lines[::2], lines[1::2], strict=True)]
    assert pairs[-1] == (0, "EOF")
    assert (1, "AC1009") in pairs
    found: Drawn = defaultdict(list)
    texts = []
    starts = [index for index, (code, _) in enumerate(pairs) if code == 0]
    for start, stop in zip(starts, [*starts[1:], len(pairs)], strict=True):
        fields = dict(pairs[start:stop])
        if fields[0] in ("POINT", "VERTEX"):
            found[fields[0], fields[8]].append((float(fields[10]), float(fields[20])))
        if fields[0] == "TEXT":
            texts.append(fields[1])
    return found, texts


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("ascii").splitlines()))


def test_a_section_has_the_points_near_the_plane(
    ocmm_here: Ocmm, tmp_path: Path, touched: ReopenedJob
) -> None:
    done = ocmm_here("report", TOUCHED, "--section", "-142,17,35;0,0,2;3", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    rows = rows_of(written(tmp_path, "_section1.csv"))
    data = report_of_job(touched)
    numbers = [point.number for one in data.features for point in one.seen.points]
    near = abs(surface(data)[:, 2] - 35.0) <= 3.0
    assert near.sum() > 5
    assert [int(row["Number"]) for row in rows] == np.array(numbers)[near].tolist()
    drawn, texts = entities(written(tmp_path, "_section1.dxf"))
    assert "unit: mm" in texts
    assert any(text.startswith("state: SIMULATED") for text in texts)
    scale = float(texts[-1].removeprefix("deviation x "))
    for index, (row, place) in enumerate(zip(rows, surface(data)[near], strict=True)):
        assert row["Feature"] == "SPHERE"
        assert row["JobState"].startswith("SIMULATED")
        found = {name: float(row[name]) for name in ("S", "T", "Offset", "Deviation", "U")}
        flat = place - BALL
        assert (found["S"], found["T"], found["Offset"]) == pytest.approx(flat, abs=1e-4)
        deviation = float(np.linalg.norm(flat)) - RADIUS
        assert found["Deviation"] == pytest.approx(deviation, abs=1e-4)
        assert 0.005 < found["U"] < 0.05
        assert drawn["POINT", "MEASURED"][index] == pytest.approx(flat[:2], abs=1e-6)
        nominal = flat * RADIUS / np.linalg.norm(flat)
        assert drawn["VERTEX", "NOMINAL"][index] == pytest.approx(nominal[:2], abs=1e-5)
        shown = nominal + scale * (flat - nominal)
        assert drawn["VERTEX", "DEVIATION"][index] == pytest.approx(shown[:2], abs=1e-3)


def test_a_drawing_program_reads_the_section(ocmm_here: Ocmm, tmp_path: Path) -> None:
    needs_package("ezdxf", "pip install ezdxf")
    import ezdxf

    ocmm_here("report", TOUCHED, "--section", "-142,17,35;0,0,1;3", "--out", tmp_path)
    path = written(tmp_path, "_section1.dxf")
    drawing = ezdxf.readfile(path)
    audit = drawing.audit()
    assert (audit.errors, audit.fixes) == ([], [])
    assert drawing.dxfversion == "AC1009"
    points = [tuple(one.dxf.location)[:2] for one in drawing.modelspace().query("POINT")]
    assert points == entities(path)[0]["POINT", "MEASURED"]
    assert {one.dxf.layer for one in drawing.modelspace().query("POLYLINE")} == {
        "NOMINAL", "MEASURED", "DEVIATION",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("job", "section", "told"),
    [
        (TOUCHED, "1,2;0,0,1;1", "is not a point, a normal and a distance above 0"),
        (TOUCHED, "0,0,0;0,0,0;1", "is not a point, a normal and a distance above 0"),
        (TOUCHED, "0,0,0;0,0,1;0", "is not a point, a normal and a distance above 0"),
        (TOUCHED, "0,nan,0;0,0,1;1", "is not a point, a normal and a distance above 0"),
        (TOUCHED, "=cmd;0,0,1;1", "is not a point, a normal and a distance above 0"),
        (TOUCHED, "0,0,500;0,0,1;1", "No accepted point of job DEMO-001 is within 1 mm"),
        (WITHOUT_FRAME, "0,0,0;0,0,1;1", "Job BALL-001 has no alignment"),
    ],
)
def test_an_unusable_section_is_refused(
    ocmm_here: Ocmm, tmp_path: Path, job: Path, section: str, told: str
) -> None:
    done = ocmm_here("report", job, "--section", section, "--out", tmp_path / "out")
    assert done.returncode != 0
    assert told in " ".join(done.stderr.split())
    assert not (tmp_path / "out").exists()


def path_plan(folder: Path) -> Path:
    """Return a plan with an alignment whose block and sphere are measured along paths."""
    text = resource("plans", "demo.toml").read_text("utf-8")
    before, mark, after = text.partition("[[characteristics]]")
    head, *features = before.split("[[features]]")
    kept = []
    for feature in features:
        name = feature.split('name = "')[1].partition('"')[0]
        points = next(line for line in feature.splitlines() if line.startswith("points"))
        if name in ("BLOCK_TOP", "SPHERE"):
            feature = feature.replace(points, "points = 30\nspacing = 1.0")
        if name in ("PLATE_TOP", "BORE_A", "BORE_B", "BLOCK_TOP", "SPHERE"):
            kept.append(feature)
    file = folder / "paths.toml"
    diameter = after.partition(mark)[0]
    section = f"""{mark}
name = "Ball in section"
kind = "line profile"
features = ["SPHERE"]
upper = 0.2
cut = [1.0, 0.0, 0.0]
cut_at = [-140.0, 0.0, 50.0]
within = 1.9
"""
    file.write_text("[[features]]".join([head, *kept]) + mark + diameter + section, "utf-8")
    return file


def edges_of(path: Path) -> list[Float]:
    """Return the vertices (n, 3) of every wire of a STEP file, read by another program."""
    needs_package("OCP", "./run setup --step")
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    from ocmm_cad.step.brep._library import static

    reader = STEPControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone
    reader.TransferRoots()
    edges = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_EDGE)
    found = []
    while edges.More():
        curve = BRepAdaptor_Curve(static(TopoDS, "Edge")(edges.Current())).BSpline()
        poles = [curve.Pole(k) for k in range(1, curve.NbPoles() + 1)]
        found.append(np.array([[one.X(), one.Y(), one.Z()] for one in poles]))
        edges.Next()
    return found


@pytest.mark.slow
def test_a_section_of_a_path_is_in_the_order_of_the_path(
    ocmm_here: Ocmm, tmp_path: Path, calm_rig: Path
) -> None:
    out = tmp_path / "out"
    plan = path_plan(tmp_path)
    measured = ocmm_here("measure", "--plan", plan, "--rig", calm_rig, "--out", out)
    assert measured.returncode == 0, measured.stderr
    (job,) = out.glob("*.ocmm")
    done = ocmm_here("report", job, "--section", "-142,17,35;1,0,0;1.9", "--out", tmp_path / "cut")
    assert done.returncode == 0, done.stderr
    rows = rows_of(written(tmp_path / "cut", "_section1.csv"))
    planned = ocmm_here("report", job, "--section", "plan", "--out", tmp_path / "planned")
    assert planned.returncode == 0, planned.stderr
    # The part frame starts at bore A: the same plane in other coordinates.
    by_plan = rows_of(written(tmp_path / "planned", "_section1.csv"))
    assert [row["Number"] for row in by_plan] == [row["Number"] for row in rows]
    edges = edges_of(written(tmp_path / "cut", "_section1.stp"))
    drawn = np.vstack(edges)
    lonely = [one for one in {row["Curve"] for row in rows} if sum(
        row["Curve"] == one for row in rows) == 1]  # fmt: skip
    kept = [row for row in rows if row["Curve"] not in lonely]
    wanted = [[float(row[axis]) for axis in "XYZ"] for row in kept]
    assert drawn == pytest.approx(np.array(wanted), abs=1e-4)
    ball = [row for row in rows if row["Feature"] == "SPHERE"]
    assert len(ball) > 10
    numbers = [int(row["Number"]) for row in ball]
    assert numbers == sorted(numbers)
    curves = defaultdict(list)
    for row in ball:
        curves[row["Curve"]].append([float(row[axis]) for axis in "XYZ"])
        place = np.array([float(row[axis]) for axis in "XYZ"])
        deviation = float(np.linalg.norm(place - BALL)) - RADIUS
        assert float(row["Deviation"]) == pytest.approx(deviation, abs=2e-4)
        assert abs(deviation) < 0.06
    assert len(curves) > 1
    for curve in curves.values():
        # The path has points 1 mm apart; a curve has no gap of several.
        steps = np.linalg.norm(np.diff(np.array(curve), axis=0), axis=1)
        assert np.all(steps < 6.0)


def test_sections_of_two_jobs_do_not_replace_each_other(ocmm_here: Ocmm, tmp_path: Path) -> None:
    section = ("--section", "-142,17,35;0,0,1;3", "--section", "-142,17,35;0,0,1;1")
    done = ocmm_here("report", TOUCHED, *section, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "out").glob("*_section[12].*[vfp]"))) == 6
    twice = ocmm_here("report", TOUCHED, TOUCHED, *section, "--out", tmp_path / "twice")
    assert twice.returncode != 0
    assert "Two jobs have the same name" in twice.stderr
    assert not (tmp_path / "twice").exists()
