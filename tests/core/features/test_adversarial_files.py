"""Reference pairs as strangers write them: headings, units, codes, endings, and other readings."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.features.measured import Convention, verify_folder
from ocmm_core.features.measured._verify import verify_pair
from ocmm_core.features.shapes import Criterion, Shape, read_points_file
from tests.core.features.shape_samples import HALF_ANGLE, RADIUS, ideal_points, somewhere

RNG = np.random.default_rng(5)
MOTION = somewhere(RNG)
POINTS = MOTION.apply(ideal_points(Shape.CYLINDER, RNG, 12))
PLACE, AXIS = MOTION.translation, MOTION.rotation[:, 2]


def _rows(scale: float = 1.0, between: str = " ", form: str = "%.17g") -> str:
    return "\n".join(between.join(form % (scale * x) for x in row) for row in POINTS)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        (_rows(between="\t").replace("\n", "\r\n"), "mm"),
        ("12 3\n" + _rows(between=" , ", form="%.17E") + "\nEND\n", "mm"),
        ("12 points\n" + _rows(form="%.17e").replace("e", "D"), "mm"),
        ("Cylinder 7 of the set\n% x y z\n" + _rows(), "mm"),
        ("Units: inches\nX Y Z\n" + _rows(1.0 / 25.4, "; "), "inch"),
        ("x[m],y[m],z[m]\n" + _rows(1e-3, ","), "m"),
        ("# all values in um\n" + _rows(1e3), "µm"),
        ("\n".join(f"P{i} {row} ! note" for i, row in enumerate(_rows().split("\n"))), "mm"),
        (
            "no,x,y,z\n"
            + "\n".join(f"{i}, {row}" for i, row in enumerate(_rows(between=",").split())),
            "mm",
        ),
        ("\n".join(f"{row} 0 0.6 0.8" for row in _rows().split("\n")), "mm"),
    ],
)
def test_points_of_strangers(tmp_path: Path, text: str, unit: str) -> None:
    for code in ("utf-8", "utf-16"):
        (tmp_path / "p.txt").write_bytes(text.encode(code))
        held = read_points_file(tmp_path / "p.txt")
        assert held.unit.removesuffix("es") == unit
        assert held.points == pytest.approx(POINTS, rel=1e-14)


def test_what_could_be_several_things_is_refused(tmp_path: Path) -> None:
    for text in (
        "0 1.5 2 3\n1 1 2 4\n",
        "5 1 2 3\n7 1 2 4\n",
        "1 2 3 4 5 6\n",
        "1 2 3\nword\n4 5 6\n",
        "a 1 2 3\n4 5 6\n",
    ):
        (tmp_path / "p.txt").write_text(text)
        with pytest.raises(InputError, match="line"):
            read_points_file(tmp_path / "p.txt")


def _pair(folder: Path, name: str, rows: str, certified: Iterable[float] | str) -> Path:
    (folder / name).write_text(rows)
    if not isinstance(certified, str):
        certified = "\n".join(repr(float(number)) for number in certified)
    (folder / name).with_suffix(".FIT").write_text(certified)
    return folder / name


def test_certified_numbers_in_other_readings(tmp_path: Path) -> None:
    _pair(tmp_path, "cyl1.DS", _rows(), [*PLACE + 700.0 * AXIS, *-2.0 * AXIS, 2.0 * RADIUS])
    _pair(tmp_path, "cyl2.csv", _rows(between=","), [*PLACE, *AXIS, RADIUS])
    inch = [*PLACE / 25.4, *AXIS, 2.0 * RADIUS / 25.4]
    _pair(tmp_path, "cyl3.txt", "unit: inch\n" + _rows(1.0 / 25.4), inch)
    words = "Point: {} {} {}\nAxis = ({}, {}, {})  # unit\nDiameter {} mm"
    _pair(tmp_path, "cyl4.ds", _rows(), words.format(*PLACE, *AXIS, 2.0 * RADIUS))
    _pair(tmp_path, "cyl5.ds", _rows(), [*PLACE, *AXIS, 2.0 * RADIUS + 2e-6])
    (report,) = verify_folder(tmp_path, Convention.ANY)
    assert [result.passed for result in report.results] == [True] * 4 + [False]
    assert [result.reading for result in report.results] == ["", "radius", "", "", ""]
    assert not verify_pair(tmp_path / "cyl2.csv").passed


def test_a_cone_with_half_its_angle_and_the_other_sense(tmp_path: Path) -> None:
    points = MOTION.apply(ideal_points(Shape.CONE, np.random.default_rng(6), 12))
    rows = "\n".join(" ".join(repr(float(x)) for x in row) for row in points)
    file = _pair(tmp_path, "cone.ds", rows, [*PLACE, *-AXIS, RADIUS, np.degrees(HALF_ANGLE)])
    found = verify_pair(file, Convention.ANY)
    assert found.passed
    assert "falling" in found.reading
    assert "half angle" in found.reading
    file = _pair(tmp_path, "cone.ds", rows, [*PLACE, *AXIS, RADIUS, np.degrees(HALF_ANGLE) + 2e-6])
    assert not verify_pair(file, Convention.ANY).passed


def test_the_form_of_a_zone_is_compared(tmp_path: Path) -> None:
    rows = "0 0 1\n30 0 0\n0 30 0\n-30 -30 0\n5 5 0.9\n1 -2 0.7\n"
    for form, passed in ((1.0, True), (1.0 + 2e-6, False)):
        file = _pair(tmp_path, "plane.ds", rows, [0.0, 0.0, 0.5, 0.0, 0.0, 1.0, form])
        found = verify_pair(file, Convention.ANY, Criterion.MINIMUM_ZONE)
        assert found.passed is passed, found
