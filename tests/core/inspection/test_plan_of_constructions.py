"""A plan with constructions and any alignment: from its document to values and their slopes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import RigidTransform
from ocmm_core.inspection.evaluation import SessionOptions, checked_features, frame_of
from ocmm_core.inspection.evaluation._evaluation import alignment_of
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.zones import Evaluation
from tests.core.features.exact_touches import flat_touches, nudged, round_touches
from tests.core.features.shape_samples import somewhere

HEAD = """
schema = "ocmm.plan/1"
unit = "mm"
name = "PLAN"
part = "PART"
"""
BODY = """
[[features]]
name = "TOP"
shape = "Plane"
points = 9
point = [40.0, 20.0, 0.0]

[[features]]
name = "A"
shape = "Circle"
points = 12
point = [0.0, 0.0, 0.0]
diameter = 12.0
side = "inner"
projection = "TOP"

[[features]]
name = "B"
shape = "Sphere"
points = 12
point = [80.0, 0.0, 6.0]
diameter = 20.0

[[features]]
name = "C"
shape = "Sphere"
points = 12
point = [20.0, 60.0, 10.0]
diameter = 14.0

[[constructions]]
name = "TARGET"
kind = "midpoint"
features = ["HOLE", "C"]

[[constructions]]
name = "HOLE"
kind = "projection"
features = ["A", "TOP"]

[[characteristics]]
name = "target y"
kind = "coordinate"
features = ["TARGET"]
axis = "y"
nominal = 30.0
lower = -0.1
upper = 0.1

[[characteristics]]
name = "target to ball"
kind = "distance"
features = ["TARGET", "B"]
nominal = 76.2
lower = -0.1
upper = 0.1
"""
ALIGNMENTS = {
    "old": """
[alignment]
primary = "TOP"
secondary = ["HOLE", "B"]
origin = "HOLE"
""",
    "best fit": """
[alignment]
type = "best fit"
points = ["HOLE", "B", "C"]
weights = [1.0, 2.0, 1.0]
""",
    "locked": """
[alignment]
type = "best fit"
points = ["HOLE", "B", "C"]
locked = ["rx", "ry", "z"]

[alignment.start]
type = "datum reference frame"
datums = ["TOP", "A", "B"]
""",
    "datums": """
[alignment]
type = "datum reference frame"
datums = ["TOP", "HOLE", "B"]
""",
}


def _plan(folder: Path, alignment: str, body: str = BODY) -> Plan:
    path = folder / "plan.toml"
    path.write_text(HEAD + alignment + body)
    return load_plan(path)


def _points(T_world_from_part: RigidTransform) -> list[MeasuredPoint]:
    def at(*place: float) -> RigidTransform:
        return T_world_from_part.compose(RigidTransform(np.eye(3), np.array(place)))

    return [
        *flat_touches("TOP", at(40.0, 20.0, 0.0)),
        *round_touches("A", Shape.CIRCLE, 12.0, "inner", at(0.0, 0.0, -3.0), first=10),
        *round_touches("B", Shape.SPHERE, 20.0, "outer", at(80.0, 0.0, 6.0), first=22),
        *round_touches("C", Shape.SPHERE, 14.0, "outer", at(20.0, 60.0, 10.0), first=34),
    ]


def _value(plan: Plan, index: int, points: list[MeasuredPoint]) -> Evaluation:
    actual = checked_features(plan, points, SessionOptions())
    known = {name: item for name, item in actual.items() if isinstance(item, ActualFeature)}
    return evaluate(plan.characteristics[index], known, alignment_of(plan, actual))


@pytest.mark.parametrize("kind", list(ALIGNMENTS))
def test_values_of_constructed_features_and_their_slopes(tmp_path: Path, kind: str) -> None:
    plan = _plan(tmp_path, ALIGNMENTS[kind])
    T_world_from_part = somewhere(np.random.default_rng(4))
    points = _points(T_world_from_part)
    T_part_from_world = frame_of(plan, checked_features(plan, points, SessionOptions()))
    assert T_part_from_world is not None
    assert np.abs(T_part_from_world.compose(T_world_from_part).rotation - np.eye(3)).max() < 1e-9
    for index, expected in ((0, 30.0), (1, np.linalg.norm([70.0, -30.0, 1.0]))):
        found = _value(plan, index, points)
        assert found.value == pytest.approx(expected, abs=1e-8)
        gradient = found.gradient.dense(len(points))
        # A coordinate of every feature at least, and the ball.
        for coordinate in (*range(0, 3 * len(points), 29), 3 * len(points)):
            ends = [_value(plan, index, nudged(points, coordinate, by)) for by in (1e-3, -1e-3)]
            slope = (ends[0].value - ends[1].value) / 2e-3
            assert slope == pytest.approx(gradient[coordinate], abs=2e-6)


def test_a_result_rests_on_all_that_was_probed_for_it(tmp_path: Path) -> None:
    plan = _plan(tmp_path, ALIGNMENTS["old"])
    assert set(plan.rests_on(plan.characteristics[0])) == {"TOP", "A", "B", "C"}
    points = [p for p in _points(RigidTransform.identity()) if p.feature != "C"]
    target = checked_features(plan, points, SessionOptions())["TARGET"]
    assert isinstance(target, FitError)
    assert "TARGET needs C." in target.what


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "midpoint"', 'kind = "middle"', "constructions[0]"),
        ('features = ["HOLE", "C"]', 'features = ["HOLE", "D"]', "names 'D', which is not"),
        ('features = ["A", "TOP"]', 'features = ["A", "TARGET"]', "in a loop"),
        ('name = "HOLE"', 'name = "A"', "repeats the name 'A'"),
        ('name = "HOLE"', 'name = "=A"', "constructions[1].name"),
        (
            'kind = "projection"\nfeatures = ["A", "TOP"]',
            'kind = "offset"\ndistance = 1.0\nfeatures = ["TOP"]',
            "names a plane, but needs",
        ),
        ('features = ["TARGET", "B"]', 'features = ["AIM", "B"]', "'AIM'"),
        ('type = "best fit"', 'type = "best"', "alignment"),
        ('points = ["HOLE", "B", "C"]', 'points = ["HOLE", "B", "TOP"]', "alignment.points"),
    ],
)
def test_what_a_plan_cannot_say(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = ALIGNMENTS["best fit"] + BODY
    assert old in text
    with pytest.raises(InputError) as caught:
        _plan(tmp_path, "", text.replace(old, new, 1))
    assert words in caught.value.what
