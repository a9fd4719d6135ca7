"""``ocmm fit`` and ``ocmm verify-fits`` as a stranger uses them."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_cli.study._fit_rows import FitFile
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Shape
from tests.commands import Ocmm
from tests.core.features.shape_samples import HALF_ANGLE, ideal_points


def _points(file: Path, shape: Shape, n: int = 20, outlier: float = 0.0) -> Path:
    rng = np.random.default_rng(71)
    points = ideal_points(shape, rng, n) + rng.normal(0.0, 0.002, (n, 3))
    points[4] *= 1.0 + outlier
    np.savetxt(file, points, fmt="%.6f")
    return file


def test_a_cone_with_an_outlier(ocmm_here: Ocmm, tmp_path: Path) -> None:
    file = _points(tmp_path / "cone.txt", Shape.CONE, outlier=0.02)
    done = ocmm_here("fit", file, "--shape", "cone")
    assert done.returncode == 0
    assert "20 rows read" in done.stderr
    angle = re.search(r"Full angle +([\d.]+) +([\d.]+) deg", done.stdout)
    assert angle is not None
    value, expanded = map(float, angle.groups())
    assert abs(value - np.degrees(2.0 * HALF_ANGLE)) < 2.0 * expanded < 5.0
    assert "Outlier: point 5 is" in done.stdout
    assert "Form (peak to valley)" in done.stdout


def test_the_table_states_what_u_is_and_why_there_is_none(ocmm_here: Ocmm, tmp_path: Path) -> None:
    done = ocmm_here("fit", _points(tmp_path / "c.txt", Shape.SPHERE, 6), "--shape", "sphere")
    assert done.returncode == 0
    assert "U (95 %)" in done.stdout
    # Two points more than a sphere needs: Student's 4.53 where many have 2.
    assert "2 degrees of freedom, k = 4.53" in done.stdout
    rng = np.random.default_rng(73)
    arc = ideal_points(Shape.ELLIPSE, rng, 9, np.radians(40.0)) + rng.normal(0.0, 0.002, (9, 3))
    np.savetxt(tmp_path / "arc.txt", arc, fmt="%.6f")
    done = ocmm_here("fit", tmp_path / "arc.txt", "--shape", "ellipse")
    assert done.returncode == 0
    assert re.search(r"Long axis +[\d.]+ +–", done.stdout)
    assert re.search(r"No U for .*Long axis.*: the points determine", done.stdout, re.DOTALL)


def test_json_has_all_digits_units_and_what_u_rests_on(ocmm_here: Ocmm, tmp_path: Path) -> None:
    file = _points(tmp_path / "cone.txt", Shape.CONE, 9, outlier=0.02)
    done = ocmm_here("fit", file, "--shape", "cone", "--json")
    assert done.returncode == 0
    found = msgspec.json.decode(done.stdout, type=FitFile)
    assert (found.schema, found.shape, found.criterion_letter) == ("ocmm.fit/1", "Cone", "G")
    assert (found.points, found.file_unit, found.rival) == (9, "mm", None)
    fit = fit_shape(Shape.CONE, np.loadtxt(file))
    numbers = {number.name: number for number in found.numbers}
    angle = numbers["full_angle"]
    assert angle.unit == "deg"
    # All digits of the doubles are given: the same fit except for rounding of reordered sums.
    assert angle.value[0] == pytest.approx(np.degrees(2.0 * fit.half_angle), rel=1e-12)
    own = angle.uncertainty
    assert own is not None
    assert own.U is not None
    assert own.k is not None
    assert own.degrees_of_freedom == pytest.approx(3.0)
    assert own.k * own.u == pytest.approx(own.U)
    assert own.first_order_valid
    assert len(numbers["axis"].value) == 3
    assert numbers["form"].uncertainty is None
    done = ocmm_here("fit", file, "--shape", "cone", "--criterion", "inscribed", "--json")
    assert (done.returncode, done.stdout) == (2, "")
    assert "cone.txt" in done.stderr


def test_a_circle_as_one_problem_and_what_goes_with_it(ocmm_here: Ocmm, tmp_path: Path) -> None:
    file = _points(tmp_path / "circle.txt", Shape.CIRCLE)
    done = ocmm_here("fit", file, "--shape", "circle", "--free")
    assert done.returncode == 0
    assert "one problem in space" in done.stdout
    assert "No outliers." in done.stdout
    done = ocmm_here("fit", file, "--shape", "plane", "--free")
    assert (done.returncode, done.stdout) == (2, "")
    assert "--free applies to circles" in done.stderr
    done = ocmm_here("fit", file, "--shape", "line")
    assert done.returncode == 2
    assert "circle.txt: The points do not determine a line" in done.stderr


def test_verify_fits_prints_a_table_and_fails_beyond_a_limit(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    folder = tmp_path / "pairs" / "Plane"
    folder.mkdir(parents=True)
    points = ideal_points(Shape.PLANE, np.random.default_rng(72), 9)
    np.savetxt(folder / "pln1.ds", points, header="9", comments="")
    assert ocmm_here("verify-fits", folder).returncode == 2
    for tilt, code, word in ((0.0, 0, "PASS"), (2e-8, 1, "FAIL")):
        certified = [0.0, 0.0, 0.0, tilt, 0.0, 1.0]
        np.savetxt(folder / "pln1.fit", certified, fmt="%.17g")
        done = ocmm_here("verify-fits", tmp_path / "pairs")
        assert done.returncode == code
        assert "in 1 of them" in done.stderr
        assert re.search(rf"Plane +1 .* {word}", done.stdout)
    assert "Plane/pln1: beyond a limit (position 0.0e+00, direction 2.0e-08)." in done.stdout


def test_verify_fits_prints_the_account_of_its_readers(tmp_path: Path, ocmm_here: Ocmm) -> None:
    rows = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
    (tmp_path / "plane1.ds").write_text("x[inch] y[inch] z[inch]\n" + rows)
    (tmp_path / "plane2.ds").write_text("4\n" + rows)
    for name in ("plane1", "plane2"):
        (tmp_path / f"{name}.fit").write_text("# laboratory\npoint: 0.5 0.5 0\ndir 0 0 1\n")
    done = ocmm_here("verify-fits", tmp_path)
    assert done.returncode == 0
    for words in (
        "4 rows read", "Unit inch, stated in line 1", "is the heading", "'# laboratory'",
        "all rows of 1 point files read as x, y, z; unit mm, assumed.", "points in 1 of them",
    ):  # fmt: skip
        assert words in " ".join(done.stderr.split())
