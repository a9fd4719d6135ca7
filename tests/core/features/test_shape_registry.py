"""Every shape has an entry in each registry, consistent with the results of its fit."""

from __future__ import annotations

from dataclasses import MISSING, fields

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.elements import ELEMENTS, ElementSpec, fit_oriented, nominal_distances
from ocmm_core.features.measured import beyond_first_order, fit_shape
from ocmm_core.features.measured._second_order import _fitted_again
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    RADIUS,
    SECOND,
    Criterion,
    Fit,
    NominalFeature,
    Shape,
    ShapeSpec,
    nominal_geometry,
    shape_fault,
    shapes_where,
)
from ocmm_core.features.shapes._specs import SPECS
from ocmm_core.features.zones import ZONES
from ocmm_core.features.zones._elements import BOUNDED
from tests.core.features.shape_samples import ideal_points, somewhere

EACH = pytest.mark.parametrize("shape", [*Shape])
TURNED = [shape for shape in Shape if shape.spec.has_direction and shape is not Shape.LINE]
FOLLOWED = [
    shape for shape in Shape if ELEMENTS[shape].kernel is not None and not shape.spec.is_flat
]


def fit_of(shape: Shape) -> Fit:
    """Return the fit of exact points of a shape somewhere in space."""
    rng = np.random.default_rng(7)
    points = somewhere(rng).apply(ideal_points(shape, rng, shape.spec.recommended_points))
    return fit_shape(shape, points, direction_hint=np.array([0.3, 0.5, 0.8]))


@EACH
def test_a_shape_has_an_entry_in_both_registries(shape: Shape) -> None:
    assert isinstance(SPECS.get(shape.value), ShapeSpec)
    assert isinstance(ELEMENTS.get(shape), ElementSpec)


@EACH
def test_no_entry_leaves_a_field_to_a_default(shape: Shape) -> None:
    for entry in (shape.spec, ELEMENTS[shape]):
        for field in fields(entry):
            assert field.default is MISSING, field.name
            assert field.default_factory is MISSING, field.name


@EACH
def test_the_words_are_there(shape: Shape) -> None:
    spec = shape.spec
    assert spec.point_word
    assert spec.form_kind
    assert spec.qif.feature
    assert spec.sizes_text.format(1.0, 2.0, 3.0)
    assert (spec.direction_word != "") == spec.has_direction


@EACH
def test_the_numbers_of_points_rise(shape: Shape) -> None:
    spec = shape.spec
    assert 1 <= spec.minimum_points <= spec.recommended_points
    assert spec.minimum_points <= spec.usual_points


@EACH
def test_a_fit_has_what_its_entry_says_and_nothing_else(shape: Shape) -> None:
    spec, fit = shape.spec, fit_of(shape)
    assert bool(fit.geometry[DIRECTION].any()) == spec.has_direction
    assert bool(fit.geometry[ACROSS].any()) == spec.has_across
    held = {size.place for size in spec.sizes}
    assert {place for place in (RADIUS, SECOND, HALF_ANGLE) if fit.geometry[place] != 0.0} == held
    assert len(spec.sizes) == len(held)


@EACH
def test_a_size_is_a_property_of_a_fit_by_its_word(shape: Shape) -> None:
    fit = fit_of(shape)
    for size in shape.spec.sizes:
        own = getattr(fit, size.word.replace(" ", "_"))
        assert size.whole(fit.geometry) == pytest.approx(np.degrees(own) if size.is_angle else own)


def nominal_of(shape: Shape, fit: Fit) -> NominalFeature:
    """Return a plan's feature that is as it was measured."""
    sizes = {size.field: size.whole(fit.geometry) for size in shape.spec.sizes}
    return NominalFeature(
        name="A",
        shape=shape,
        points=shape.spec.usual_points,
        point=tuple(fit.point.tolist()),
        direction=tuple(fit.direction.tolist()) if shape.spec.has_direction else (0.0, 0.0, 1.0),
        across=tuple(fit.across.tolist()) if shape.spec.has_across else (1.0, 0.0, 0.0),
        diameter=sizes.get("diameter", 0.0),
        length=sizes.get("length", 0.0),
        width=sizes.get("width", 0.0),
        angle_deg=sizes.get("angle_deg", 0.0),
    )


@EACH
def test_a_plan_can_hold_it_and_gives_its_geometry_back(shape: Shape) -> None:
    fit = fit_of(shape)
    nominal = nominal_of(shape, fit)
    assert shape_fault(nominal) is None
    assert nominal_geometry(nominal) == pytest.approx(fit.geometry, abs=1e-9)


@EACH
def test_a_plan_without_one_of_its_sizes_is_refused(shape: Shape) -> None:
    fit = fit_of(shape)
    for missing in shape.spec.sizes:
        geometry = fit.geometry.copy()
        geometry[missing.place] = 0.0
        without = nominal_of(shape, Fit(shape, geometry, fit.jacobian, fit.residuals, 0.0, 0.0))
        assert shape_fault(without) is not None, missing.field


@EACH
def test_the_points_of_an_element_are_no_distance_from_it(shape: Shape) -> None:
    rng = np.random.default_rng(3)
    points = ideal_points(shape, rng, 20)
    geometry = fit_shape(shape, points).geometry
    if not shape.spec.has_normals:
        # A point and a line are taken as planes; the plan or the approach names their face.
        geometry[DIRECTION] = (1.0, 0.0, 0.0)
    distances, normals = nominal_distances(shape, geometry, points)
    assert np.abs(distances).max() < 1e-9
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    beyond, _ = nominal_distances(shape, geometry, points + 1e-3 * normals)
    assert beyond == pytest.approx(1e-3, abs=1e-9)


@EACH
def test_its_criteria_are_those_that_there_are_zones_for(shape: Shape) -> None:
    criteria = shape.spec.criteria
    assert Criterion.LEAST_SQUARES in criteria
    assert (Criterion.MINIMUM_ZONE in criteria) == (shape in ZONES)
    for criterion in (Criterion.INSCRIBED, Criterion.CIRCUMSCRIBED):
        assert (criterion in criteria) == ((shape, criterion) in BOUNDED)


@EACH
def test_traits_hold_together(shape: Shape) -> None:
    spec, computed = shape.spec, ELEMENTS[shape]
    assert (computed.projected is not None) == spec.is_flat
    assert spec.is_flat or not (spec.has_across or spec.may_be_free or spec.has_sides)
    assert spec.has_direction or spec.located == "everywhere"
    assert spec.has_direction or not (computed.may_be_turned or spec.has_sense)
    assert spec.is_curved == (spec.ball in ("sizes", "slanted", "kept"))
    assert spec.is_curved or not spec.sizes
    assert spec.ball != "sizes" or any(size.grows for size in spec.sizes)
    assert shape in shapes_where(lambda entry: entry is spec)


@pytest.mark.parametrize("shape", TURNED)
def test_a_direction_is_given_only_to_what_can_be_found_with_it(shape: Shape) -> None:
    rng = np.random.default_rng(5)
    points = ideal_points(shape, rng, 20) + rng.normal(0.0, 0.01, (20, 3))
    up = np.array([0.0, 0.0, 1.0])
    criterion = (
        Criterion.MINIMUM_ZONE
        if Criterion.MINIMUM_ZONE in shape.spec.criteria
        else Criterion.LEAST_SQUARES
    )
    start = fit_shape(shape, points, direction_hint=up, criterion=criterion)
    if ELEMENTS[shape].may_be_turned:
        fit, _ = fit_oriented(start, points, up, None)
        assert fit.direction @ up == pytest.approx(1.0)
    else:
        with pytest.raises(FitError, match="with a direction given by datums"):
            fit_oriented(start, points, up, None)


@pytest.mark.parametrize("shape", FOLLOWED)
def test_fits_that_are_followed_and_fits_made_again_move_alike(shape: Shape) -> None:
    rng = np.random.default_rng(11)
    points = ideal_points(shape, rng, 20) + rng.normal(0.0, 0.005, (20, 3))
    fit = fit_shape(shape, points)
    moves = rng.normal(0.0, 0.2, (4, 20, 3))
    followed = beyond_first_order(fit, points, moves)
    assert np.abs(followed).max() > 1e-4
    # What differs is of the third order in moves of 0.2 mm and in residuals of 0.005 mm.
    assert _fitted_again(fit, points, moves, 0.0) == pytest.approx(followed, abs=1e-7)
