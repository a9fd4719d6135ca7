"""The part frame from exactly touched datum features."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.alignment import DatumAlignment, part_frame
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import MeasuredPoint
from tests.core.features.exact_touches import flat_touches, nominal, round_touches
from tests.core.features.shape_samples import somewhere

pytestmark = pytest.mark.numerics

RULE = DatumAlignment(primary="top", secondary=("a", "b"), origin="a")


def _at(T_world_from_part: RigidTransform, place: tuple[float, float, float]) -> RigidTransform:
    return T_world_from_part.compose(RigidTransform(np.eye(3), np.array(place)))


def _measured(
    T_world_from_part: RigidTransform,
    a: tuple[float, float, float] = (0.0, 0.0, -3.0),
    b: tuple[float, float, float] = (80.0, 0.0, 5.0),
) -> dict[str, ActualFeature]:
    points: list[MeasuredPoint] = []
    features: list[NominalFeature] = [nominal("top", Shape.PLANE)]
    points += flat_touches("top", _at(T_world_from_part, (20.0, 15.0, 0.0)))
    for name, place in (("a", a), ("b", b)):
        features.append(nominal(name, Shape.SPHERE, 10.0))
        points += round_touches(name, Shape.SPHERE, 10.0, "outer", _at(T_world_from_part, place))
    found = actual_features(features, points)
    return {name: item for name, item in found.items() if isinstance(item, ActualFeature)}


def _difference(first: RigidTransform, second: RigidTransform) -> Float:
    return np.append(first.rotation - second.rotation, first.translation - second.translation)


@pytest.mark.parametrize("seed", range(5))
def test_the_frame_in_which_the_part_was_made_is_found(seed: int) -> None:
    T_world_from_part = somewhere(np.random.default_rng(seed))
    T_part_from_world = part_frame(RULE, _measured(T_world_from_part))
    # Centres at different heights: origin and x are dropped onto the plane.
    assert np.abs(_difference(T_part_from_world, T_world_from_part.inverse())).max() < 1e-9
    assert np.linalg.det(T_part_from_world.rotation) == pytest.approx(1.0, abs=1e-12)


def test_a_missing_datum_is_named() -> None:
    features = _measured(RigidTransform.identity())
    del features["b"]
    with pytest.raises(FitError, match="needs b, which is not measured"):
        part_frame(RULE, features)


def test_centres_above_each_other_give_no_direction() -> None:
    features = _measured(RigidTransform.identity(), b=(0.0, 0.0, 40.0))
    with pytest.raises(FitError, match="a and b give no direction along the plane top"):
        part_frame(RULE, features)


def test_every_datum_is_named_once() -> None:
    assert RULE.features == ("top", "a", "b")
