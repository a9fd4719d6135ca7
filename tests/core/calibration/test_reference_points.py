from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.cameras import KnownPoints, SpotTable, load_spots, read_reference_points
from ocmm_core.errors import InputError
from ocmm_core.tables import TableOptions
from tests.core.calibration.table_writers import write_reference_points, write_spots

pytestmark = pytest.mark.numerics

HEAD = "# ocmm reference points\n# unit: mm\n# uncertainty: 0.0017\n# frame: CMM\n"
SPOT_HEAD = "# ocmm spots\n# sigma: 0.0105\n"
SPOTS = SPOT_HEAD + "point,serial,u,v\n"
POINTS = KnownPoints(("A", "B"), np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), 0.0017, "CMM")


def points_of(tmp_path: Path, text: str, encoding: str = "utf-8") -> KnownPoints:
    path = tmp_path / "points.csv"
    path.write_bytes(text.encode(encoding))
    return read_reference_points(path).points


def spots_of(tmp_path: Path, text: str) -> SpotTable:
    path = tmp_path / "spots.csv"
    path.write_text(text, encoding="utf-8")
    return load_spots(path, POINTS)


@pytest.mark.parametrize(
    "text",
    [
        HEAD + "name,x,y,z\nA,1,2,3\nB,4,5,6\n",
        HEAD + "name;x;y;z\nA;1,0;2,0;3,0\nB;4.0;5.0;6.0\n",
        HEAD + "name\tx\ty\tz\r\nA\t1,0\t2\t3\r\n\r\nB\t4\t5\t6\r\n",
        HEAD + 'Z ; Y;X;"Name"\n3;2;1;"A"\n\n6;5;4;B\n;;;\n',
        "# unit: cm;;\n# frame: CMM;;\n# uncertainty: 0,00017;;\nname;x;y;z\n"
        "A;,1;,2;,3\nB;.4;.5;.6\n",
        "# Unit: m\n# FRAME: CMM\n# uncertainty: 1.7e-6\nname,x,y,z\nA,1e-3,2e-3,3e-3\n"
        "B,.004,.005,.006\n",
        "# unit: \u00b5m\n# frame: CMM\n# uncertainty: 1.7\nname,x,y,z\n"
        "A,1e3,2e3,3e3\nB,4e3,5e3,6e3",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_lists_of_many_programs_are_read_alike(tmp_path: Path, text: str, encoding: str) -> None:
    points = points_of(tmp_path, text, encoding)
    assert points.names == ("A", "B")
    assert np.allclose(points.positions_world, POINTS.positions_world, rtol=1e-15)
    assert points.sigma == pytest.approx(0.0017)
    assert points.frame == "CMM"


@pytest.mark.parametrize(
    ("rows", "options"),
    [
        ("Point ID;X-Koordinate;Y [mm];z\nA;1;2;3\nB;4;5;6\n", TableOptions()),
        ("Punkt;Y Ist;X Ist;Z Ist;X Soll;Y Soll;Z Soll\nA;2;1;3;0;0;0\nB;5;4;6;0;0;0\n",
         TableOptions()),
        ("name;Northing;Easting;Height;dev\nA;2;1;3;0,1\nB;5;4;6;0,1\n", TableOptions()),
        ("A;1;2;3\nB;4;5;6\n", TableOptions(columns="name,x,y,z")),
        ("name;x;y;z\nA;1,000;2,000;3,000\nB;4;5;6\n", TableOptions(decimal="comma")),
        ("name;x;y;z\nA;1;2;3\nB;4;5;6\nMean;2;3;4\n", TableOptions()),
        ("name;x;y;z;unit\nA;1;2;3;mm\nB;4;5;6;mm\n", TableOptions()),
        ("name;x;y;z\nX;9;9;9\nA;1;2;3\nB;4;5;6\n", TableOptions(skip="6-6")),
    ],
)  # fmt: skip
def test_headings_and_statements_give_the_columns(
    tmp_path: Path, rows: str, options: TableOptions
) -> None:
    path = tmp_path / "points.csv"
    path.write_text(HEAD + rows)
    read = read_reference_points(path, options)
    assert read.points.names == ("A", "B")
    assert read.points.positions_world.tolist() == POINTS.positions_world.tolist()
    assert read.account.unit_from in ("line 2", "each row")


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ("name;x;y;z;unit\nA;1;2;3;inch\n", "line 6: the unit inch contradicts"),
        ("name;x [in];y [in];z [in]\nA;1;2;3\n", "line 5: the unit inch contradicts"),
        ("P;X Soll;Y Soll;Z Soll\nA;1;2;3\n", "lack 'x'"),
        ("name;x;y;z\nA;1,234;2,345;3,456\n", "could be 1.234 or 1234"),
        ("A;1;2;3\n", "lack 'x'"),
    ],
)
def test_an_ambiguous_list_is_refused(tmp_path: Path, rows: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        points_of(tmp_path, HEAD + rows)


def test_a_stated_unit_replaces_that_of_the_header(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(HEAD + "x;y;z\n1,5;0;-2\n")
    read = read_reference_points(path, TableOptions(unit="inch"))
    assert read.points.positions_world.tolist() == [[38.1, 0.0, -50.8]]
    assert read.points.sigma == 0.04318
    assert "Unit inch, as you stated." in read.account.sentences()


def test_inches_and_points_without_names(tmp_path: Path) -> None:
    text = "# unit: inch\n# frame: CMM\n# uncertainty: 0\nx,y,z\n1,0,0\n0,-2,0\n"
    points = points_of(tmp_path, text)
    assert points.names == ("1", "2")
    assert points.positions_world.tolist() == [[25.4, 0.0, 0.0], [0.0, -50.8, 0.0]]
    assert points.sigma == 0.0
    assert points.length_sigma == 0.0


def test_length_uncertainty_is_a_ratio_in_every_unit(tmp_path: Path) -> None:
    text = "# unit: inch\n# uncertainty: 0\n# Length uncertainty: 3e-6\n# frame: CMM\n"
    assert points_of(tmp_path, text + "x,y,z\n1,0,0\n").length_sigma == 3e-6


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (HEAD.replace("# unit: mm\n", "") + "x,y,z\n1,2,3\n", "table.head", "'# unit: ...'"),
        (HEAD.replace("0.0017", "-1") + "x,y,z\n1,2,3\n", "table.value", "line 3"),
        (HEAD + "# length uncertainty: 3\nx,y,z\n1,2,3\n", "table.value", "line 5"),
        (HEAD + "# length uncertainty: -3e-6\nx,y,z\n1,2,3\n", "table.value", "line 5"),
        (HEAD.replace("0.0017", "2 um") + "x,y,z\n1,2,3\n", "table.number", "line 3"),
        (HEAD.replace("# frame: CMM\n", "") + "x,y,z\n1,2,3\n", "table.head", "frame"),
        (HEAD.replace("mm", "parsecs") + "x,y,z\n1,2,3\n", "unit.unknown", "'parsecs'"),
        (HEAD + "name,x,y\nA,1,2\n", "table.columns", "lack 'z'"),
        (HEAD + "x,y,z,x\n1,2,3,4\n", "table.columns", "'x' occurs twice"),
        (HEAD + "x,y,z\n1,2,3\n1,2\n", "table.cells", "line 7: there are 2 cells"),
        (HEAD + "x,y,z\n1,2,3\n1,2,three\n", "table.number", "line 7: column 'z' holds 'three'"),
        (HEAD + "x,y,z\n1,2,nan\n", "table.number", "line 6"),
        (HEAD + "x,y,z\n1,2,1_0\n", "table.number", "line 6"),
        (HEAD + "x;y;z\n1.234;2,5;3\n", "table.decimal", "line 6"),
        (HEAD + "x,y,z\n1,2,200000\n", "reference_points.unit", "line 6"),
        (HEAD + "name,x,y,z\nA,1,2,3\nA,4,5,6\n", "reference_points.name", "line 6 already"),
        (HEAD + "name,x,y,z\n,1,2,3\n", "reference_points.name", "line 6: the point has no name"),
        (HEAD + "x,y,z\n", "table.empty", "no rows"),
        ("", "table.empty", "no rows"),
    ],
)
def test_what_is_wrong_is_said_with_file_and_line(
    tmp_path: Path, text: str, code: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        points_of(tmp_path, text)
    assert caught.value.code == code
    assert words in caught.value.what
    assert "points.csv" in caught.value.what


def test_a_file_that_is_no_text_or_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not text in UTF-8") as caught:
        points_of(tmp_path, "# unit: \u00b5m", "utf-16-le")
    assert caught.value.code == "table.not_text"
    with pytest.raises(InputError, match="file not found"):
        read_reference_points(tmp_path / "elsewhere.csv")


def test_spots_are_sorted_to_points_and_cameras(tmp_path: Path) -> None:
    spots = spots_of(
        tmp_path,
        SPOT_HEAD + "serial;point;u;v;frames\n22;B;10,5;20,5;100\n11;B;3;4;100\n22;A;1;2;100\n",
    )
    assert spots.serials == (11, 22)
    assert spots.sigma_px == 0.0105
    assert np.isnan(spots.uv[0, 0]).all()
    assert spots.uv[0, 1].tolist() == [3.0, 4.0]
    assert spots.uv[1].tolist() == [[1.0, 2.0], [10.5, 20.5]]


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (SPOTS + "C,11,1,2\n", "spots.unknown_point", "line 4: the point 'C'"),
        (SPOTS + "A,left,1,2\n", "spots.serial", "line 4: 'left'"),
        (SPOTS + "A,0,1,2\n", "spots.serial", "line 4: '0'"),
        (
            SPOTS + "A,11,1,2\nB,11,1,2\nA,11,1,2\n",
            "spots.twice",
            "line 6: camera 11 and point 'A' occur in line 4 already",
        ),
        (SPOTS + "A,11,1,inf\n", "table.number", "line 4"),
        ("point,serial,u,v\nA,11,1,2\n", "table.head", "sigma"),
        (SPOTS.replace("0.0105", "0") + "A,11,1,2\n", "table.value", "line 2"),
    ],
)
def test_what_is_wrong_with_spots(tmp_path: Path, text: str, code: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        spots_of(tmp_path, text)
    assert caught.value.code == code
    assert words in caught.value.what
    assert "spots.csv" in caught.value.what


def test_what_is_written_is_read_bit_by_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    at = rng.standard_normal((2, 3)) * 100.0
    points = KnownPoints(("A", "B"), at, 0.1 / 3.0, "CMM bed", 1e-5 / 3.0)
    uv = rng.standard_normal((2, 2, 2)) * 1000.0
    uv[1, 0] = np.nan
    spots = SpotTable((11, 22), uv, 0.01 / 3.0)
    (tmp_path / "p.csv").write_bytes(write_reference_points(points))
    (tmp_path / "s.csv").write_bytes(write_spots(spots, points.names))
    back = read_reference_points(tmp_path / "p.csv").points
    assert back.names == points.names
    assert (back.sigma, back.frame) == (points.sigma, points.frame)
    assert back.length_sigma == points.length_sigma
    assert np.array_equal(back.positions_world, points.positions_world)
    there = load_spots(tmp_path / "s.csv", back)
    assert (there.serials, there.sigma_px) == (spots.serials, spots.sigma_px)
    assert np.array_equal(there.uv, spots.uv, equal_nan=True)
