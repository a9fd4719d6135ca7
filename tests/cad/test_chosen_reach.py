"""Reach is checked for the chosen faces of a large model: unreachable targets enter no plan.

Needs the extra ``step``. The models are small but declared as large: only the ball was checked when
they were read.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ocmm_cad.reach import Setting
from ocmm_cad.step import (
    Offer,
    StepModel,
    ask_for_chosen,
    offers_of,
    read_model,
    setting_of,
    usual_request,
)
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import Shape
from ocmm_core.part_model import Placement
from tests.cad.step_models import _rod as rod
from tests.cad.step_models import _without as without
from tests.cad.step_models import bent_pocket, block, hill, written
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")


@cache
def _setting() -> Setting:
    setting = setting_of(usual_request())
    assert setting is not None
    return setting


def _unasked(path: Path) -> StepModel:
    """Return a model as a large one is read: checked for the ball alone."""
    model = read_model(path, 2.0 * _setting().ball_radius, with_part=True)
    return replace(model, unasked=_setting())


def _names(offers: tuple[Offer, ...]) -> set[str]:
    return {one.feature.name for one in offers}


def test_what_the_import_of_a_small_model_leaves_out_is_refused_when_it_is_chosen(
    tmp_path: Path,
) -> None:
    needs_package("OCP", "the extra 'step'")
    tall = without(block(height=150.0), rod((20, 20, -1), (0, 0, 1), 6, 200))
    path = written(tmp_path / "tall.step", tall)
    model = _unasked(path)
    taken = tuple(one for one in offers_of(model) if one.feature.targets)
    told: list[str] = []
    found = ask_for_chosen(model, taken, progress=told.append)
    asked = read_model(path, request=usual_request())
    refused = {one.faces for one in found.refused}
    # It tries fewer places, so it refuses those and may refuse more.
    assert {one.faces for one in asked.left_out if "no room" not in one.why} <= refused
    below = [one for one in found.refused if one.feature.direction[2] < -0.9]
    assert below
    assert all(one.why and not one.feature.targets for one in below)
    assert any(one.feature.direction[2] > 0.9 for one in found.taken)
    assert _names(found.taken) | {one.feature.name for one in found.refused} == _names(taken)
    offered = {one.feature.name: set(one.feature.targets) for one in taken}
    for one in found.taken:
        assert len(one.feature.targets) >= one.feature.points
        assert set(one.feature.targets) <= offered[one.feature.name]
    (said,) = found.sentences()
    assert below[0].feature.name in said
    assert told[-1] == f"reach of surface {len(taken)} of {len(taken)}"
    assert found.unasked == ()
    # The other way up the same face is touched.
    over = replace(_setting(), placement=Placement((0.0, 0.0, -1.0)))
    turned = ask_for_chosen(replace(model, unasked=over), taken)
    assert below[0].feature.name in _names(turned.taken)


def test_a_free_form_keeps_the_places_that_are_within_reach(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = _unasked(written(tmp_path / "hill.step", hill()))
    forms = tuple(one for one in offers_of(model) if one.free_form is not None)
    assert forms
    found = ask_for_chosen(model, forms)
    for one in found.taken:
        assert one.free_form is not None
        assert len(one.free_form.targets) == len(one.free_form.normals) >= 10
        assert len(one.free_form.held) == len(one.free_form.ways) == len(one.free_form.targets)
        assert one.feature.targets == one.free_form.targets
    over = replace(_setting(), placement=Placement((0.0, 0.0, -1.0)))
    with pytest.raises(InputError, match="None of the 1 chosen surfaces can be measured"):
        ask_for_chosen(replace(model, unasked=over), found.taken[:1])


def test_what_cannot_be_asked_is_named(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = _unasked(written(tmp_path / "pocket.step", bent_pocket()))
    assert model.part is not None
    taken = tuple(one for one in offers_of(model) if one.feature.targets)
    coarse = replace(model, part=replace(model.part, deflection_mm=2.0))
    for found in (
        ask_for_chosen(model, taken, limit_s=-1.0),
        ask_for_chosen(replace(model, part=None), taken),
        ask_for_chosen(coarse, taken),
    ):
        assert found.taken == taken
        assert set(found.unasked) == _names(taken)
        (said,) = found.sentences()
        assert all(name in said for name in found.unasked)
    with pytest.raises(InputError, match="import cancelled"):
        ask_for_chosen(model, taken, given_up=lambda: True)
    # Results of the check while reading are reused.
    known = ask_for_chosen(replace(model, unasked=None), taken)
    assert (known.taken, known.sentences()) == (taken, ())


def test_a_thousand_surfaces_that_are_not_asked_are_one_line(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = _unasked(written(tmp_path / "block.step", block()))
    top = next(
        one
        for one in offers_of(model)
        if one.feature.shape is Shape.PLANE and np.allclose(one.feature.direction, (0, 0, 1))
    )
    (said,) = ask_for_chosen(model, (top,) * 1000, limit_s=-1.0).sentences()
    assert "(+990)" in said
    assert len(said) < 1000
