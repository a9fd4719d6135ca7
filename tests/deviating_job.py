"""A job with a free form, a plane and a bore with exact deviations, as screens get it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.measuring import MeasuredPoint, factors_of_matrix
from ocmm_core.part_model import PlacedPart, nominal_face, normals_at, places_at, searched_face
from ocmm_core.tolerances.decisions import CharacteristicResult, evaluate_all
from ocmm_core.tolerances.zones import Characteristic
from tests.core.export.sample_report import HEAD
from tests.core.part_model.model_faces import face_of, waves
from tests.core.tolerances.known_part import KnownPart, face, motion, ring
from tests.made_parts import PartMaker

SIDE = 5
FORM = 0.02
"""mm: of the free form, a wave from edge to edge."""


def part() -> KnownPart:
    """Return the part: a block with a wavy top, datums below and at its sides, a bore in one."""
    made = KnownPart(motion(300, 100, 900, 0.02, 0.01, 0.4))
    made.add("base", Shape.PLANE, face(motion(0, 0, -30, np.pi, 0, 0), 60.0),
             point=(0, 0, -30), direction=(0, 0, -1))  # fmt: skip
    made.add("left", Shape.PLANE, face(motion(-45, 0, -18, 0, -np.pi / 2, 0), 18.0),
             point=(-45, 0, -18), direction=(-1, 0, 0))  # fmt: skip
    made.add("front", Shape.PLANE, face(motion(0, -45, -18, np.pi / 2, 0, 0), 18.0,
             lambda x, y: 0.006 * x * y / 81.0), point=(0, -45, -18),
             direction=(0, -1, 0))  # fmt: skip
    bore = ring(motion(45, 0, -18, 0, np.pi / 2, 0), 8.0, (-8.0, 0.0, 8.0), inner=True,
                bulge=lambda t: 0.004 * np.cos(3 * t))  # fmt: skip
    made.add("bore", Shape.CYLINDER, bore, point=(45, 0, -18), direction=(1, 0, 0), diameter=16.0,
             side="inner")  # fmt: skip
    surface = searched_face(face_of(waves())).surface
    steps = np.linspace(0.08, 0.92, SIDE)
    u, v = np.meshgrid(steps, steps)
    at = np.stack([u.ravel(), v.ravel()], axis=1)
    form = FORM * np.sin(2.0 * np.pi * at[:, 0]) * np.cos(np.pi * at[:, 1])
    form[7] += 0.03
    form[18] -= 0.035
    for i, (point, normal) in enumerate(
        zip(places_at(surface, at), normals_at(surface, at), strict=True)
    ):
        made.add(f"T{i + 1}", Shape.POINT, ((point + form[i] * normal)[None], normal[None]),
                 point=tuple(point.tolist()), direction=tuple(normal.tolist()))  # fmt: skip
    return made


def asked(top: float = 0.05) -> list[Characteristic]:
    """Return profile of the top, flatness of the front, and form of the bore."""
    names = [f"T{i + 1}" for i in range(SIDE**2)]
    held = nominal_face(face_of(waves(), number=7))
    return [
        Characteristic(name="Profile of the top", kind="surface profile", features=names,
                       datums=["base", "left", "front"], upper=top, faces=(held,)),
        Characteristic(name="Front flat", kind="flatness", features=["front"], upper=0.03),
        Characteristic(name="Bore round", kind="cylindricity", features=["bore"], upper=0.03),
    ]  # fmt: skip


def results(made: KnownPart, items: list[Characteristic]) -> tuple[CharacteristicResult, ...]:
    """Return the results with noise of one micrometre in U."""
    covariance: Float = np.diag(np.full(3 * len(made.points) + 1, 0.001**2))
    found = actual_features(made.nominals, made.points)
    return evaluate_all(items, None, found, factors_of_matrix(covariance), "iso14253-1")


@cache
def deviating_job(top: float = 0.05) -> tuple[JobView, list[NominalFeature]]:
    """Return the job, complete, and its nominals; ``top`` is the tolerance of the top, mm."""
    made = part()
    found = actual_features(made.nominals, made.points)
    features = []
    for nominal in made.nominals:
        own = tuple(point for point in made.points if point.feature == nominal.name)
        actual = found[nominal.name]
        fit = actual.fit if isinstance(actual, ActualFeature) else None
        features.append(
            FeatureView(nominal.name, nominal.shape, len(own), FeatureState.DONE, own, fit, "")
        )
    view = JobView(
        job="Block_08", part="Block", operator=HEAD.operator, features=tuple(features),
        active="", characteristics=results(made, asked(top)), refusal=None, complete=True,
        requirements=None,
    )  # fmt: skip
    return view, made.nominals


def held_back(view: JobView, point: MeasuredPoint) -> JobView:
    """Return the job with one point held back."""
    return replace(view, held=(point.number,))


def placed_part(*, is_rough: bool = False) -> PlacedPart:
    """Return the block of its model at its place in the job."""
    maker = PartMaker()
    steps = np.linspace(0.0, 1.0, 25)
    u, v = np.meshgrid(steps, steps, indexing="ij")
    surface = searched_face(face_of(waves())).surface
    at = np.stack([u.ravel(), v.ravel()], axis=1)
    grid = (25, 25, 3)
    maker.sheet(
        places_at(surface, at).reshape(grid),
        normals_at(surface, at).reshape(grid),
        "BSplineSurface",
    )
    maker.box((-45.0, -45.0, -30.0), (45.0, 45.0, -6.0))
    maker.tube((0.0, 0.0, 0.0), 20.0, 8.0, hollow=True)
    made = maker.part("block.step")
    # The bore goes along x, from x = 35 on: the tube is along z.
    rows = np.unique(made.triangles[made.triangle_faces == len(made.faces) - 1])
    for lengths in (made.vertices, made.normals):
        lengths[rows] = lengths[rows] @ np.array([[0.0, 0, -1.0], [0.0, 1.0, 0], [1.0, 0, 0]])
    made.vertices[rows] += [35.0, 0.0, -18.0]
    return PlacedPart(made, part().place, is_rough)
