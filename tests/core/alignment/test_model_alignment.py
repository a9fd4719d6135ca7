"""Best fit to faces of the model as an alignment of a plan: frame, uncertainty, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.alignment import (
    BoundAlignment,
    ModelBestFit,
    alignment_fault,
    frame_jacobian,
    frame_of,
    part_frame,
    preview_alignment,
)
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape, nominal_geometry
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.measuring import MeasuredPoint, factors_of_matrix
from ocmm_core.part_model import ModelFace, nominal_face, searched, spread_places
from tests.core.features.exact_touches import touches
from tests.core.part_model.model_faces import FREE_FORMS, face_of, plane

BALL = 3.0
PLACE = RigidTransform(rotation_from_vector(np.array([0.7, -0.4, 1.1])), np.array([200, -50, 800]))
WAVES = face_of(FREE_FORMS["waves"]())


def touched(
    faces: list[ModelFace], beside: float = 0.0, noise: float = 0.0
) -> tuple[BoundAlignment, dict[str, ActualFeature], list[MeasuredPoint]]:
    """Return a best fit to faces, and its points touched ``beside`` mm off, at a slant."""
    rng = np.random.default_rng(5)
    held = tuple(nominal_face(face) for face in faces)
    nominals: list[NominalFeature] = []
    points: list[MeasuredPoint] = []
    for face in held:
        places, normals = spread_places(searched(face), 20, 6.0, BALL)
        more, more_normals = spread_places(searched(face), 60, 6.0, BALL)
        for place, normal in zip(places, normals, strict=True):
            name = f"P{len(nominals) + 1}"
            x, y, z = place.tolist()
            a, b, c = normal.tolist()
            nominals.append(
                NominalFeature(
                    name=name, shape=Shape.POINT, points=1, point=(x, y, z), direction=(a, b, c)
                )
            )
            there, normal_there = place, normal
            if beside:
                # A nearby place of the face: the target itself is never hit exactly.
                away = np.linalg.norm(more - place, axis=1)
                near = int(np.argsort(away)[1])
                assert away[near] > beside
                there, normal_there = more[near], more_normals[near]
            (one,) = touches(
                name, PLACE.apply(there)[None], (PLACE.rotation @ normal_there)[None],
                len(points) + 1, BALL,
            )  # fmt: skip
            slanted = one.direction + 0.2 * rng.normal(size=3)
            points.append(
                replace(
                    one, direction=slanted / np.linalg.norm(slanted),
                    tip_world=one.tip_world + noise * rng.normal(size=3),
                )
            )  # fmt: skip
    rule = ModelBestFit(points=tuple(item.name for item in nominals), faces=held)
    shapes = {item.name: item.shape for item in nominals}
    assert alignment_fault(rule, shapes) is None
    bound = BoundAlignment(rule, shapes, {item.name: nominal_geometry(item) for item in nominals})
    found = actual_features(nominals, points)
    good = {name: item for name, item in found.items() if isinstance(item, ActualFeature)}
    assert len(good) == len(nominals)
    return bound, good, points


@pytest.mark.parametrize("beside", [0.0, 1.0])
def test_the_part_is_found_though_nobody_hits_the_places_and_comes_slanted(beside: float) -> None:
    bound, actual, _ = touched([WAVES], beside)
    off = part_frame(bound, actual).compose(PLACE)
    assert off.rotation == pytest.approx(np.eye(3), abs=1e-7)
    assert off.translation == pytest.approx(np.zeros(3), abs=1e-5)


def test_points_alone_would_be_off_by_what_the_approach_was_slanted() -> None:
    bound, actual, _ = touched([WAVES])
    by_points = frame_of(bound, {name: item.fit.geometry for name, item in actual.items()})
    off = by_points.compose(PLACE)
    assert np.abs(off.translation).max() > 1e-3


def test_its_jacobian_is_that_of_the_frame_by_every_touch_and_the_ball() -> None:
    bound, actual, points = touched([WAVES], noise=0.0)
    frame = part_frame(bound, actual)
    rows = frame_jacobian(bound, actual, frame).dense(len(points))
    nominals = [item.nominal for item in actual.values()]
    rng = np.random.default_rng(8)
    step = 1e-4

    def moved(by: Float) -> Float:
        again = [
            replace(
                one, tip_world=one.tip_world + by[3 * i : 3 * i + 3],
                tip_radius=one.tip_radius + by[-1],
            )
            for i, one in enumerate(points)
        ]  # fmt: skip
        found = actual_features(nominals, again)
        good = {name: item for name, item in found.items() if isinstance(item, ActualFeature)}
        change = part_frame(bound, good).compose(frame.inverse())
        skewed = 0.5 * (change.rotation - change.rotation.T)
        return np.array([skewed[2, 1], skewed[0, 2], skewed[1, 0], *change.translation])

    for by in (rng.normal(size=3 * len(points) + 1), np.eye(3 * len(points) + 1)[-1]):
        slope = (moved(step * by) - moved(-step * by)) / (2.0 * step)
        assert rows @ by == pytest.approx(slope, rel=1e-4, abs=1e-7)


def test_its_uncertainty_holds_the_frame() -> None:
    """Of 60 fits with noise U (k = 2) of the six motions holds the truth in 95 % of 360.

    Limits: four standard deviations of a binomial share that is 95.4 %, motions taken as one third
    independent.
    """
    bound, actual, points = touched([WAVES])
    sigma = 0.006
    factors = factors_of_matrix(np.diag(np.append(np.full(3 * len(points), sigma**2), 1e-12)))
    report = preview_alignment(bound, actual, factors)
    assert report.origin_uncertainty is not None
    assert report.turn_uncertainty is not None
    limits = np.concatenate([report.turn_uncertainty, report.origin_uncertainty])
    rng = np.random.default_rng(11)
    nominals = [item.nominal for item in actual.values()]
    held = 0
    for _ in range(60):
        noisy = [
            replace(one, tip_world=one.tip_world + sigma * rng.normal(size=3)) for one in points
        ]
        found = actual_features(nominals, noisy)
        good = {name: item for name, item in found.items() if isinstance(item, ActualFeature)}
        change = part_frame(bound, good).compose(PLACE)
        skewed = 0.5 * (change.rotation - change.rotation.T)
        off = np.array([skewed[2, 1], skewed[0, 2], skewed[1, 0], *change.translation])
        held += int((np.abs(off) <= limits).sum())
    assert 0.89 < held / 360 <= 1.0


def test_the_report_says_how_far_touches_lie_off_the_faces_not_beside_their_places() -> None:
    bound, actual, _ = touched([WAVES], beside=1.0)
    report = preview_alignment(bound, actual)
    assert report.can_be_accepted
    assert report.frame == "part frame, best fit of 20 points to 1 face"
    assert max(item.distance for item in report.residuals) < 1e-6
    assert all(item.aligned for item in report.residuals)


def test_faces_that_leave_a_motion_open_give_no_frame_and_name_it() -> None:
    bound, actual, _ = touched([face_of(plane(60.0, 50.0))])
    with pytest.raises(FitError, match="leave open: rz, x, y"):
        part_frame(bound, actual)
    report = preview_alignment(bound, actual)
    assert not report.can_be_accepted
    assert "points on faces that hold them" in report.advice[0]


def test_a_touch_of_another_surface_is_named() -> None:
    bound, actual, points = touched([WAVES])
    wrong = replace(points[6], tip_world=points[6].tip_world + 30.0 * points[6].direction)
    found = actual_features([item.nominal for item in actual.values()], [*points[:6], wrong])
    actual = {**actual, "P7": found["P7"]}  # type: ignore[dict-item]  # a feature
    with pytest.raises(FitError, match=r"P7 is [+-]\d+\.\d mm off its faces"):
        part_frame(bound, actual)


def test_a_rule_that_cannot_be_is_refused_by_its_field() -> None:
    bound, _, _ = touched([WAVES])
    rule = bound.rule
    assert isinstance(rule, ModelBestFit)
    few = ModelBestFit(points=rule.points[:6], faces=rule.faces)
    assert alignment_fault(few, bound.shapes) == (
        "alignment.points", "names 6, but at least 7 are needed",
    )  # fmt: skip
    fault = alignment_fault(ModelBestFit(points=rule.points, faces=()), bound.shapes)
    assert fault is not None
    assert fault[0] == "alignment.faces"
    other = {**bound.shapes, "P3": Shape.PLANE}
    fault = alignment_fault(rule, other)
    assert fault is not None
    assert "P3" in fault[1]
