"""The part that is made of a STEP file: mesh, edges, exact faces and outlines; needs ``step``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from ocmm_cad.step import read_model, read_part
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.part_model import ModelFace, PartModel, bezier_surface, derivatives_at
from tests.cad.nist_models import NIST, nist_model, path_of
from tests.cad.step_models import (
    FREE_FORM,
    MODELS,
    TESSELLATED,
    bent_outline,
    labelled,
    off_mm,
    written,
)
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

EVERY = {
    **{name: make for name, (make, _) in MODELS.items()},
    # The library finds neither volume nor distances for the bent pocket.
    **{name: make for name, make in FREE_FORM.items() if name != "bent pocket"},
}
ON_IT_MM = 1e-6
"""Surfaces are exact; the search of the library ends at 1e-7."""


def inside(uv: Float, loops: tuple[Float, ...]) -> Any:
    crossed = np.zeros(len(uv), dtype=np.int64)
    for loop in loops:
        for (u0, v0), (u1, v1) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            spans = (uv[:, 1] >= min(v0, v1)) & (uv[:, 1] < max(v0, v1))
            at = u0 + (u1 - u0) * (uv[:, 1] - v0) / (v1 - v0 if v1 != v0 else 1.0)
            crossed += spans & (at > uv[:, 0])
    return crossed % 2 == 1


def tried(face: ModelFace, count: int) -> tuple[Float, Float, float]:
    """Return points on a trimmed face, its normals there, and its area, mm²."""
    spline = face.spline
    assert spline is not None
    assert face.loops
    rng = np.random.default_rng(face.number)
    every = np.concatenate(face.loops)
    low, high = every.min(axis=0), every.max(axis=0)
    cells = (np.indices((count, count)).reshape(2, -1).T + rng.random((count**2, 2))) / count
    uv = low + cells * (high - low)
    uv = uv[inside(uv, face.loops)]
    found = derivatives_at(bezier_surface(spline), uv)
    points, normals = found.at, np.cross(found.u, found.v) * (1.0 if face.outward else -1.0)
    sizes = np.linalg.norm(normals, axis=1)
    area = float(sizes.sum() * np.prod(high - low) / count**2)
    good = sizes > 1e-6 * sizes.max()
    return points[good], normals[good] / sizes[good, None], area


def mesh_areas(part: PartModel) -> Float:
    a, b, c = (part.vertices[part.triangles[:, corner]] for corner in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(part.triangle_faces, areas, len(part.faces)).astype(np.float64)


def flat_normals(part: PartModel) -> Float:
    a, b, c = (part.vertices[part.triangles[:, corner]] for corner in range(3))
    flat = np.cross(b - a, c - a)
    unit: Float = flat / np.maximum(np.linalg.norm(flat, axis=1), 1e-12)[:, None]
    return unit


def volume(part: PartModel) -> float:
    a, b, c = (part.vertices[part.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def exact_volume(path: Path) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    found = GProp_GProps()
    measure = getattr(BRepGProp, "VolumeProperties_s", None) or BRepGProp.VolumeProperties
    measure(reader.OneShape(), found)
    return float(found.Mass())


@pytest.mark.parametrize("name", EVERY)
def test_a_part_is_what_the_model_says(
    name: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "model.step", EVERY[name]())
    part = read_part(path)
    assert part.source_name == "model.step"
    # All around: no edge is open, and the volume inside is that of the solid.
    assert (part.edge_faces >= 0).all()
    areas = mesh_areas(part)
    assert volume(part) == pytest.approx(
        exact_volume(path), abs=2.0 * part.deflection_mm * areas.sum()
    )
    # A vertex lies on its face, with the normal that its triangles have about there.
    some = np.random.default_rng(1).permutation(len(part.vertices))[:60]
    assert off_mm(path, part.vertices[some].tolist()).max() < ON_IT_MM
    corners = part.normals[part.triangles]
    seen = np.einsum("tcj,tj->tc", corners, flat_normals(part))
    sizeable = np.linalg.norm(flat_normals(part), axis=1) > 0.5
    assert seen[sizeable].min() > 0.3
    points, worst = [], 0.0
    for place, face in enumerate(part.faces):
        on_it, normals, area = tried(face, 40)
        worst = max(worst, abs(area / areas[place] - 1.0))
        chosen = np.random.default_rng(2).permutation(len(on_it))[:12]
        points.append(on_it[chosen])
        own = np.flatnonzero(part.triangle_faces == place)
        middles = part.vertices[part.triangles[own]].mean(axis=1)
        near = np.argmin(np.linalg.norm(middles[None] - on_it[chosen][:, None], axis=2), axis=1)
        facing = np.einsum("ij,ij->i", flat_normals(part)[own][near], normals[chosen])
        assert np.median(facing) > 0.95, face.kind
    off = off_mm(path, np.concatenate(points).tolist())
    record_property(f"{name}: spline off, mm", f"{off.max():.1e} of {len(off)}")
    assert off.max() < ON_IT_MM
    # 1600 places, one in each cell: the outline goes through some 160 of them.
    assert worst < 0.05


def test_a_wall_is_followed_where_its_curve_bends_in_a_small_part_of_its_parameter(
    tmp_path: Path,
) -> None:
    needs_package("OCP", "the extra 'step'")
    part = read_part(written(tmp_path / "pocket.step", FREE_FORM["bent pocket"]()))
    curve = bent_outline()
    steps = np.concatenate([np.linspace(0.0, 0.001, 20_000), np.linspace(0.001, 1.0, 200_000)])
    truth = np.array([(p.X(), p.Y()) for p in (curve.Value(float(t)) for t in steps)])
    x, y = truth.T
    area = 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    areas = mesh_areas(part)
    assert volume(part) == pytest.approx(
        20.0 * (6000.0 - area), abs=2.0 * part.deflection_mm * areas.sum()
    )
    (wall,) = [place for place, face in enumerate(part.faces) if face.kind == "SurfaceOfExtrusion"]
    on_it, _, _ = tried(part.faces[wall], 40)
    away = np.asarray(cKDTree(truth).query(on_it[:, :2])[0])
    # Half of the widest step between two points of the curve.
    assert away.max() < 0.5 * np.linalg.norm(np.diff(truth, axis=0), axis=1).max() + 1e-9


@pytest.mark.parametrize("name", NIST)
def test_parts_that_nobody_here_made(
    name: str, reference: Path, record_property: Callable[[str, object], None]
) -> None:
    path, part = path_of(reference, name), nist_model(reference, name).part
    assert part is not None
    assert (part.edge_faces >= 0).all()
    assert all(face.spline is not None and face.loops for face in part.faces)
    areas = mesh_areas(part)
    points = np.concatenate([tried(face, 25)[0][::40] for face in part.faces])[::12]
    off = off_mm(path, points.tolist())
    record_property(f"{name}: spline off, mm", f"{off.max():.1e} of {len(off)}")
    assert off.max() < 0.02
    assert volume(part) == pytest.approx(
        exact_volume(path), abs=2.0 * part.deflection_mm * areas.sum()
    )


def test_what_a_file_says_of_faces(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    part = read_part(labelled(tmp_path / "a.step"))
    assert len(part.faces) == 14
    named = [face for face in part.faces if face.name]
    assert [(face.name, face.colour) for face in named] == [("DATUM FACE", "#ff0000")] * 2
    assert {face.colour for face in part.faces if not face.name} == {"#0000ff"}
    assert {face.layer for face in part.faces} == {"7"}
    # Components lie at their places in the assembly.
    np.testing.assert_allclose(part.box, [[0, 0, 0], [400, 60, 20]], atol=1e-9)


def test_faces_name_the_features_that_they_belong_to(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(written(tmp_path / "a.step", MODELS["bored"][0]()), with_part=True)
    assert model.part is not None
    owners = {face.feature: face for face in model.part.faces}
    assert set(owners) == {feature.name for feature in model.features}
    for feature in model.features:
        assert owners[feature.name].kind == feature.shape.value


def test_lengths_are_millimetres_whatever_the_file_says(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    part = read_part(written(tmp_path / "a.step", MODELS["block"][0](), "INCH"))
    np.testing.assert_allclose(part.box, [[0, 0, 0], [100, 60, 20]], atol=1e-6)


def test_reading_tells_what_it_does_and_can_be_given_up(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "a.step", MODELS["three lugs"][0]())
    told: list[str] = []
    read_part(path, progress=told.append)
    assert told[0] == "the text of the file"
    assert any(one.startswith("the shape of face 1 of") for one in told)
    with pytest.raises(InputError, match="cancelled"):
        read_part(path, given_up=lambda: True)


def test_a_tessellated_file_makes_no_part(reference: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    with pytest.raises(InputError, match="tessellated model: 273 faces"):
        read_part(reference / "step" / TESSELLATED)
