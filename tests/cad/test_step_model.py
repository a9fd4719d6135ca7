"""Models of CAD systems: which features they become, and where these are touched."""

from __future__ import annotations

import multiprocessing
import re
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_cad.step import read_model
from ocmm_cad.step._joined import EDGE_MM, rooms_of, surfaces_of
from ocmm_cad.step.brep._raw_faces import RawFace, Rim
from ocmm_cad.step.brep._recognised import StepFace
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import add_feature, load_plan, new_plan, save_plan

BALL_MM = 6.0


def round_face(low: float, high: float, first_deg: float, last_deg: float) -> RawFace:
    """Return a part of a bore of 20 mm about z, with its four edges."""
    angles = np.radians(np.linspace(first_deg, last_deg, 41))
    ring = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles), np.zeros(41)], axis=1)
    ups = np.linspace(low, high, 21)
    up = np.array([0.0, 0.0, 1.0])
    inside = ring[1:-1, None] + ups[None, 1:-1, None] * up
    sides = [Rim(start + ups[:, None] * up, -start / 10.0) for start in (ring[0], ring[-1])]
    ends = [Rim(ring + height * up, -ring[20] / 10.0) for height in (low, high)]
    face = StepFace(
        shape="Cylinder", point=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), radius=10.0, low=low,
        high=high, inner=True,
    )  # fmt: skip
    return RawFace(face, inside.reshape(-1, 3), (*sides, *ends))


def found(*faces: RawFace) -> list[tuple[float, float, bool]]:
    """Return the extents of the surfaces of faces, and whether they can be probed."""
    surfaces = surfaces_of(rooms_of(faces, 0.5 * BALL_MM))
    return [(one.face.low, one.face.high, not one.against) for one in surfaces]


def test_two_bores_on_one_axis_stay_two() -> None:
    assert found(round_face(0, 10, 0, 360), round_face(90, 100, 0, 360)) == [
        (0, 10, True), (90, 100, True),
    ]  # fmt: skip


def test_two_halves_of_a_bore_are_one() -> None:
    assert found(round_face(0, 30, 0, 180), round_face(0, 30, 180, 360)) == [(0, 30, True)]


def test_two_lengths_of_a_bore_with_one_edge_are_one() -> None:
    assert found(round_face(0, 20, 0, 360), round_face(20, 40, 0, 360)) == [(0, 40, True)]


def test_arcs_that_share_no_edge_but_their_place_on_the_axis_are_one() -> None:
    assert found(round_face(0, 30, 0, 120), round_face(5, 30, 200, 330)) == [(0, 30, True)]


def test_fillets_are_left_out_also_where_several_lie_on_one_axis() -> None:
    assert found(round_face(0, 30, 0, 90), round_face(30, 60, 0, 90)) == [(0, 60, False)]


def test_a_ball_needs_room() -> None:
    # 8 mm from edge to edge: a ball of 6 mm keeps 4 mm from each, so nothing is left.
    narrow = round_face(0, 7.9, 0, 360)
    (surface,) = surfaces_of(rooms_of([narrow], 3.0))
    assert "a ball of 6 mm has no room" in surface.against
    assert surface.targets == ()
    (surface,) = surfaces_of(rooms_of([round_face(0, 40, 0, 360)], 10.5))
    assert "does not fit" in surface.against


def drilled_end(half_deg: float, radius: float) -> RawFace:
    """Return the end of a drilled hole about z, opening upwards, without its outer edge."""
    half = np.radians(half_deg)
    angles = np.radians(np.arange(0.0, 360.0, 9.0))
    round_it = np.stack([np.cos(angles), np.sin(angles), np.full(40, 1.0 / np.tan(half))], axis=1)
    radii = np.linspace(0.1, radius, 60)
    face = StepFace(
        shape="Cone", point=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), half_angle=half, low=0.0,
        high=radius / np.tan(half), inner=True,
    )  # fmt: skip
    return RawFace(face, (radii[:, None, None] * round_it).reshape(-1, 3), ())


@pytest.mark.parametrize("half_deg", [45.0, 59.0])
def test_no_target_is_so_near_to_the_tip_of_a_drilled_hole_that_the_ball_touches_opposite(
    half_deg: float,
) -> None:
    half = np.radians(half_deg)
    (surface,) = surfaces_of(rooms_of([drilled_end(half_deg, 15.0)], 3.0))
    points = np.array(surface.targets)
    from_axis = np.linalg.norm(points[:, :2], axis=1)
    assert len(points) == 2 * Shape.CONE.spec.usual_points
    # Centre of the ball: along the normal, which leads to the axis.
    assert (from_axis - 3.0 * np.cos(half)).min() >= EDGE_MM - 1e-9
    # The whole end is narrower: the ball would touch all round its rim.
    (surface,) = surfaces_of(rooms_of([drilled_end(half_deg, 3.0 * np.cos(half) + 0.9)], 3.0))
    assert "no room for" in surface.against


def test_targets_are_far_from_edges_and_from_each_other() -> None:
    (surface,) = surfaces_of(
        rooms_of([round_face(0, 60, 0, 180), round_face(0, 60, 180, 360)], 3.0)
    )
    points = np.array(surface.targets)
    assert len(points) == 2 * Shape.CYLINDER.spec.usual_points
    assert points[:, 2].min() >= 3.0 + EDGE_MM
    assert points[:, 2].max() <= 60.0 - 3.0 - EDGE_MM
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + 1e9 * np.eye(len(points))
    assert apart.min() > 5.0
    # The halves meet without an edge.
    angles = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 180.0
    assert np.minimum(angles, 180.0 - angles).min() < np.degrees(4.0 / 10.0)


def with_targets(*targets: tuple[float, float, float]) -> NominalFeature:
    return NominalFeature(
        name="BORE", shape=Shape.CYLINDER, points=5, point=(0.0, 0.0, 5.0), diameter=20.0,
        length=10.0, side="inner", targets=targets,
    )  # fmt: skip


ON_IT = ((10.0, 0.0, 1.0), (0.0, 10.0, 9.0), (-10.0, 0.0, 2.0), (0.0, -10.0, 8.0))


def test_a_plan_says_where_to_touch(tmp_path: Path) -> None:
    feature = with_targets(*ON_IT)
    places = places_of(feature, 3)
    np.testing.assert_array_equal(places.points, ON_IT[:3])
    np.testing.assert_allclose(places.normals, -np.array(ON_IT)[:3] * [0.1, 0.1, 0.0], atol=1e-12)
    plan = add_feature(new_plan("P", "PART"), feature)
    save_plan(plan, tmp_path / "p.toml")
    assert load_plan(tmp_path / "p.toml").features == [feature]
    # The surface has changed: the named target lies in the air and is not used.
    moved = msgspec.structs.replace(feature, diameter=20.2)
    assert len(places_of(moved, 8).points) == 8
    assert np.linalg.norm(places_of(moved, 8).points[:, :2], axis=1) == pytest.approx(10.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"shape": Shape.CIRCLE, "length": 0.0}, "is only for: plane, cylinder"),
        ({"targets": ((float("nan"), 0.0, 0.0),)}, "farther away"),
        ({"targets": (*ON_IT[:1],) * 1001}, "at most 1000"),
    ],
)
def test_targets_that_cannot_be_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        add_feature(new_plan("P", "PART"), msgspec.structs.replace(with_targets(*ON_IT), **changes))


def test_a_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.step"
    path.write_text("no model")
    with pytest.raises(InputError, match="not a STEP file"):
        read_model(path)


def test_without_the_extra_a_model_is_refused_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Simulates a missing library, even if it is installed; the reading process has the same path.
    (tmp_path / "OCP.py").write_text("raise ImportError\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    with pytest.raises(InputError, match="extra"):
        read_model(path)


def test_reading_a_model_can_be_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A reader that never comes back; the reading process has the same path.
    (tmp_path / "OCP.py").write_text("import time\ntime.sleep(600)\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    asked: list[int] = []

    def given_up() -> bool:
        asked.append(1)
        return len(asked) > 3

    with pytest.raises(InputError, match="cancelled"):
        read_model(path, given_up=given_up)
    assert multiprocessing.active_children() == []


def test_a_reader_that_says_nothing_is_told_of_every_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "OCP.py").write_text("import time\ntime.sleep(600)\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    told: list[str] = []
    with pytest.raises(InputError, match="cancelled"):
        read_model(path, given_up=lambda: len(told) >= 3, progress=told.append)
    # The first words of the reader itself may be among them.
    waits = [what for what in told if re.search(r" \(\d+ s\)$", what)]
    assert len(waits) >= 2


@pytest.mark.parametrize(
    ("reader", "words"),
    [
        (
            "import os\nprint('noise', flush=True)\nos.kill(os.getpid(), 11)\n",
            r"failed on it \(SIGSEGV\)",
        ),
        ("import os\nos._exit(1)\n", "failed on it"),
        ("held = bytearray(2_000_000_000)\n", "more than 1.5 GB of memory"),
        ("raise ValueError('contains no shape')\n", "contains no shape"),
        (
            "raise OSError('nobody foresaw this')\n",
            r"Reading the STEP file \(at the start of the library\) failed",
        ),
    ],
)
def test_a_reader_that_fails_is_told_by_its_own_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    reader: str,
    words: str,
) -> None:
    # In the place of the extra; the reading process has the same path.
    (tmp_path / "OCP.py").write_text(reader)
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    with pytest.raises(OcmmError, match=words):
        read_model(path)
    assert multiprocessing.active_children() == []
    assert capfd.readouterr() == ("", "")
