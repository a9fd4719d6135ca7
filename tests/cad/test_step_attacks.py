"""Malformed STEP files: a correct part, or one sentence.

Needs the extra ``step``.
"""

from __future__ import annotations

import multiprocessing
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_cad.step import StepModel, read_model, read_part
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.plan import add_feature, load_plan, new_plan, save_plan
from ocmm_core.names import name_fault
from tests.cad.odd_step_models import (
    HOSTILE_NAMES,
    assembled,
    bored,
    in_nanometres,
    mirrored,
    named,
    open_box,
    scaled,
    shell,
    together,
    two_solids,
    with_open_outlines,
)
from tests.cad.step_models import _moved as moved
from tests.cad.step_models import block, off_mm, written
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

OFF_MM = 0.05
SEED = 97


def _bores(model: StepModel) -> list[tuple[float, str]]:
    return sorted(
        (round(one.diameter, 6), one.side) for one in model.features if one.shape is Shape.CYLINDER
    )


@pytest.mark.parametrize(
    ("make", "unit", "bores", "planes"),
    [
        pytest.param(lambda: two_solids(50.0), "MM", [12.0, 12.0], 12, id="two solids"),
        pytest.param(lambda: two_solids(0.0), "MM", None, None, id="two solids that touch"),
        pytest.param(lambda: together(bored(), moved(bored(), 30, 0, 0)), "MM", None, None,
                     id="two solids in each other"),
        pytest.param(lambda: shell(bored()), "MM", [12.0], 6, id="a shell"),
        pytest.param(open_box, "MM", [], 5, id="an open box"),
        # The faces on which they touch are inside.
        pytest.param(lambda: together(bored(), mirrored(bored())), "MM", [12.0, 12.0], 10,
                     id="a part and its mirror image"),
        pytest.param(bored, "M", [12.0], 6, id="metres"),
        pytest.param(lambda: moved(bored(), 9e5, -9e5, 9e5), "MM", [12.0], 6, id="far away"),
        pytest.param(lambda: scaled(bored(), 200.0), "MM", [2400.0], 6, id="20 m"),
    ],
)  # fmt: skip
def test_an_odd_file_is_the_part_that_it_says(
    make: Callable[[], Any],
    unit: str,
    bores: list[float] | None,
    planes: int | None,
    tmp_path: Path,
    record_property: Callable[[str, object], None],
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "odd.step", make(), unit)
    model = read_model(path, with_part=True)
    off = off_mm(path, [target for one in model.features for target in one.targets])
    record_property("targets off", f"{np.sum(off > OFF_MM)} of {len(off)}")
    assert off.max() <= OFF_MM
    assert model.part is not None
    if bores is not None:
        assert _bores(model) == [(size, "inner") for size in bores]
        assert sum(one.shape is Shape.PLANE for one in model.features) == planes


def test_a_mirrored_part_is_touched_from_outside(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written(tmp_path / "mirror.step", mirrored(bored())))
    middle = np.array([-50.0, 30.0, 10.0])
    for one in model.features:
        if one.shape is Shape.PLANE:
            assert (np.array(one.point) - middle) @ np.array(one.direction) > 0.0
    (bore,) = [one for one in model.features if one.shape is Shape.CYLINDER]
    assert (bore.point, bore.side) == ((-20.0, 20.0, 10.0), "inner")


@pytest.mark.parametrize("name", HOSTILE_NAMES)
def test_whatever_a_model_is_called_its_plan_can_be_written(name: str, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(named(tmp_path / "named.step", name), with_part=True)
    assert len(model.features) == 7
    plan = new_plan("P", "PART")
    for feature in model.features:
        assert not name_fault(feature.name)
        plan = add_feature(plan, feature)
    save_plan(plan, tmp_path / "plan.toml")
    assert load_plan(tmp_path / "plan.toml") == plan
    assert model.part is not None
    for face in model.part.faces:
        # A line of text holds it, and it turns nothing round.
        assert face.name.isprintable()
        assert len(face.name) <= 200


@pytest.mark.parametrize(
    ("factor", "says"), [(1e-4, "none of its 7 surfaces can be probed"), (1e5, "no size of a part")]
)
def test_a_part_of_a_size_that_nobody_measures_is_told_as_one(
    factor: float, says: str, tmp_path: Path
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "size.step", scaled(bored(), factor))
    with pytest.raises(InputError, match=says) as refused:
        read_model(path, with_part=True)
    assert refused.value.remedy


def test_a_part_that_lies_too_far_from_its_origin_is_told_as_one(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "far.step", moved(bored(), 1e6, -1e6, 1e6))
    with pytest.raises(InputError, match="lie 1000 m from its origin") as refused:
        read_model(path, with_part=True)
    assert "origin at the part" in refused.value.remedy
    # Without its picture it can be measured.
    assert len(read_model(path).features) == 7


@pytest.mark.parametrize(
    "links",
    [
        pytest.param([(n, n + 1) for n in range(2000)], id="nested 2000 deep"),
        pytest.param([(0, 1), (1, 2), (2, 1)], id="in a circle"),
        pytest.param([(0, 1), (1, 1)], id="in itself"),
    ],
)
def test_an_assembly_without_end_is_a_part_or_a_sentence(
    links: list[tuple[int, int]], tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = assembled(tmp_path / "links.step", max(max(one) for one in links), links)
    refused = None
    try:
        model = read_model(path, with_part=True)
    except InputError as error:
        refused = error
    if refused is None:
        assert _bores(model) == [(12.0, "inner")]
    else:
        assert str(path) in refused.what
        assert refused.remedy
    record_property("became", "a part" if refused is None else refused.what)
    assert multiprocessing.active_children() == []


def test_an_assembly_with_more_faces_than_a_part_can_have_is_told_at_once(tmp_path: Path) -> None:
    """34 kilobytes: each assembly contains the previous one twice, 8,192 blocks of seven faces.

    Read face by face, the file exhausted the reader's memory, and the message named the memory.
    """
    needs_package("OCP", "the extra 'step'")
    twice = [(n, n + 1) for n in range(13) for _ in range(2)]
    path = assembled(tmp_path / "twice.step", 13, twice)
    told: list[str] = []
    with pytest.raises(InputError, match="more than 50000 faces") as refused:
        read_part(path, progress=told.append)
    assert "without parts and details" in refused.value.remedy
    assert not any("face 1 of" in one for one in told)


def test_an_assembly_of_assemblies_is_the_part_in_it(tmp_path: Path) -> None:
    # Such files are as good as any: it is the number that makes them hostile.
    needs_package("OCP", "the extra 'step'")
    path = assembled(tmp_path / "three.step", 3, [(0, 1), (1, 2), (2, 3)])
    assert _bores(read_model(path)) == [(12.0, "inner")]


def test_a_part_in_nanometres_is_told_as_none(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = in_nanometres(tmp_path / "none.step")
    with pytest.raises(InputError) as refused:
        read_model(path, with_part=True)
    assert str(path) in refused.value.what
    assert refused.value.remedy
    assert multiprocessing.active_children() == []


def test_a_file_that_is_replaced_while_it_is_read_is_refused(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "a.step", bored())
    other = written(tmp_path / "b.step", block()).read_bytes()

    def replaced(_: str) -> None:
        path.write_bytes(other)

    # Kept by the hash of one, it would be shown as that for good.
    with pytest.raises(InputError, match="changed while it was read") as refused:
        read_part(path, progress=replaced)
    assert refused.value.remedy == "Import it again."
    assert read_part(path).faces


@pytest.mark.slow
def test_a_file_that_ends_anywhere_is_refused_with_a_sentence(
    tmp_path: Path, repeats: Callable[..., int], record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    cuts = repeats(10, 50)
    whole = written(tmp_path / "whole.step", bored()).read_bytes()
    rng = np.random.default_rng(SEED)
    refused = 0
    for length in rng.integers(0, len(whole), cuts).tolist():
        path = tmp_path / f"cut at {length}.step"
        path.write_bytes(whole[:length])
        with pytest.raises(InputError) as error:
            read_model(path, with_part=True)
        assert str(path) in error.value.what
        assert error.value.remedy
        refused += 1
    record_property("cut files refused", f"{refused} of {cuts}")


def test_a_face_whose_edges_do_not_go_round_gets_no_target(tmp_path: Path) -> None:
    whole = written(tmp_path / "whole.stp", bored())
    path = with_open_outlines(whole, tmp_path / "open.stp")
    with pytest.raises(InputError, match=r"\(6 of them\), its edges do not go round") as refused:
        read_model(path)
    assert "repaired" in refused.value.remedy
    # One face that is whole and the others as they were: it alone is offered.
    text = whole.read_text(encoding="ascii")
    loops = [one for one in re.findall(r"EDGE_LOOP\([^;]*", text) if one.count("#") > 1]
    half = tmp_path / "half.stp"
    half.write_text(text.replace(loops[0], re.sub(r"(\(#\d+),[^;]*", r"\1))", loops[0])), "ascii")
    model = read_model(half)
    assert [one.why for one in model.left_out] == ["its edges do not go round"]
    assert len(model.features) == 6
