"""Tables as programs of several countries write them: read right, or refused.

Three readers share one grammar: points, features of a plan, and reference points.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.cameras import read_reference_points
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.inspection.plan import feature_table
from ocmm_core.tables import TableOptions, read_points_file

POINTS = np.vstack(
    [[12.3456, 1234.5, -0.75], np.random.default_rng(7).uniform(-300, 3000, (7, 3)).round(4)]
)
SWAPPED = POINTS[:, [1, 0, 2]]


def de(value: float) -> str:
    return f"{value:.4f}".replace(".", ",")


def grouped(value: float, sign: str) -> str:
    return f"{value:,.4f}".replace(",", "_").replace(".", ",").replace("_", sign)


def table(
    heading: str = "X;Y;Z",
    number: Callable[[float], str] = de,
    points: Float = POINTS,
    sep: str = ";",
    **around: str,
) -> str:
    """Return a table; names are in front if the heading has four columns."""
    names = heading.split("\n")[-1].count(";") == 3
    rows = [
        sep.join(([f"P{place}"] if names else []) + [number(value) for value in row])
        for place, row in enumerate(points)
    ]
    return around.get("top", "") + "\n".join([heading.replace(";", sep), *rows]) + around.get(
        "end", ""
    )  # fmt: skip


HEADINGS = {
    "Punktnummer;Rechtswert;Hochwert;Höhe": (0, 1, 2),
    "Bezeichnung;Y-Wert [mm];X-Wert [mm];Z-Wert [mm]": (1, 0, 2),
    "Nom;X mesuré;Y mesuré;Z mesuré": (0, 1, 2), "Nom;Y mesuré;X mesuré;Z mesuré": (1, 0, 2),
    "N°;Coordonnée Y;Coordonnée X;Coordonnée Z": (1, 0, 2),
    "Repère;Y (mm);X (mm);Z (mm)": (1, 0, 2),
    "Nombre;Coordenada Y;Coordenada X;Coordenada Z": (1, 0, 2),
    "Punto;X medido;Y medido;Z medido": (0, 1, 2),
    "Nome;Coordinata Y;Coordinata X;Coordinata Z": (1, 0, 2), "点名;Y坐标;X坐标;Z坐标": (1, 0, 2),
    "序号;X(毫米);Y(毫米);Z(毫米)": (0, 1, 2), "番号;Y座標;X座標;Z座標": (1, 0, 2),
    "Точка;Y, мм;X, мм;Z, мм": (1, 0, 2),
    "Nazwa;Współrzędna Y;Współrzędna X;Współrzędna Z": (1, 0, 2),
    "Nord;Est;Altitude": (1, 0, 2), "Norte;Este;Cota": (1, 0, 2), "北;东;高": (1, 0, 2),
}  # fmt: skip
READ: dict[str, tuple[str | bytes, float]] = {
    "mark": (table().encode("utf-8-sig"), 1), "UTF-16": (table(sep="\t").encode("utf-16"), 1),
    "UTF-32": (table().encode("utf-32"), 1),
    "mixed line ends": (table().replace("\n", "\r\n", 2).replace("\n", "\r", 1), 1),
    "tabs at the ends": (table(sep="\t").replace("\n", "\t\n"), 1),
    "units below": (table("X;Y;Z\n[inch];[inch];[inch]"), 25.4),
    "units below names": (table("Name;X;Y;Z\n;µm;µm;µm"), 1e-3),
    "units below, old bytes": (table("Name;X;Y;Z\n;µm;µm;µm").encode("latin-1"), 1e-3),
    "units after a blank line": (table("X;Y;Z\n\n(m);(m);(m)"), 1e3),
    "groups by points": (table(number=lambda x: grouped(x, ".")), 1),
    "groups by thin blanks": (table(number=lambda x: grouped(x, "\u202f")), 1),
    "groups by apostrophes": (table(number=lambda x: grouped(x, "'")), 1),
    "groups by commas, quoted": (table(number=lambda x: f'"{x:,.4f}"', sep=","), 1),
    "powers": (table(number=lambda x: f"{x:.9E}".replace(".", ",")), 1),
    "powers by tabs": (table(number=lambda x: f"{x:.9e}".replace(".", ","), sep="\t"), 1),
    "quoted": (table(number=lambda x: f'"{de(x)}"'), 1),
    "quoted by apostrophes": (table(number=lambda x: f"'{x:.4f}'", sep=","), 1),
    "formula": (table(number=lambda x: f"={de(x)}"), 1),
    "formula of a text": (table(number=lambda x: f'="{de(x)}"'), 1),
    "text": (table(number=lambda x: f"'{de(x)}"), 1),
    "suffix": (table(number=lambda x: f"{de(x)} mm"), 1),
    "inch mark": (table(number=lambda x: f'{de(x)}"'), 25.4),
    "wide digits": (table(number=lambda x: f"{x:.4f}".translate(
        {ord(sign): ord(sign) + 0xFEE0 for sign in "0123456789.-"})), 1),
    "hard blanks": (table(number=lambda x: f"\u00a0{de(x)}\u00a0"), 1),
    "head with unit": (table(top="Gerät: KMG\nDatum: 28.11.2026\nEinheit: Zoll\n\n"), 25.4),
    "unit in a table above": (table(top="Unit;m\n"), 1e3),
    "unit in French": (table(top="Unités : pouces\n"), 25.4),
    "unit in Spanish": (table(top="Unidades: pulgadas\n"), 25.4),
    "unit in Chinese": (table(top="单位\N{FULLWIDTH COLON}英寸\n"), 25.4),
    "degrees": (table("Name;X;Y;Z", end="\n# Temperatur 20 °C").encode("latin-1"), 1),
    "bars": (table("| X | Y | Z |\n|---|---|---|", number=lambda x: f" {x:.4f} ", sep="|"), 1),
    "columns with their own unit": (table("x in inch;y in inch;z in inch"), 25.4),
    "hundredths": (table("X [1/100 mm];Y [1/100 mm];Z [1/100 mm]"), 0.01),
    "bytes of the Mac": (table("X [µm];Y [µm];Z [µm]").encode("mac-roman"), 1e-3),
    "a row taken out": (table(end="\n# 1,5;2,5;3,5\n").replace(
        de(POINTS[-1, 0]), f"# 1,5 2,5 3,5\n{de(POINTS[-1, 0])}"), 1),
    "empty line below each": (table().replace("\n", "\n\n"), 1),
    "scale of one": (table(top="Scale 1:1\n"), 1),
    "page number": (table(end="\n\nSeite 1 von 1"), 1),
    "count": (table(top="8\n"), 1),
    **{f"row {word}": (table("Name;X;Y;Z", end=f"\n{word};1,5;2,5;3,5"), 1) for word in (
        "Summe", "Mittelwert", "Moyenne", "Media", "平均值", "标准差", "Écart type", "Max.",
        "Maximalwert", "3 Sigma", "Durchschnitt", "среднее", "最大値", "Nennmaß")},
}  # fmt: skip
"""Text, and the unit in mm."""
CODES = [
    "NaN", "#NV", "#DIV/0!", "#WERT!", "n.a.", "n/a", "NULL", "-", "--", "∞", "1.#QNAN",
    "-nan(ind)", "?", "fehlt", "#N/A", "-9999", "9999", "-99999", "1e30", "***", "k.A.", "s/o",
    "无", "欠測", "99999,0000", "-999999,0000",
]  # fmt: skip
OTHERS: dict[str, str | bytes] = {
    "percent": table(number=lambda x: f"{de(x)}%"), "column twice": table("X;X;Y"),
    "two headings of one name": table("X;Y;Z;X"), "angles": table("X [°];Y [°];Z [mm]"),
    "geographic": table("Lat;Lon;Height"), "polar": table("R;Phi;Z"),
    "deviations": table("dX;dY;dZ"),
    "differences": table("ΔX;ΔY;ΔZ"), "pixels": table("X [px];Y [px];Z [px]"),
    "speeds": table("X [m/s];Y [m/s];Z [m/s]"), "areas": table("X [mm²];Y [mm²];Z [mm²]"),
    "unit of one": table("X;Y;Z [inch]"),
    "units that differ": table("X [mm];Y [mm];Z [mm]\ncm;cm;cm"),
    "nominal": table("X Soll;Y Soll;Z Soll"), "hexadecimal": "X;Y;Z\n" + "0x10;0x20;0x30\n" * 4,
    "limits below": table("Name;X;Y;Z", end="\nUT;0,1;0,1;0,1\nOT;0,2;0,2;0,2"),
    "mean in Finnish": table("Name;X;Y;Z", end="\nKeskiarvo;1,5;2,5;3,5"),
    "nominal row above": table("Name;X;Y;Z\nSollmaße;1,5;2,5;3,5"),
    "unit in old Chinese bytes": table(top="单位\N{FULLWIDTH COLON}英寸\n").encode("gbk"),
    "unit in old Russian bytes": table(top="Единица: дюйм\n").encode("cp1251"),
    "unit in old Japanese bytes": table(top="単位\N{FULLWIDTH COLON}インチ\n").encode("shift-jis"),
    "swapped in old Chinese bytes": table("点名;Y坐标;X坐标;Z坐标").encode("gbk"),
    "µm in bytes of DOS": table("X;Y;Z\nµm;µm;µm").encode("cp850"),
    "two tables": table(end="\n" + table("Y;X;Z", points=SWAPPED)),
    "two units": table(top="# unit: mm\n", end="\n# unit: inch\n1,5;2,5;3,5"),
    "inch below the first points": table(
        end="\n# unit: inch\n1,5;2,5;3,5\n2,5;2,5;3,5"),
    "sigmas below": table("Name;X;Y;Z", end="\n3s;1,5;2,5;3,5"),
    "mean below a line": table(end="\n-----\n1,5;2,5;3,5"),
    "size of a ball": table(top="# 25 mm\n"), "size in inch": table(top="# 0.5 inch\n"),
    "a row for each axis": "x 1.5 2.5 3.5\ny 4.5 5.5 6.5\nz 7.5 8.5 9.5\n",
    "rows marked": "x;y;z;valid\n" + "1,5;2,5;3,5;1\n" * 5 + "9,5;9,5;9,5;0\n",
    "two features": "Name;X;Y;Z\n" + "A;1,5;2,5;3,5\n" * 4 + "B;1,5;2,5;3,5\n" * 4,
    **{f"two sets, {name}": table(end=f"\n{line}\n1,5;2,5;3,5\n4,5;2,5;3,5") for name, line in {
        "comment": "# circle B", "NC comment": "; CIRC2", "stars": "***", "empty line": "",
        "empty lines": "\n"}.items()},
    "scale above": table(top="Scale 2:1\n"), "scale in German": table(top="Maßstab 1:2\n"),
    "remark": "x;y;z;note\n" + "1,5;2,5;3,5;\n" * 5 + "9,5;9,5;9,5;bad\n",
    "cut off": table()[:-3], "cut off at the sign": table(number=lambda x: f"{x:.4f}")[:-4],
    "grades and minutes": table("X;Y;Z\nmm;deg;mm"), "tolerances in cells": table(
        number=lambda x: f"{de(x)}±0,002"),
    "fractions": 'x;y;z\n1/2";1 1/4";2"\n1 1/2";1/4";3"\n2 1/2";3/4";1"\n',
    "lakhs": "x;y;z\n1,23,456.5;2.5;3.5\n1,23,457.5;2.5;3.75\n1,23,456.5;9.5;3.25\n",
    "minus behind": table(number=lambda x: de(abs(x)) + "-"),
    **{f"code {code}": table().replace(de(POINTS[3, 1]), code) for code in CODES},
}  # fmt: skip
"""Tables without one clear meaning."""


def points_of(folder: Path, content: str | bytes) -> Float:
    path = folder / "points.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_points_file(path).points


@pytest.mark.parametrize("heading", HEADINGS)
def test_headings_of_several_languages_name_the_columns(tmp_path: Path, heading: str) -> None:
    order = list(HEADINGS[heading])
    found = points_of(tmp_path, table(heading, points=POINTS[:, order]))
    np.testing.assert_allclose(found, POINTS, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", READ)
def test_dialects_with_one_meaning_are_read(tmp_path: Path, name: str) -> None:
    text, size = READ[name]
    np.testing.assert_allclose(points_of(tmp_path, text), POINTS * size, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("name", OTHERS)
def test_dialects_with_several_meanings_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as caught:
        points_of(tmp_path, OTHERS[name])
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("name", "top", "is_read"),
    [
        ("bore_inch.csv", "", False), ("scan_in.xyz", "", False), ("Teil-Zoll_v2.txt", "", False),
        ("boreInch.csv", "", False), ("scan_cm.csv", "", False), ("part(ft).asc", "", False),
        ("BOREINCH.csv", "", False), ("ball_1inch.csv", "", False),
        ("bore_inch.csv", "# unit: mm\n", False), ("points-mm.txt", "# unit: inch\n", False),
        ("points-mm.txt", "", True), ("bore_inch.csv", "# unit: inch\n", True),
        ("ball_1inch.csv", "# unit: mm\n", True), ("ball_25mm.csv", "# unit: inch\n", True),
        ("mm_to_inch.csv", "# unit: inch\n", True), ("in.csv", "", True),
        ("fit in part.csv", "", True), ("winch.csv", "", True), ("m.csv", "", True),
    ],
)  # fmt: skip
def test_the_name_of_a_file_may_not_contradict_its_unit(
    tmp_path: Path, name: str, top: str, is_read: bool
) -> None:
    path = tmp_path / name
    path.write_text(top + table())
    assert len(read_points_file(path, TableOptions(unit="mm")).points) == len(POINTS)
    if is_read:
        assert len(read_points_file(path).points) == len(POINTS)
        return
    with pytest.raises(InputError, match="the name of the file contains"):
        read_points_file(path)


def test_a_long_table_is_read_whole(tmp_path: Path) -> None:
    rows = np.arange(100_000)
    text = "X;Y;Z\n" + "\n".join(f"{row},5;{2 * row},25;{row % 7},125" for row in rows)
    wanted = np.column_stack([rows + 0.5, 2 * rows + 0.25, rows % 7 + 0.125])
    assert np.array_equal(points_of(tmp_path, text), wanted)


PLAN = "Name;Shape;X;Y;Z;Diameter;Side\n"
ROWS = "B1;Cylinder;12,5;1.234,5;-0,75;9,525;inner\nB2;Circle;-3,25;7,5;1,125;12,7;inner\n"
FEATURES = np.array([[12.5, 1234.5, -0.75, 9.525], [-3.25, 7.5, 1.125, 12.7]])


@pytest.mark.parametrize(
    ("text", "size"),
    [
        (PLAN + ROWS, 1), (PLAN + ";;[inch];[inch];[inch];[inch];\n" + ROWS, 25.4),
        (PLAN + "-;-;mm;mm;mm;mm;-\n" + ROWS, 1), ("# Einheit: Zoll\n" + PLAN + ROWS, 25.4),
        ((PLAN + ROWS).replace(";", "\t").replace("\tinner", "\t"), 1),
        (PLAN + ROWS.replace("12,5", "=12,5"), 1), (PLAN + ROWS.replace("12,5", '="12,5"'), 1),
        ("名称;Shape;X坐标;Y坐标;Z坐标;Diameter;Side\n" + ROWS, 1),
        (PLAN + ROWS + "Summe;;1,5;2,5;3,5;4,5;\n", 1), (PLAN + ROWS + ";;;;;;\n", 1),
        ("Name;Shape;X;Y;X;Diameter;Side\n" + ROWS, 0), (PLAN + ROWS.replace("12,5", "-9999"), 0),
        ("Name;Shape;X [mm];Y [mm];Z [mm];Diameter;Side\n;;inch;inch;inch;inch;\n" + ROWS, 0),
        (PLAN + ROWS.replace("12,5", "12,5%"), 0), (PLAN.replace("Diameter", "Radius") + ROWS, 0),
        (PLAN.replace(";X;", ";X*1000;") + ROWS, 0), ("Einheit: Zoll\n" + PLAN + ROWS, 0),
        (PLAN + ROWS.replace("12,5", "12,5 in"), 0), (PLAN + ROWS.replace("12,5", "NaN"), 0),
    ],
)  # fmt: skip
def test_tables_of_a_plan(tmp_path: Path, text: str, size: float) -> None:
    """Size 0: refused."""
    path = tmp_path / "plan.csv"
    path.write_text(text, encoding="utf-8")
    if size:
        found = [[*one.point, one.diameter] for one in feature_table(path).features]
        np.testing.assert_allclose(found, FEATURES * size, rtol=0, atol=1e-9)
    else:
        with pytest.raises(InputError):
            feature_table(path)


HEAD = "# unit: mm\n# uncertainty: 0.002\n# frame: CMM\n"


@pytest.mark.parametrize(
    ("text", "is_right"),
    [
        (table("Name;X;Y;Z"), True), (table("Name;X;Y;Z\n;mm;mm;mm"), True),
        (table("Nom;Coordonnée Y;Coordonnée X;Coordonnée Z", points=SWAPPED), True),
        (table("Name;X;Y;Z", number=lambda x: grouped(x, ".")), True),
        (table("Name;X;Y;Z", end="\n平均值;1,5;2,5;3,5"), True),
        (table("Name;X;Y;Z", end="\nKeskiarvo;1,5;2,5;3,5"), False),
        (table("Name;X;Y;Z\n;inch;inch;inch"), False), (table("Name;X [inch];Y;Z"), False),
        (table("Name;X;Y;Z", end="\nP9;-9999;1,5;2,5"), False),
        (table("Name;X Soll;Y Soll;Z Soll"), False), (table("Name;X;X;Z"), False),
    ],
)  # fmt: skip
def test_lists_of_reference_points(tmp_path: Path, text: str, is_right: bool) -> None:
    path = tmp_path / "reference.csv"
    path.write_text(HEAD + text, encoding="utf-8")
    if is_right:
        found = read_reference_points(path).points.positions_world
        np.testing.assert_allclose(found, POINTS, rtol=0, atol=1e-9)
    else:
        with pytest.raises(InputError):
            read_reference_points(path)
