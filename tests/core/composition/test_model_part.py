"""The virtual part of a plan: as its nominals say, touched at the places that the plan names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.composition import RECOMMENDED_RIG
from ocmm_core.errors import InputError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import RADIUS, SECOND, NominalFeature, Shape
from ocmm_core.geometry import perpendicular_pair
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import Placement
from ocmm_core.tolerances.zones import Characteristic
from ocmm_sim.scene import Part, RigScript, TouchedEntry, load_part, sample
from ocmm_sim.sources import part_as_planned, part_text, true_values
from tests.core.features.exact_touches import touches

BALL = 3.0
AXIS = (0.6, 0.0, 0.8)


def around(radius: float, slope: float = 0.0) -> tuple[tuple[float, float, float], ...]:
    """Return places around `AXIS` through 10, 20, 30 on three heights."""
    first, second = perpendicular_pair(np.array(AXIS))
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False) * 5.0
    found = []
    for place, turn in enumerate(turns.tolist()):
        height = 6.0 * (place % 3 - 1)
        arm = np.cos(turn) * first + np.sin(turn) * second
        middle = np.array([10.0, 20.0, 30.0]) + height * np.array(AXIS)
        found.append((middle + (radius + slope * height) * arm).tolist())
    return tuple((x, y, z) for x, y, z in found)


FEATURES = (
    NominalFeature(
        name="TOP", shape=Shape.PLANE, points=4, point=(0.0, 0.0, 5.0), length=40.0, width=20.0,
        targets=((-15.0, -8.0, 5.0), (15.0, -8.0, 5.0), (15.0, 8.0, 5.0), (-14.0, 7.0, 5.0)),
    ),
    NominalFeature(
        name="BORE", shape=Shape.CYLINDER, points=8, point=(10.0, 20.0, 30.0), direction=AXIS,
        diameter=24.0, length=14.0, side="inner", targets=around(12.0),
    ),
    NominalFeature(
        name="TAPER", shape=Shape.CONE, points=9, point=(10.0, 20.0, 30.0), direction=AXIS,
        diameter=24.0, length=14.0, angle_deg=30.0, side="inner",
        targets=around(12.0, float(np.tan(np.radians(15.0)))),
    ),
    # Without targets: spread over its sizes.
    NominalFeature(
        name="BALL", shape=Shape.SPHERE, points=9, point=(-30.0, 10.0, 40.0), diameter=20.0,
    ),
    NominalFeature(
        name="RING", shape=Shape.TORUS, points=12, point=(60.0, 0.0, 0.0), diameter=50.0,
        width=10.0,
    ),
)  # fmt: skip
PLAN = Plan(
    schema="ocmm.plan/1",
    unit="mm",
    name="P",
    part="P",
    features=list(FEATURES),
    characteristics=[
        Characteristic(
            name="D", kind="diameter", features=["BORE"], nominal=24.0, upper=0.1, lower=-0.1
        ),
        Characteristic(name="F", kind="form", features=["TOP"], upper=0.1),
    ],
)


@pytest.fixture
def part(tmp_path: Path) -> Part:
    path = tmp_path / "part.toml"
    path.write_text(part_text(part_as_planned(PLAN, None, load_rig(RECOMMENDED_RIG))), "utf-8")
    return load_part(path)


def test_touches_without_any_error_give_the_nominals_back(part: Part) -> None:
    rng = np.random.default_rng(1)
    points: list[MeasuredPoint] = []
    for feature in PLAN.features:
        contacts = sample(part.artefact(feature.name), feature.points, rng)
        assert len(contacts.points) == feature.points
        points += touches(
            feature.name, contacts.points, contacts.normals, len(points) + 1, BALL
        )  # fmt: skip
    found = actual_features(PLAN.features, points)
    for nominal in PLAN.features:
        actual = found[nominal.name]
        assert isinstance(actual, ActualFeature), actual
        # Nine digits of the document.
        assert actual.fit.form < 1e-7, nominal.name
        if nominal.shape is Shape.CONE:
            assert np.degrees(2.0 * actual.fit.half_angle) == pytest.approx(30.0, abs=1e-6)
        elif nominal.diameter:
            assert 2.0 * actual.fit.geometry[RADIUS] == pytest.approx(nominal.diameter, abs=1e-6)
        if nominal.shape is Shape.TORUS:
            assert 2.0 * actual.fit.geometry[SECOND] == pytest.approx(nominal.width, abs=1e-6)
    assert true_values(PLAN, part) == pytest.approx({"D": 24.0, "F": 0.0}, abs=1e-6)


def test_it_is_touched_where_the_plan_says_in_that_order(part: Part) -> None:
    contacts = sample(part.artefact("BORE"), 5, np.random.default_rng(2))
    np.testing.assert_allclose(contacts.points, FEATURES[1].targets[:5], atol=1e-8)
    # From the wall to the axis.
    inward = np.array([10.0, 20.0, 30.0]) - contacts.points
    assert (np.einsum("ij,ij->i", inward, contacts.normals) > 0.0).all()


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
def test_it_stands_in_the_middle_of_the_volume(up: tuple[float, float, float]) -> None:
    rig = load_rig(RECOMMENDED_RIG)
    made = part_as_planned(PLAN, None, rig, Placement(up))
    pose = made.pose.motion()
    np.testing.assert_allclose(pose.rotation @ np.array(up), [0.0, 0.0, 1.0], atol=1e-8)
    entries = [entry for entry in made.features if isinstance(entry, TouchedEntry)]
    places = np.array([place for entry in entries for place in entry.places])
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    np.testing.assert_allclose(
        pose.apply(middle), np.asarray(rig.volume_world).mean(axis=0), atol=1e-6
    )


def test_the_virtual_rig_touches_all_of_it(part: Part, tmp_path: Path) -> None:
    path = tmp_path / "part.toml"
    script = RigScript(
        rig=str(RECOMMENDED_RIG),
        probe=str(RECOMMENDED_RIG.parents[1] / "probes" / "standard.toml"),
        part=str(path),
        touches=tuple((feature.name, feature.points) for feature in PLAN.features),
        seed=3,
    )
    rig = script.build()
    done = rig.truth.touches
    wanted = [name for name, count in script.touches for _ in range(count)]
    assert [touch.feature for touch in done] == wanted
    gaps = [np.linalg.norm(touch.tip_world - touch.surface_world) for touch in done]
    np.testing.assert_allclose(gaps, rig.truth.tip_radius, atol=1e-9)


def test_what_does_not_say_where_it_can_be_touched_is_refused_by_name() -> None:
    edge = NominalFeature(name="EDGE", shape=Shape.LINE, points=3, point=(0.0, 0.0, 0.0))
    plan = Plan(
        schema="ocmm.plan/1", unit="mm", name="P", part="P", features=[edge], characteristics=[]
    )
    with pytest.raises(InputError, match="'EDGE' does not say where") as caught:
        part_as_planned(plan, None, load_rig(RECOMMENDED_RIG))
    assert "the document of a part" in caught.value.remedy


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("free = 24.0", "free = 0.0", "'features[1].free' is 0.0"),
        ("places = [[-15.0, -8.0, 5.0], ", "places = [", "has 3 places, and 'normals' has 4"),
        ("normals = [[0.0, 0.0, 1.0], ", "normals = [[0.0, 0.0, 0.0], ", "holds a zero vector"),
    ],
)
def test_a_document_that_cannot_be_is_refused(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = part_text(part_as_planned(PLAN, None, load_rig(RECOMMENDED_RIG)))
    assert old in text
    path = tmp_path / "part.toml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    with pytest.raises(InputError) as caught:
        load_part(path)
    assert words in str(caught.value)
