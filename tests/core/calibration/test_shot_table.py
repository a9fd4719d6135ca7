"""Recorded shots as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.guided import Shot, load_shots
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tables import TableOptions
from tests.core.calibration.table_writers import write_shots

RIG = load_rig(resource("rigs", "recommended.toml"))
LEFT = RIG.cameras[0].serial

HEAD = "# ocmm shots\n# sigma: 0.0105\nshot,kind,place,serial,led,u,v\n"


def test_shots_come_back_as_they_were_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    pose = rng.uniform(0.0, 2000.0, (2, 6, 2))
    pose[1, 3] = np.nan
    bar = rng.uniform(0.0, 2000.0, (2, 2, 2))
    shots = [Shot("pose", "", pose, 0.0105), Shot("bar", "", bar, 0.0105),
             Shot("seat", "N1", pose + 1.0, 0.0105)]  # fmt: skip
    path = tmp_path / "shots.csv"
    path.write_bytes(write_shots(shots, RIG))
    found = load_shots(path, RIG, 6).shots
    assert [(one.kind, one.place, one.sigma_px) for one in found] == [
        ("pose", "", 0.0105), ("bar", "", 0.0105), ("seat", "N1", 0.0105)
    ]  # fmt: skip
    for one, other in zip(found, shots, strict=True):
        assert np.array_equal(one.uv, other.uv, equal_nan=True)


def test_decimal_commas_are_read(tmp_path: Path) -> None:
    path = tmp_path / "shots.csv"
    text = HEAD.replace(",", ";").replace("0.0105", "0,0105") + f"1;pose;;{LEFT};2;10,5;20,25\n"
    path.write_text(text, encoding="utf-8")
    (shot,) = load_shots(path, RIG, 6).shots
    assert shot.sigma_px == pytest.approx(0.0105)
    assert shot.uv[0, 1].tolist() == [10.5, 20.25]


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (f"1,pose,,{LEFT},7,1,2", "there is no LED '7'"),
        (f"1,pose,,{LEFT},0,1,2", "there is no LED '0'"),
        (f"1,bar,,{LEFT},3,1,2", "there is no LED '3'"),
        (f"1,wave,,{LEFT},1,1,2", "'wave' is not a kind of shot"),
        ("1,pose,,77,1,1,2", "has no camera '77'"),
        (f"1,pose,,{LEFT},1,one,2", "not a number"),
    ],
)
def test_a_wrong_row_is_named(tmp_path: Path, row: str, said: str) -> None:
    path = tmp_path / "shots.csv"
    path.write_text(HEAD + row + "\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_shots(path, RIG, 6)
    assert said in caught.value.what
    assert "line 4" in caught.value.what


def test_rows_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "shots.csv"
    row = f"1,pose,,{LEFT},1,1,2\n"
    path.write_text(HEAD + row + row, encoding="utf-8")
    with pytest.raises(InputError, match="occurs already"):
        load_shots(path, RIG, 6)
    path.write_text(HEAD + row + row.replace("pose", "nest"), encoding="utf-8")
    with pytest.raises(InputError, match="another kind"):
        load_shots(path, RIG, 6)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("u,v\n", "u [mm],v [mm]\n"),
        ("u,v\n", "u (inch),v\n"),
        ("# sigma", "# unit: mm\n# sigma"),
        ("# sigma", "# Units are in mm\n# sigma"),
        ("# sigma: 0.0105", "# sigma: 0.0105 mm"),
        ("# sigma: 0.0105", "# sigma: -1"),
    ],
)
def test_refuses_spots_that_are_not_in_pixels(tmp_path: Path, old: str, new: str) -> None:
    path = tmp_path / "shots.csv"
    text = f"{HEAD}1,pose,,{LEFT},1,1.5,2\n"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"line \d"):
        load_shots(path, RIG, 6)
    path.write_text(text.replace("u,v", "u [px],v [Pixel]", 1), encoding="utf-8")
    assert load_shots(path, RIG, 6).shots[0].uv[0, 0].tolist() == [1.5, 2.0]


def test_columns_decimal_sign_and_lines_can_be_stated(tmp_path: Path) -> None:
    """The account has all lines and columns that are not read."""
    path = tmp_path / "shots.csv"
    path.write_text(
        f"# sigma: 0.01\nNr;Art;Ort;Kamera;LED;X;Y;Note\n1;pose;;{LEFT};2;1,250;2,500;a\n2;test\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="lack"):
        load_shots(path, RIG, 6)
    stated = TableOptions("", "shot,kind,place,serial,led,u,v,-", "comma", "4-4")
    found = load_shots(path, RIG, 6, stated)
    assert found.shots[0].uv[0, 1].tolist() == [1.25, 2.5]
    words = " ".join(found.account.sentences())
    assert "Columns left out: 'Note'" in words
    assert "Line 4 left out: skipped as stated" in words
    assert "Unit px, by the kind of table." in words
