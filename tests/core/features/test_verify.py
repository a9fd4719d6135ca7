"""Certified pairs: the folder of NIST, pairs made here in both conventions, and bad files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.features.elements import fit_circle, fit_circle_free
from ocmm_core.features.measured import Convention, verify_folder
from ocmm_core.features.measured._verify import verify_pair
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, Points3
from ocmm_core.tables import read_points_file
from tests.core.features.shape_samples import HALF_ANGLE, RADIUS, ideal_points, somewhere

# The project's limits are a million times wider; the fits reach 1e-11.
TIGHT = {"position": 1e-10, "size": 1e-10, "direction": 1e-11, "apex": 1e-9, "residual": 1e-9}


def test_every_pair_of_nist(reference: Path) -> None:
    reports = verify_folder(reference / "nist_l2")
    assert [report.name for report in reports] == [
        "Circle2d", "Circle3d", "Cone", "Cylinder", "Line3d", "Plane", "Sphere"
    ]  # fmt: skip
    for report in reports:
        assert report.passed
        for field, limit in TIGHT.items():
            assert (report.worst(field) or 0.0) < limit, (report.name, field)
    cones = {result.name: result for result in reports[2].results}
    assert cones["con7"].position is None
    assert cones["con9"].residual is None


def _write(folder: Path, name: str, points: Points3, certified: Float) -> Path:
    folder.mkdir(exist_ok=True)
    rows = "\n".join("\t".join(repr(float(x)) for x in row) for row in points)
    file = folder / f"{name}.ds"
    file.write_text(f"{len(points)}\n{rows}\n")
    file.with_suffix(".fit").write_text("\n".join(repr(float(x)) for x in certified))
    return file


def test_the_conventions_of_a_cone(tmp_path: Path) -> None:
    rng = np.random.default_rng(61)
    motion = somewhere(rng)
    points = motion.apply(ideal_points(Shape.CONE, rng, 20))
    axis, apex = motion.rotation[:, 2], np.degrees(2.0 * HALF_ANGLE)
    place = motion.apply(np.array([0.0, 0.0, 3.0]))
    square = RADIUS + 3.0 * np.tan(HALF_ANGLE)
    nist = np.array([*place, *axis, square * np.cos(HALF_ANGLE), apex])
    ptb = np.array([*place, *-axis, square, apex])
    file = _write(tmp_path, "cone", points, nist)
    assert verify_pair(file).passed
    assert not verify_pair(file, Convention.PTB).passed
    file = _write(tmp_path, "cone", points, ptb)
    assert verify_pair(file, Convention.PTB).passed
    wrong = verify_pair(file)
    assert wrong.direction == pytest.approx(np.pi)


def test_the_conventions_of_a_circle(tmp_path: Path) -> None:
    rng = np.random.default_rng(62)
    points = somewhere(rng).apply(ideal_points(Shape.CIRCLE, rng, 12, arc=3.0))
    points += rng.normal(0.0, 0.2, points.shape)
    two_steps, free = fit_circle(points), fit_circle_free(points)
    # Both are stationary: the free one is nearer to the points in space.
    assert _distance(points, free.geometry) < _distance(points, two_steps.geometry) * (1 - 1e-6)
    nist = np.array([*two_steps.point, *two_steps.direction, 2.0 * two_steps.radius])
    ptb = np.array([*free.point, *-free.direction, free.radius])
    assert verify_pair(_write(tmp_path, "circle", points, nist)).passed
    file = _write(tmp_path, "circle", points, ptb)
    assert verify_pair(file, Convention.PTB).passed
    assert not verify_pair(file).passed


def _distance(points: Points3, geometry: Float) -> float:
    arms = points - geometry[:3]
    along = arms @ geometry[3:6]
    rho = np.linalg.norm(arms - np.outer(along, geometry[3:6]), axis=1)
    return float(np.sum((rho - geometry[6]) ** 2 + along**2))


def test_a_wrong_result_and_points_without_a_fit_fail(tmp_path: Path) -> None:
    rng = np.random.default_rng(63)
    points = ideal_points(Shape.SPHERE, rng, 12)
    _write(tmp_path / "Sphere", "sph2", points, np.array([0.0, 0.0, 0.0, 2.0 * RADIUS]))
    _write(tmp_path / "Sphere", "sph10", points, np.array([0.0, 0.0, 2e-6, 2.0 * RADIUS]))
    flat = ideal_points(Shape.PLANE, rng, 12)
    _write(tmp_path / "Sphere", "sph11", flat, np.array([0.0, 0.0, 0.0, 1.0]))
    (report,) = verify_folder(tmp_path)
    assert [(r.name, r.passed) for r in report.results] == [
        ("sph2", True), ("sph10", False), ("sph11", False)
    ]  # fmt: skip
    assert report.worst("position") == pytest.approx(2e-6)
    assert report.results[2].failure.startswith("The points do not determine a sphere")
    assert not report.passed


def test_files_that_are_no_pairs_are_named(tmp_path: Path) -> None:
    for name, code in (("nothing", "verify.no_folder"), (".", "verify.no_pairs")):
        with pytest.raises(InputError) as caught:
            verify_folder(tmp_path / name)
        assert caught.value.code == code
    file = _write(tmp_path / "x", "sphere1", np.zeros((5, 3)), np.zeros(3))
    with pytest.raises(InputError, match=r"sphere1.fit: has 3 numbers; a sphere needs 4"):
        verify_pair(file)
    file.with_suffix(".fit").unlink()
    with pytest.raises(InputError, match=r"sphere1.fit: the certified result cannot be read"):
        verify_pair(file)
    with pytest.raises(InputError, match="neither its name nor that of its folder"):
        verify_pair(_write(tmp_path / "x", "gear", np.zeros((5, 3)), np.zeros(3)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.0 2.0\n", "line 1: '1.0 2.0' has 2 number"),
        ("# note\n1 2 3\n\n1 2 x\n", "line 4: 'x' is not a coordinate"),
        ("1;2;3\n1,5;2.5;3,512\n", "'3,512' in line 2 could mean two values"),
        ("1,500 2,500 3,500\n", "line 1: '1,500' could be 1.500 or 1500"),
        ("1,5,2,5,3,5\n", "has 6 numbers, and no heading names the columns"),
        ("5\n1 2 3\n", "declares 5 points, but 1 follow"),
        ("1 2 3\n1 2 nan\n", "'nan' is not a coordinate"),
        ("1 2 1e9\n", "has a coordinate of more than 10 km"),
        ("# nothing\n", "no points"),
    ],
)
def test_rows_that_are_no_points_are_named(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "points.txt"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_points_file(file)
    assert message in caught.value.what
    assert str(file) in caught.value.what


def test_points_may_be_written_in_several_ways(tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    for text in (
        "X,Y,Z\n1.5,-2,3e1\n4,5,6\n",
        "2\n1.5\t-2\t30.\n4 5 6\n",
        "\ufeff1.5; -2; 30\r\n\r\n4;5;6",
    ):
        file.write_text(text, encoding="utf-8")
        assert read_points_file(file).points.tolist() == [[1.5, -2.0, 30.0], [4.0, 5.0, 6.0]]
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not text in UTF-8"):
        read_points_file(file)


def test_the_readers_of_a_pair_account_for_all_they_leave_out(tmp_path: Path) -> None:
    (tmp_path / "plane1.ds").write_text("x[inch] y[inch] z[inch]\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n")
    result = tmp_path / "plane1.fit"
    result.write_text("# unit: mm\n0.5 0.5 0 0 0 1\n")
    with pytest.raises(InputError, match=r"plane1\.fit, line 1: the line states the unit mm"):
        verify_pair(tmp_path / "plane1.ds")
    result.write_text("# laboratory\npoint: 0.5 0.5 0\ndir 0 0 1\n")
    found = verify_pair(tmp_path / "plane1.ds")
    assert found.passed
    assert found.account is not None
    assert (found.account.taken, found.account.unit) == (4, "inch")
    assert found.left_out == ("# laboratory", "point", "dir")
