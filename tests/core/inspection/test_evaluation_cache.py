"""The cached evaluation against the evaluation from nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from operator import add

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment import Alignment, DatumReferenceFrame
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.errors import MeasuringError
from ocmm_core.features.measured import ActualFeature, Midpoint
from ocmm_core.geometry import rotation_from_vector
from ocmm_core.inspection.evaluation import (
    EvaluationCache,
    HoldReason,
    JobResults,
    JobView,
    SessionOptions,
    evaluate_job,
)
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Climate, MeasuredPoint, PartTemperature
from ocmm_core.tracking import ProbeBody, TipSensitivity, load_probe, tip_sensitivity
from tests.core.inspection.conftest import Bench
from tests.core.tolerances.known_errors import RULE, known
from tests.core.tolerances.known_part import asked
from tests.host import amount

ASKED = [
    asked("flatness", "wavy"),
    asked("diameter", "oval", association="two-point maximum"),
    asked("diameter", "ball"),
    asked("distance", "pin,hole"),
    asked("distance", "ball,pin", axis="z"),
    asked("distance", "ball,between"),
    asked("perpendicularity", "wall", "top,left"),
    asked("position", "hole", "top,left,front"),
    asked("position", "ball", "top,pin"),
    asked("position", "leaning", ""),
    asked("coaxiality", "neck", "pin"),
    asked("surface profile", "wavy", "top"),
    asked("circular runout", "collar", "pin"),
]
STEPS, WALKS, WALK_STEPS = amount(7, 15), amount(2, 3), 20
VERBS = 7
"""Each is tried at least once."""


def plan_of(alignment: Alignment | None) -> Plan:
    """Return a plan of the part with exact errors, with values of many kinds."""
    items = [
        msgspec.structs.replace(item, name=f"{number} {item.kind}")
        for number, item in enumerate(ASKED)
        if alignment is not None or item.datums or not (item.axis or item.kind == "position")
    ]
    needed = {name for item in items for name in (*item.features, *item.datums)} - {"between"}
    needed |= {"oval", "lobed", *(alignment.features if alignment is not None else ())}
    return Plan(
        schema="ocmm.plan/1", unit="mm", name="known", part="known",
        features=[item for item in known().nominals if item.name in needed],
        characteristics=items, alignment=alignment,
        constructions=[Midpoint(name="between", features=("oval", "lobed"))],
    )  # fmt: skip


def seen_of(count: int, rig: Rig, body: ProbeBody) -> list[TipSensitivity]:
    """Return answers of tips in the middle of the volume."""
    rng = np.random.default_rng(11)
    found = []
    for _ in range(count):
        rotation = rotation_from_vector(rng.normal(0.0, 0.1, 3))
        leds = (body.leds_probe - body.tip_probe) @ rotation.T + rng.uniform(-30.0, 30.0, 3)
        spots = np.stack([project(camera, leds) for camera in rig.cameras])
        found.append(tip_sensitivity(spots, rig, body))
    return found


def same(one: JobResults, other: JobResults) -> None:
    """Check that nothing differs, to the last bit."""
    numbers = [
        {name: [point.number for point in own] for name, own in job.points.items()}
        for job in (one, other)
    ]
    assert numbers[0] == numbers[1]
    assert one.results == other.results
    assert list(one.actual) == list(other.actual)
    for name, feature in one.actual.items():
        again = other.actual[name]
        if isinstance(feature, ActualFeature):
            assert isinstance(again, ActualFeature)
            assert feature.fit.geometry.tobytes() == again.fit.geometry.tobytes()
            assert feature.numbers == again.numbers
        else:
            assert str(feature) == str(again)


@pytest.mark.parametrize(
    "alignment",
    [RULE, DatumReferenceFrame(datums=("top", "left", "front")), None],
    ids=["3-2-1", "datums", "none"],
)
def test_whatever_happens_to_points_it_is_the_evaluation_from_nothing(
    alignment: Alignment | None,
) -> None:
    rng = np.random.default_rng(11)
    rig = load_rig(resource("rigs", "recommended.toml"))
    body = load_probe(resource("probes", "standard.toml"))
    plan = plan_of(alignment)
    names = {item.name for item in plan.features}
    taken = [point for point in known().points if point.feature in names]
    taken = [
        replace(point, number=number, random_covariance=1e-6 * np.eye(3))
        for number, point in enumerate(taken, start=1)
    ]
    answers = seen_of(20, rig, body)
    job: list[tuple[MeasuredPoint, TipSensitivity]] = [
        (point, answers[point.number % 20]) for point in taken
    ]
    waiting = [job.pop(int(rng.integers(len(job)))) for _ in range(20)]
    options = SessionOptions()
    cache = EvaluationCache()
    count, values = 1000, 0
    for step in range(STEPS):
        which = int(rng.integers(len(job)))
        point, answer = job[which]
        count += 1
        verb = step if step < VERBS else int(rng.integers(VERBS))
        match verb:
            case 0:
                if waiting:
                    back, seen = waiting.pop()
                    job.append((replace(back, number=count), seen))
            case 1:
                waiting.append(job.pop(which))
            case 2:
                # Put in the place of another one, with a new number, somewhere else.
                moved = point.tip_world + rng.normal(0.0, 0.01, 3)
                job.pop(which)
                job.append((replace(point, number=count, tip_world=moved), answer))
            case 3:
                # The cameras' part of the uncertainty is computed again.
                job[which] = (point, answers[int(rng.integers(20))])
            case 4:
                # Far off: its feature is suspect and gives no number.
                job.pop(which)
                far = point.tip_world + 2.0 * point.direction
                job.append((replace(point, number=count, tip_world=far), answer))
                waiting.append((point, answer))
            case 5:
                options = replace(options, max_form=float(rng.uniform(0.03, 3.0)))
            case _:
                climate = Climate(part=PartTemperature(compensated=False))
                options = replace(options, climate=climate)
        done = frozenset(name for name in names if rng.random() < 0.9)
        points, seen_by = zip(*job, strict=True)
        kept = evaluate_job(plan, points, seen_by, rig, body, options, done, cache=cache)
        fresh = evaluate_job(plan, points, seen_by, rig, body, options, done)
        same(kept, fresh)
        values += sum(result.uncertainty is not None for result in kept.results)
    # Not everything is suspect all the time: numbers were compared.
    assert values > STEPS


@pytest.mark.parametrize("walk", range(WALKS))
def test_the_view_of_a_session_is_that_of_the_job_opened_anew(bench: Bench, walk: int) -> None:
    rng = np.random.default_rng(11)
    names = [feature.name for feature in bench.plan.features]
    places = {"BED": (0, 4), "BLOCK_TOP": (4, 8), "SPHERE": (8, 14)}
    with bench.job() as job:
        session = bench.session(job)
        if walk:
            session.steps.set_order("any")
        for touch in bench.touches:
            session.touches.record_touch(touch)
        for _ in range(WALK_STEPS):
            name = str(rng.choice(names))
            number = int(rng.integers(1, 20))
            verbs: list[Callable[[], object]] = [
                partial(_touch, session, bench, places[name], name, rng),
                partial(_touch, session, bench, places[name], name, rng),
                partial(session.steps.skip, name),
                partial(session.steps.reopen, name),
                partial(session.steps.repeat, name),
                session.steps.undo,
                session.steps.redo,
                session.refit,
                session.pausing.pause,
                session.pausing.resume,
                partial(session.points.flip, number),
                partial(session.points.delete_point, number, "a chip"),
                partial(session.points.restore_point, number),
                partial(session.held.hold_back_points, [number], "Why.", HoldReason.CAMERAS),
                partial(session.held.release, "All is well."),
            ]
            with contextlib.suppress(MeasuringError):
                verbs[int(rng.integers(len(verbs)))]()
            _alike(session.view, bench.session(job).view)


def _touch(
    session: InspectionSession,
    bench: Bench,
    places: tuple[int, int],
    name: str,
    rng: np.random.Generator,
) -> None:
    session.touches.record_touch(bench.touches[int(rng.integers(*places))], name)


def _alike(told: JobView, again: JobView) -> None:
    """Check two views; what cameras say of points is computed in other batches: rounding."""
    assert told.held == again.held
    assert told.paused == again.paused
    for one, other in zip(
        (*told.features, *told.constructed), (*again.features, *again.constructed), strict=True
    ):
        assert (one.name, one.state, one.note) == (other.name, other.state, other.note)
        assert one.outliers == other.outliers
        assert [point.number for point in one.points] == [point.number for point in other.points]
        assert [item.point.number for item in one.deleted] == [
            item.point.number for item in other.deleted
        ]
        assert (one.fit is None) == (other.fit is None)
        if one.fit is not None and other.fit is not None:
            assert one.fit.geometry == pytest.approx(other.fit.geometry, rel=1e-12, abs=1e-12)
        assert one.coverage == other.coverage
    for result, anew in zip(told.characteristics, again.characteristics, strict=True):
        assert (result.name, result.verdict, result.note) == (anew.name, anew.verdict, anew.note)
        assert (result.measured is None) == (anew.measured is None)
        assert (result.uncertainty is None) == (anew.uncertainty is None)
        if result.measured is not None and anew.measured is not None:
            assert result.measured == pytest.approx(anew.measured, rel=1e-12)
        if result.uncertainty is not None and anew.uncertainty is not None:
            assert result.uncertainty == pytest.approx(anew.uncertainty, rel=1e-9)


def test_what_is_kept_is_good_for_the_very_inputs_only() -> None:
    cache = EvaluationCache()
    made: list[str] = []

    def make(value: str) -> str:
        made.append(value)
        return value

    one, other = object(), object()
    for inputs, value in (((one,), "a"), ((one,), "b"), ((one, other), "c"), ((other,), "d")):
        cache.known("node", inputs, partial(make, value))
    assert made == ["a", "c", "d"]

    def read(watch: Mapping[str, object]) -> tuple[object, object]:
        made.append("read")
        return watch.get("x"), watch.get("z")

    # Reads by name count, including missing keys and lists of keys.
    source: dict[str, object] = {"x": one}
    for count, change in ((1, {}), (1, {"y": other}), (2, {"x": other}), (3, {"z": one})):
        source |= change
        cache.watched("read", (), source, read)
        assert made.count("read") == count
    for count, change in ((1, {}), (2, {"new": one})):
        source |= change
        cache.watched("all", (), source, lambda watch: made.append(f"all {len(list(watch))}"))
        assert sum(word.startswith("all") for word in made) == count


def test_only_what_grew_is_appended() -> None:
    cache = EvaluationCache()
    made: list[int] = []

    def kept(own: tuple[str, ...], plan: object) -> tuple[str, ...]:
        def make(first: int) -> tuple[str, ...]:
            made.append(first)
            return own[first:]

        return cache.appended("points", (plan,), (own,), make, add)

    plan = object()
    for own in (("a",), ("a", "b"), ("b", "a", "c"), ("b", "a"), ("b", "a", "d", "e")):
        assert kept(own, plan) == own
    assert made == [0, 1, 0, 0, 2]
    assert kept(("b", "a", "d", "e", "f"), object()) == ("b", "a", "d", "e", "f")
    assert made[-1] == 0
