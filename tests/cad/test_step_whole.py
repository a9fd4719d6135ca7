"""Models as foreign programs write them: every face accounted for, every target on its face.

Targets are checked apart from the import: the library reads the file again and measures the
distance of each target from the trimmed faces, so that a target in a hole is as far off as the
hole is wide. All of it needs the extra ``step``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ocmm_cad.step import (
    Choice,
    StepModel,
    chosen,
    faces_account,
    model_files,
    offers_of,
    read_model,
)
from ocmm_cad.step.brep import RECOGNISED_MM, read_document, stretches_of
from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import add_feature, new_plan, part_of_plan, with_model
from tests.cad.step_models import _ball as ball
from tests.cad.step_models import hill, off_mm, written
from tests.cad.whole_step_models import (
    GOOD,
    MORE,
    ODD,
    UNITS,
    as_splines,
    assembly,
    bored_plate,
    changed,
    flat_cone,
    spline_bores,
    split_plate,
    turned,
)
from tests.host import amount, needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

SEED, OFF_MM = 20261128, 0.05
"""Largest distance of a target from its face: above it a person sees a wrong place."""


def rng_of(*words: str) -> np.random.Generator:
    return np.random.default_rng([SEED, *(ord(sign) for word in words for sign in word)])


def check(path: Path, model: StepModel, files: tuple[str, ...] = ()) -> None:
    """Check the targets of a model by the library alone, and the sum of its account."""
    places = [one for item in model.features for one in item.targets]
    places += [one for form in model.free_forms for one in form.targets]
    if places:
        part = written(path.with_name("whole.stp"), read_document(str(path), print, files).shape)
        assert float(off_mm(part if files else path, places).max()) <= OFF_MM
    account = faces_account(model, chosen(offers_of(model), Choice(everything=True)))
    assert account.faces == model.face_count > 0
    assert account.taken + sum(count for _, count in account.left_out) == account.faces


def test_a_ray_between_the_ends_of_two_arcs_finds_the_hole() -> None:
    """The corners of a hole of two half circles are a hundredth apart: the ray passes there."""
    angles = np.linspace(0.001, np.pi - 0.001, 41)
    upper = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles)], axis=1)
    square = np.array([[-30.0, -20], [30, -20], [30, 20], [-30, 20], [-30, -20]])
    uv = np.concatenate([square, upper, -upper])
    starts = np.array([0, 5, 46, 87])
    us, vs = np.array([-20.0, 0.0, 20.0]), np.array([-15.0, 0.0, 15.0])

    def found(loops: Float) -> list[list[bool]]:
        holds = np.zeros((3, 3), dtype=np.bool_)
        kernel.inside(us, vs, loops, holds)
        inside: list[list[bool]] = holds.tolist()
        return inside

    edges = [stretches_of(uv[a:b]) for a, b in pairwise(starts.tolist())]
    assert found(np.concatenate(edges))[1] == [True, True, True]
    assert found(kernel.closed_loops(uv, starts)) == [
        [True, True, True], [True, False, True], [True, True, True],
    ]  # fmt: skip


# 12 models in every run, 150 in the long form, each with its own limit of time.
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("turn", range(amount(1, 10)))
@pytest.mark.parametrize("name", GOOD | (MORE if amount(0, 1) else {}))
def test_all_targets_of_foreign_models_lie_on_their_faces(
    name: str, turn: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_package("OCP", "the extra 'step'")
    # The writer of assemblies writes part files into the working directory.
    monkeypatch.chdir(tmp_path)
    path = (GOOD | MORE)[name](tmp_path / "model.stp", rng_of(name, str(turn)))
    model = read_model(path)
    check(path, model, tuple(sorted(model_files(path).parts)))
    bores = [one for one in model.features if one.shape is Shape.CYLINDER]
    if name in ("bored plate", "splines", "inside out"):
        assert len(bores) == (3 if name == "inside out" else 6)
        assert all(one.side == ("inner" if name != "inside out" else one.side) for one in bores)
    if "split" in name:
        assert len(bores) == 3


@pytest.mark.timeout(1800)
def test_bores_of_splines_are_bores(tmp_path: Path) -> None:
    """The bores of as1-oc-214: 70 B-splines, all of them cylinders."""
    needs_package("OCP", "the extra 'step'")
    brackets = amount(1, 14)
    path = spline_bores(tmp_path / "as1.stp", rng_of("as1"), brackets)
    model = read_model(path)
    bores = [one for one in model.features if one.shape is Shape.CYLINDER]
    assert len(bores) == 5 * brackets
    assert all(one.side == "inner" for one in bores)
    assert not model.free_forms
    check(path, model)


@pytest.mark.parametrize("name", ODD)
def test_one_damaged_face_does_not_end_an_import(name: str, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    for turn in range(amount(1, 8)):
        path = ODD[name](tmp_path / f"model{turn}.stp", rng_of(name, str(turn)))
        model = read_model(path, with_part=True)
        assert len(model.features) >= 4
        account = faces_account(model, chosen(offers_of(model), Choice()))
        assert account.taken + sum(count for _, count in account.left_out) == account.faces


def test_bores_of_splines_are_recognised_within_the_limit(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    rng = rng_of("splines")
    exact = bored_plate(rng, 6)
    truth = read_model(written(tmp_path / "exact.stp", exact))
    model = read_model(written(tmp_path / "splines.stp", as_splines(exact)))

    def sizes(one: StepModel) -> list[tuple[str, str, float]]:
        return sorted(
            (item.shape.value, item.side, round(item.diameter, 4)) for item in one.features
        )

    assert sizes(model) == sizes(truth)
    account = faces_account(model, offers_of(model))
    assert len(account.recognised) == len(model.features) == 12
    assert max(off for _, off in account.recognised) < 1e-6
    assert "12 of the features are splines" in account.recognised_sentence()
    assert not truth.recognised


@pytest.mark.parametrize(
    ("rise_mm", "known"), [(0.3 * RECOGNISED_MM, True), (10.0 * RECOGNISED_MM, False)]
)
def test_splines_that_leave_their_plane_stay_free_forms(
    rise_mm: float, known: bool, tmp_path: Path
) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written(tmp_path / "hill.stp", hill(rise=rise_mm)))
    assert len(model.free_forms) == (not known)
    assert len(model.recognised) == known
    if known:
        (deviation,) = model.recognised.values()
        assert 0.1 * rise_mm < deviation < RECOGNISED_MM


def test_a_cone_that_no_plan_can_hold_is_left_out_by_name(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written(tmp_path / "flat.stp", flat_cone(np.random.default_rng(3))))
    plan = new_plan("P", "PART")
    for feature in model.features:
        plan = add_feature(plan, feature)
    assert len(model.features) >= 7


@pytest.mark.parametrize("unit", UNITS)
def test_units_of_a_model_are_honoured(unit: str, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    shape = turned(split_plate(np.random.default_rng(5)), np.random.default_rng(6))
    truth = read_model(written(tmp_path / "mm.stp", shape))
    model = read_model(written(tmp_path / "other.stp", shape, unit))

    def sizes(one: StepModel) -> list[float]:
        return sorted(item.diameter or item.length for item in one.features)

    # STEP files hold ten digits or so.
    np.testing.assert_allclose(sizes(model), sizes(truth), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize(
    ("pattern", "with_", "says"),
    [
        (r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\([^)]*\)\)", "", "names no units"),
        (r"\(25\.4,", "(25.,", "one 'INCH' is 25 mm in the document"),
        (r"UNIT_ASSIGNED_CONTEXT\s*\(\s*\((#\d+),#\d+,", r"UNIT_ASSIGNED_CONTEXT((\1,",
         "no unit of angle"),
        (r"LENGTH_UNIT\(\)", "MASS_UNIT()", "no unit of length"),
    ],
)  # fmt: skip
def test_a_model_whose_units_are_missing_or_wrong_is_refused(
    pattern: str, with_: str, says: str, tmp_path: Path
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "inch.stp", bored_plate(rng_of("units"), 1), "INCH")
    changed(path, pattern, lambda found: found.expand(with_), 0)
    with pytest.raises(InputError, match=says) as refused:
        read_model(path)
    assert "units of length and angle" in refused.value.remedy


@pytest.fixture
def whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write an assembly of three files and return the one that names the others."""
    needs_package("OCP", "the extra 'step'")
    monkeypatch.chdir(tmp_path)
    return assembly(tmp_path / "top.stp", rng_of("whole"))


def test_a_plan_keeps_all_files_of_an_assembly_and_notices_a_change(
    whole: Path, tmp_path: Path
) -> None:
    model = read_model(whole, with_part=True)
    spheres = [one for one in model.features if one.shape is Shape.SPHERE]
    assert [one.diameter for one in spheres] == [50.0]
    plan_file = tmp_path / "plans" / "p.toml"
    plan_file.parent.mkdir()
    plan = with_model(new_plan("P", "PART"), plan_file, whole, model.part)
    assert plan.model is not None
    kept = plan_file.parent / plan.model.file
    assert sorted(one.name for one in kept.parent.iterdir()) == [
        "part_ball.stp", "part_plate.stp", "top.stp",
    ]  # fmt: skip
    # Import it again: the copy is the same one.
    assert with_model(plan, plan_file, whole).model == plan.model
    assert part_of_plan(plan, plan_file.parent).model is not None
    ball = kept.parent / "part_ball.stp"
    changed(ball, r"(SPHERICAL_SURFACE\('[^']*',#\d+,)25\.", lambda found: f"{found[1]}24.", 1)
    doubt = part_of_plan(plan, plan_file.parent).doubt
    assert doubt is not None
    assert doubt.code == "plan.model_changed"
    ball.unlink()
    doubt = part_of_plan(plan, plan_file.parent).doubt
    assert doubt is not None
    assert "'part_ball.stp' is not in its folder" in doubt.what


def outside(folder: Path) -> str:
    (folder / "inner").mkdir()
    (folder / "top.stp").replace(folder / "inner" / "top.stp")
    (folder / "part_plate.stp").replace(folder / "inner" / "part_plate.stp")
    return "../part_ball.stp"


def linked(folder: Path) -> str:
    (folder / "inner").mkdir()
    for name in ("top.stp", "part_plate.stp"):
        (folder / name).replace(folder / "inner" / name)
    (folder / "inner" / "part_ball.stp").symlink_to(folder / "part_ball.stp")
    return "part_ball.stp"


def piped(folder: Path) -> str:
    (folder / "part_ball.stp").unlink()
    os.mkfifo(folder / "part_ball.stp")
    return "part_ball.stp"


@pytest.mark.parametrize(
    ("prepare", "says"),
    [
        pytest.param(outside, "does not lie in its folder", id="a folder above"),
        pytest.param(lambda folder: str(folder / "part_ball.stp"), "does not lie in its folder",
                     id="an absolute path"),
        pytest.param(lambda _: "..\\\\part_ball.stp", "does not lie in its folder", id="Windows"),
        pytest.param(linked, "does not lie in its folder", id="a link that leads out"),
        pytest.param(piped, "a pipe or a device", id="a pipe"),
        pytest.param(lambda _: "top.stp", "contains itself", id="itself"),
        pytest.param(lambda _: "ball.jt", "'ball.jt' .* is not a STEP file", id="another format"),
        pytest.param(lambda _: "", "without a name .* is not a STEP file", id="no name"),
        pytest.param(lambda _: "gone.stp", "'gone.stp' is not in its folder", id="missing"),
    ],
)  # fmt: skip
def test_part_files_that_cannot_be_used_are_refused_by_name(
    prepare: Callable[[Path], str], says: str, whole: Path
) -> None:
    name = prepare(whole.parent)
    top = next(whole.parent.rglob("top.stp"))
    changed(top, "part_ball.stp'", lambda _: f"{name}'", 0)
    with pytest.raises(InputError, match=says) as refused:
        read_model(top)
    assert str(top) in refused.value.what


def test_part_files_in_folders_are_read_through_each_other(whole: Path) -> None:
    """An assembly of assemblies: the names of a file are relative to its own folder."""
    folder = whole.parent / "sub"
    folder.mkdir()
    for name in ("top.stp", "part_ball.stp", "part_plate.stp"):
        (whole.parent / name).replace(folder / name)
    text = (folder / "top.stp").read_text()
    whole.write_text(
        text.replace("part_ball.stp", "sub/top.stp").replace("part_plate", "sub/part_plate")
    )
    files = model_files(whole)
    assert sorted(files.parts) == ["sub/part_ball.stp", "sub/part_plate.stp", "sub/top.stp"]
    # The ball of the outer assembly is an assembly of two plates and a ball: four plates in all.
    model = read_model(whole)
    assert sum(one.shape is Shape.SPHERE for one in model.features) == 1
    assert sum(one.shape is Shape.CYLINDER for one in model.features) == 12


def test_documents_that_are_not_read_are_named_and_names_are_no_tolerances(whole: Path) -> None:
    """A drawing is named in the account; a part called DATUM PLATE has no datum."""
    text = whole.read_text()
    paper = "#99999=DOCUMENT_FILE('drawing.pdf','','',#99998,'','');\n#99998=DOCUMENT_TYPE('');\n"
    head, mark, tail = text.rpartition("ENDSEC;")
    whole.write_text(head + paper + mark + tail)
    changed(whole.parent / "part_plate.stp", r"PRODUCT\('[^']*'", lambda _: "PRODUCT('DATUM'", 1)
    files = model_files(whole)
    assert files.papers == ("drawing.pdf",)
    assert not files.have_tolerances
    model = read_model(whole)
    assert "not read: drawing.pdf." in model.remark
    assert model.pmi is None or not model.pmi.fault


def test_part_files_keep_their_own_units(whole: Path) -> None:
    written(whole.parent / "part_ball.stp", ball(), "INCH")
    model = read_model(whole)
    assert [one.diameter for one in model.features if one.shape is Shape.SPHERE] == [50.0]


def test_parts_of_one_file_keep_their_own_units(tmp_path: Path) -> None:
    """The last part of the assembly is in centimetres, the assembly in millimetres."""
    needs_package("OCP", "the extra 'step'")
    path = assembly(tmp_path / "one.stp", rng_of("mixed"), "")
    head, mark, tail = path.read_text().rpartition("LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.")
    path.write_text(head + mark.replace("MILLI", "CENTI") + tail)
    model = read_model(path)
    (sphere,) = [one for one in model.features if one.shape is Shape.SPHERE]
    assert sphere.diameter == 500.0
    check(path, model)


def test_a_file_name_that_is_no_utf8_is_read(whole: Path) -> None:
    odd = Path(os.fsdecode(b"b\xfcchse.stp")).absolute()
    (whole.parent / "part_ball.stp").replace(odd)
    model = read_model(odd, with_part=True)
    assert model.part is not None
    assert model.part.source_name == "b?chse.stp"
    assert isinstance(model.features[0], NominalFeature)


def test_a_choice_that_fits_nothing_gives_the_reasons(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written(tmp_path / "bored.stp", bored_plate(rng_of("choice"), 2)), 40.0)
    with pytest.raises(InputError, match=r"most often .*a ball of 40 mm"):
        chosen(offers_of(model), Choice(without=("PLANE*",)))
    with pytest.raises(InputError, match="no surface has the name, kind and size"):
        chosen(offers_of(model), Choice(least_mm=5000.0))
