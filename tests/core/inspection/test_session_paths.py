"""Continuous probing in a job: points of a path are one step, durable, and decide like touches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as File

import msgspec
import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, MeasuringError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import SessionOptions, Target, nearness, places_of
from ocmm_core.inspection.plan import Plan, load_plan, step_fault
from ocmm_core.inspection.plan._plan import spacing_fault
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.inspection.session._path_intake import ScanGuide, thinning_of
from ocmm_core.measuring import (
    MeasuredPoint,
    Path,
    PathCollector,
    PathProgress,
    PointOptions,
    Refusal,
    RefusalCode,
)
from ocmm_core.storage import JobFile
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tracking import TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench

RATE_HZ = 1000
SPACING_MM = 2.0


def planned(plan: Plan) -> Plan:
    """Return the quick plan with paths instead of touches."""
    features = [
        msgspec.structs.replace(one, spacing=SPACING_MM, points=30) for one in plan.features
    ]
    return msgspec.structs.replace(plan, features=features)


@pytest.fixture(scope="session")
def quick_paths() -> tuple[Path, ...]:
    """Return a path on each feature of the quick plan, in order."""
    rig, body, plan = load_rig(RIG), load_probe(PROBE), planned(load_plan(PLAN))
    script = [(one.name, one.points) for one in plan.features]
    virtual = VirtualRig(
        rig, body, load_part(resource("parts", "demo.toml")), script, seed=4,
        frame_rate_hz=RATE_HZ, paths={one.name: one.spacing for one in plan.features},
    )  # fmt: skip
    pipeline, collector = TrackingPipeline(rig, body), PathCollector(1.0 / RATE_HZ)
    return tuple(collector.push(pipeline.process(virtual.frames(0, virtual.n_frames))))


@pytest.fixture
def sliding(bench: Bench) -> Bench:
    return replace(bench, plan=planned(bench.plan))


def refused(session: InspectionSession, path: Path) -> Refusal:
    outcome = session.paths.record_path(path)
    assert isinstance(outcome, Refusal)
    assert not session.has_points
    return outcome


def test_paths_make_a_part_conform(sliding: Bench, quick_paths: tuple[Path, ...]) -> None:
    assert len(quick_paths) == len(sliding.plan.features)
    with sliding.job() as job:
        session = sliding.session(job)
        for path, feature in zip(quick_paths, sliding.plan.features, strict=True):
            assert session.paths.expected
            last = session.paths.record_path(path)
            assert isinstance(last, MeasuredPoint), last
            assert last.feature == feature.name
            assert last.approach == "path"
        view = session.view
        assert {one.verdict for one in view.characteristics} == {Verdict.CONFORM}
        # True sizes of the demo part; form of a perfect part can only enlarge U.
        for one, true in zip(view.characteristics, (19.989, 20.342), strict=True):
            assert one.measured is not None
            assert one.uncertainty is not None
            assert abs(one.measured - true) < 1.5 * one.uncertainty < 0.06
        kinds = [event.kind for event in job.events()]
        assert kinds.count("path") == 3
    with sliding.job_at(sliding.folder / "again.ocmm") as job:
        again = sliding.session(job)
        for path in quick_paths:
            again.paths.record_path(path)
        first = [one.measured for one in view.characteristics]
        assert [one.measured for one in again.view.characteristics] == first


def test_a_path_is_one_step(sliding: Bench, quick_paths: tuple[Path, ...]) -> None:
    with sliding.job() as job:
        session = sliding.session(job)
        last = session.paths.record_path(quick_paths[0])
        assert isinstance(last, MeasuredPoint)
        assert "points 1 to" in session.view.undo
        with pytest.raises(MeasuringError, match="one side"):
            session.points.flip()
        session.steps.undo()
        assert not session.has_points
        session.steps.redo()
        count = len(session.stored_points()[0])
        assert count == last.number
    with JobFile.open(sliding.folder / "job.ocmm") as job:
        assert len(sliding.session(job).stored_points()[0]) == count


def test_what_is_no_path_is_refused(sliding: Bench, quick_paths: tuple[Path, ...]) -> None:
    path = quick_paths[0]
    for changed, code in (
        (replace(path, untimed=True), RefusalCode.MOVING),
        (replace(path, interrupted=True), RefusalCode.GAP),
        (replace(path, ticks=None), RefusalCode.LOST),
        (replace(path, trail_world=path.trail_world[:0]), RefusalCode.NO_APPROACH),
        # On the ball, while the bed is due: a plane does not bend.
        (quick_paths[2], RefusalCode.WRONG_FACE),
    ):
        with sliding.job_at(sliding.folder / f"{code.value}_{id(changed)}.ocmm") as job:
            found = refused(sliding.session(job), changed)
            assert found.code is code, found
            assert found.what
            assert found.remedy


def test_cameras_of_uncertain_times_measure_no_paths(
    sliding: Bench, quick_paths: tuple[Path, ...]
) -> None:
    """Of 1 us they cost a few micrometres of a moving ball, of 1 ms every point."""
    largest = []
    for number, untimed_mm in enumerate((0.0, 2e-6, 2e-3)):
        options = SessionOptions(point=PointOptions(untimed_mm=untimed_mm))
        with sliding.job_at(sliding.folder / f"timed_{number}.ocmm") as job:
            session = InspectionSession(sliding.plan, sliding.rig, sliding.body, job, options)
            if untimed_mm == 2e-3:
                found = refused(session, quick_paths[0])
                assert "too fast" in found.what
                continue
            assert isinstance(session.paths.record_path(quick_paths[0]), MeasuredPoint)
            points = session.stored_points()[0]
            largest.append(max(float(one.random_covariance.trace()) for one in points))
    assert largest[0] < largest[1] < largest[0] + (11e-6 * 100.0) ** 2


def test_single_touches_are_not_replaced_by_a_path(
    bench: Bench, quick_paths: tuple[Path, ...]
) -> None:
    with bench.job() as job:
        session = bench.session(job)
        assert not session.paths.expected
        assert refused(session, quick_paths[0]).code is RefusalCode.AMBIGUOUS


@pytest.mark.parametrize("spacing", [-1.0, 0.05, 1e9, float("nan"), float("inf")])
def test_the_distance_of_points_has_a_range(tmp_path: File, spacing: float) -> None:
    text = PLAN.read_text("utf-8").replace("points = 4", f"points = 4\nspacing = {spacing}", 1)
    file = tmp_path / "plan.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(InputError, match="spacing"):
        load_plan(file)


def test_only_surfaces_have_paths() -> None:
    plan = load_plan(resource("plans", "demo.toml"))
    line = next(one for one in plan.features if one.shape is Shape.LINE)
    fault = step_fault(msgspec.structs.replace(line, spacing=1.0), "approach")
    assert fault is not None
    assert fault[0] == "spacing"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"interval": 0.1, "turn_deg": 5.0}, "one of"),
        ({"interval": -0.1}, "to 10 s"),
        ({"turn_deg": 120.0}, "90 degrees"),
        ({"gates": (1.0, 0.0, 0.0), "spacing": 0.0}, "is missing"),
    ],
)
def test_options_of_paths_are_checked(options: dict[str, object], words: str) -> None:
    feature = planned(load_plan(PLAN)).features[0]
    fault = step_fault(msgspec.structs.replace(feature, **options), "approach")
    assert fault is not None
    assert fault[0] == "spacing"
    assert words in fault[1]


@pytest.mark.parametrize("options", [{"interval": 0.5}, {"turn_deg": 20.0}])
def test_a_path_is_thinned_as_the_plan_says(
    sliding: Bench, quick_paths: tuple[Path, ...], options: dict[str, float]
) -> None:
    counts = []
    for number, chosen in enumerate(({}, options)):
        features = [msgspec.structs.replace(one, **chosen) for one in sliding.plan.features]
        plan = msgspec.structs.replace(sliding.plan, features=features)
        with sliding.job_at(sliding.folder / f"thinned_{number}.ocmm") as job:
            session = InspectionSession(plan, sliding.rig, sliding.body, job, SessionOptions())
            assert isinstance(session.paths.record_path(quick_paths[0]), MeasuredPoint)
            counts.append(len(session.stored_points()[0]))
    assert 3 <= counts[1] < counts[0]


def test_gates_need_the_part_frame(sliding: Bench, quick_paths: tuple[Path, ...]) -> None:
    features = [
        msgspec.structs.replace(one, gates=(1.0, 0.0, 0.0)) for one in sliding.plan.features
    ]
    plan = msgspec.structs.replace(sliding.plan, features=features)
    with sliding.job() as job:
        session = InspectionSession(plan, sliding.rig, sliding.body, job, SessionOptions())
        found = refused(session, quick_paths[0])
        assert found.code is RefusalCode.NO_APPROACH
        assert "gates" in found.what


def test_gates_lie_where_the_plan_says() -> None:
    feature = msgspec.structs.replace(
        planned(load_plan(PLAN)).features[0], gates=(0.0, 2.0, 0.0), point=(0.0, 7.0, 0.0)
    )
    place = RigidTransform(rotation_from_vector(np.array([0.3, -0.2, 1.1])), np.array([5, 6, 7.0]))
    rule = thinning_of(feature, place)
    assert rule is not None
    assert rule.gates is not None
    assert place.rotation @ rule.gates == pytest.approx([0.0, 1.0, 0.0])
    assert place.apply(rule.start) == pytest.approx([0.0, 7.0, 0.0])


SCANS = [
    {"shape": "Plane", "scan": "raster", "length": 60.0, "width": 20.0},
    {"shape": "Circle", "scan": "ring", "diameter": 30.0},
    {"shape": "Circle", "scan": "ring", "diameter": 30.0, "side": "inner"},
    {"shape": "Cylinder", "scan": "spiral", "diameter": 30.0, "length": 40.0, "side": "inner"},
    {"shape": "Cone", "scan": "spiral", "diameter": 30.0, "length": 20.0, "angle_deg": 40.0},
    {"shape": "Sphere", "scan": "spiral", "diameter": 30.0},
]


def scanned(said: dict[str, object]) -> NominalFeature:
    made = {"name": "IT", "points": 120, "point": (5.0, 6.0, 7.0), "spacing": 1.5, **said}
    return msgspec.convert({"direction": (0.6, 0.0, 0.8), **made}, NominalFeature)


@pytest.mark.parametrize("said", SCANS)
def test_a_scan_lies_on_its_surface_and_is_covered_by_sliding_along_it(
    said: dict[str, object],
) -> None:
    feature, radius = scanned(said), 1.5
    assert not spacing_fault(feature)
    places = places_of(feature, feature.points)
    balls = places.points + radius * places.normals
    gaps = [nearness(feature, ball, radius).gap for ball in balls]
    assert max(gaps) == pytest.approx(0.0, abs=1e-9)
    steps = np.linalg.norm(np.diff(places.points, axis=0), axis=1)
    assert steps.max() < 2.5 * np.median(steps)
    targets = [
        Target("IT", *rows, approximate=False)
        for rows in zip(places.points, places.normals, balls, strict=True)
    ]
    guide = ScanGuide(feature, targets, RigidTransform.identity(), radius)
    start = PathProgress(0.0, 10.0)
    shares: list[float] = []
    for part in np.array_split(balls, 6):
        seen = guide.follow(start, part)
        assert not seen.lifted
        assert seen.covered is not None
        shares.append(seen.covered)
    assert shares == sorted(shares)
    assert shares[2] == pytest.approx(0.5, abs=0.12)
    assert shares[-1] == 1.0
    up = guide.follow(start, balls[-1:] + 0.6 * places.normals[-1])
    assert up.lifted
    assert guide.follow(start, np.full((1, 3), np.nan)) == start


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"shape": "Cylinder", "scan": "ring", "diameter": 9.0, "length": 9.0}, "only for: circle"),
        ({"shape": "Plane", "scan": "raster", "length": 60.0}, "width of a raster"),
        ({"shape": "Plane", "scan": "raster", "spacing": 0.0}, "is missing"),
    ],
)
def test_impossible_scans_are_refused(said: dict[str, object], words: str) -> None:
    assert words in spacing_fault(scanned(said))
