"""Dialects of point files against a table of right answers: read right, or refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tables import TableOptions, read_points_file

T = TypeVar("T")
UNITS = {
    "mm": 1.0, "Millimeter": 1.0, "millimetres": 1.0, "cm": 10.0, "m": 1e3, "metres": 1e3,
    "µm": 1e-3, "\N{GREEK SMALL LETTER MU}m": 1e-3, "um": 1e-3, "microns": 1e-3, "inch": 25.4,
    "inches": 25.4, "in": 25.4, "Zoll": 25.4, '"': 25.4, "\N{DOUBLE PRIME}": 25.4, "pouces": 25.4,
    "pulgadas": 25.4, "mil": 0.0254, "thou": 0.0254, "ft": 304.8, "feet": 304.8,
    "0.001 inch": 0.0254, "1/100 mm": 0.01, "MM": 1.0, "INCH": 25.4,
}  # fmt: skip
"""mm of each; exact by definition, independent of the table of the product."""
PLACES = (
    "# unit: {}", "# Units are in {}", "Units: {}", "Einheit: {}", "UNITS/{},ANGDEC", "// [{}]",
    "! length unit = {}", "# all coordinates in {}", "{{}} [{}]", "{{}} ({})", "{{}}/{}", "row",
    "value",
)  # fmt: skip
HEADS = {
    "x y z": (0, 1, 2), "y x z": (1, 0, 2), "Z Y X": (2, 1, 0),
    "Northing Easting Height": (1, 0, 2),
    "X-Wert Y-Wert Z-Wert": (0, 1, 2), "name x y z": ("P", 0, 1, 2), "id y x z": ("#", 1, 0, 2),
    "x y z dev": (0, 1, 2, "d"), "name x y z i j k": ("P", 0, 1, 2, "n", "n", "n"),
    "i j k x y z": ("n", "n", "n", 0, 1, 2), "X_act Y_act Z_act": (0, 1, 2),
}  # fmt: skip
BARE = ((0, 1, 2), ("P", 0, 1, 2), (0, 1, 2, "P"), ("P", 0, 1, 2, "n", "n", "n"))
"""Columns that need no heading."""
EXTRA = ("", "mean", "std", "comment", "footer", "blank", "sep", "ends", "title", "date")


@dataclass(frozen=True, slots=True)
class _Dialect:
    text: bytes
    points: Float
    is_legitimate: bool
    words: str


def _dialect(rng: np.random.Generator) -> _Dialect:
    def one(choices: Sequence[T]) -> T:
        return choices[int(rng.integers(len(choices)))]

    points = rng.uniform(-300.0, 300.0, (int(rng.integers(4, 9)), 3))
    unit = one(("", *UNITS))
    size = UNITS.get(unit, 1.0)
    sep, comma = one((" ", "\t", ";", ",", ", ", "|")), bool(rng.integers(2))
    heading = one(("", "", *HEADS))
    place = one(PLACES)
    if not heading and ("{{}}" in place or place == "row"):
        place = "# unit: {}"
    extra = one(EXTRA)
    layout = HEADS[heading] if heading else one(BARE)

    def number(value: float, decimals: int = 7) -> str:
        text = f"{value:.{decimals}f}"
        return text.replace(".", ",") if comma else text

    def cell(row: int, of: object) -> str:
        if isinstance(of, int):
            bare = number(points[row, of] / size)
            return f"{bare} {unit}" if place == "value" and unit and not unit[0].isdigit() else bare
        return {"P": f"P{row}", "#": str(row + 1), "d": number(0.004), "n": number(0.6, 4)}[str(of)]

    rows = [[cell(row, of) for of in layout] for row in range(len(points))]
    for row in rows:
        if "n" in layout:
            first = layout.index("n")
            row[first : first + 3] = [number(value, 4) for value in (0.0, 0.6, 0.8)]
    lines = [sep.join(row) for row in rows]
    if heading:
        names = heading.split()
        if "{{}}" in place and unit:
            names = [
                place.format(unit).format(name) if isinstance(of, int) else name
                for name, of in zip(names, layout, strict=True)
            ]
        top = [sep.join(names)]
        if place == "row" and unit:
            top.append(sep.join(unit if isinstance(of, int) else "-" for of in layout))
        lines = top + lines
    if unit and place not in ("row", "value") and "{{}}" not in place:
        lines.insert(0, place.format(unit))
    elif unit and place == "value" and unit[0].isdigit():
        lines.insert(0, f"# unit: {unit}")
    mean = number(0.5)
    if extra in ("mean", "std") and "P" in layout:
        word = "Mean" if extra == "mean" else "Std"
        lines.append(sep.join(word if of == "P" else mean for of in layout))
    lines = {
        "comment": lambda: ["# measured in in-house lab 3", *lines, "# end of the unit test"],
        "footer": lambda: [*lines, "", "End"],
        "blank": lambda: [line for row in lines for line in (row, "")],
        "sep": lambda: [f"sep={sep}", *lines] if sep in (";", ",") else lines,
        "ends": lambda: [f"{line};;" for line in lines] if sep == ";" else lines,
        "title": lambda: ["Bracket 7 of the first batch", *lines],
        "date": lambda: ["# date: 2026-11-28", *lines],
    }.get(extra, lambda: lines)()
    code = one(("utf-8", "utf-8-sig", "utf-16"))
    text = one(("\n", "\r\n")).join([*lines, ""])
    # 1,5,2,5 cannot be separated: such a file is invalid.
    legitimate = not (comma and sep.strip() == ",")
    return _Dialect(
        text.encode(code), points, legitimate, f"{unit} {place} {heading} {sep!r} {extra}"
    )


def test_dialects_are_read_right_or_refused(
    tmp_path: Path, repeats: Callable[..., int], record_property: Callable[[str, object], None]
) -> None:
    rng = np.random.default_rng(37)
    file = tmp_path / "points.txt"
    wrong: list[str] = []
    read = legitimate = 0
    for _ in range(repeats(600, 10_000)):
        made = _dialect(rng)
        file.write_bytes(made.text)
        legitimate += made.is_legitimate
        try:
            found = read_points_file(file).points
        except InputError:
            continue
        read += made.is_legitimate
        same = found.shape == made.points.shape and np.allclose(found, made.points, atol=2e-4)
        if not same:
            wrong.append(f"{made.words}: {made.text[:200]!r}")
    record_property("read", f"{read} of {legitimate} legitimate dialects")
    assert wrong == []
    # The rest is ambiguous by accident, e.g. all numbers have three decimals.
    assert read >= 0.9 * legitimate


REFUSED = (
    "units: furlongs\n1.5 2 3\n4 5 6\n",
    "x [cubit] y [cubit] z [cubit]\n1.5 2 3\n4 5 6\n",
    "# unit: mm or inch\n1.5 2 3\n4 5 6\n",
    "# unit: mm\nx [in],y [in],z [in]\n1.5,2,3\n",
    "# unit: M\n1.5 2 3\n",
    "# probe radius in inches\n1.5 2 3\n4 5 6\n",
    "1,234;2,345;3,456\n4,567;5,678;6,789\n",
    "1.5;2,345;3.5\n4.5;5.5;6.5\n",
    "5 1.5 2 3\n7 1 2 4.5\n",
    "0 1.5 2.5\n1 1.5 4.5\n2 2.5 3.5\n",
    "x nom;y nom;z nom;x act;y act;z act\n1;2;3;1;2;3.5\n",
    "x;y;x;z\n1;2;3;4\n",
    "x y\n1.5 2\n3 4\n",
    "r phi z\n1.5 2 3\n4 5 6\n",
    "1.5 2 3\ny x z\n4 5 6\n",
    "1.5 2 3\n4 5\n6 7 8\n",
    "1.5 2 3\nnan nan nan\n4 5 6\n",
    "1.5 2 3\n**** **** ****\n4 5 **\n",
    "ncols 3\nnrows 2\n1.5 2 3\n4 5 6\n",
    "# scale: 25.4\n1.5 2 3\n",
    "1.5,2,5,3,5,1\n1,5,2,5,3,5\n",
    "x_m y_m z_m\n1.5 2 3\n",
    "# rho theta z\n1.5 2 3\n",
    "Rotor;Blatt;Lage\n1.5;2;3\n",
    "lat lon h\n1.5 2 3\n",
    "X1 Y1 Z1\n1.5 2 3\n",
    "1.5 mm 2 in 3 mm\n",
    "12\n1.5 2 3\n",
)


@pytest.mark.parametrize("text", REFUSED)
def test_ambiguous_files_are_refused_with_a_remedy(tmp_path: Path, text: str) -> None:
    file = tmp_path / "points.txt"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_points_file(file)
    assert str(file) in caught.value.what
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("text", "options", "first"),
    [
        ("units: furlongs\n1.5 2 3\n", TableOptions(unit="inch"), (38.1, 50.8, 76.2)),
        ("1,234;2,345;3,456\n", TableOptions(decimal="comma"), (1.234, 2.345, 3.456)),
        ("1,234;2,345;3,456\n", TableOptions(decimal="point"), (1234.0, 2345.0, 3456.0)),
        ("5 1.5 2 3\n7 1 2 4.5\n", TableOptions(columns="name,x,y,z"), (1.5, 2.0, 3.0)),
        ("5 1.5 2 3\n7 1 2 4.5\n", TableOptions(columns="z,y,x,-"), (2.0, 1.5, 5.0)),
        (
            "x nom;y nom;z nom;x act;y act;z act\n1;2;3;1;2;3.5\n",
            TableOptions(columns="-,-,-,x,y,z"),
            (1.0, 2.0, 3.5),
        ),
        ("junk 1 2\n9 9 9\n1.5 2 3\n", TableOptions(skip="2"), (1.5, 2.0, 3.0)),
        ("1.5 2 3\n9 9\n", TableOptions(skip="2-2"), (1.5, 2.0, 3.0)),
    ],
)
def test_options_settle_ambiguities(
    tmp_path: Path, text: str, options: TableOptions, first: tuple[float, ...]
) -> None:
    file = tmp_path / "points.txt"
    file.write_text(text)
    assert read_points_file(file, options).points[0] == pytest.approx(first)


@pytest.mark.parametrize(
    "options",
    [
        TableOptions(unit="furlong"),
        TableOptions(decimal="dot"),
        TableOptions(columns="x,y"),
        TableOptions(columns="x,y,z,q"),
        TableOptions(columns="x,y,z,-"),
        TableOptions(skip="a"),
    ],
)
def test_bad_options_are_refused(tmp_path: Path, options: TableOptions) -> None:
    file = tmp_path / "points.txt"
    file.write_text("1.5 2 3\n")
    with pytest.raises(InputError):
        read_points_file(file, options)


def test_every_line_is_in_the_account(tmp_path: Path) -> None:
    file = tmp_path / "points.txt"
    lines = ["Batch", "# unit: mm", "name x y z dev", "P1 1.5 2 3 0", "", "# P9 4 5 6 1",
             "P2 4 5 6 1", "Mean 2 3 4 0", "End"]  # fmt: skip
    file.write_text("\n".join(lines))
    account = read_points_file(file, TableOptions(skip="0-0")).account
    out = {line for one in account.skipped for line in range(one.first, one.last + 1)}
    assert out == {1, 2, 3, 6, 8, 9}
    assert account.taken == 2
    assert [one.role for one in account.columns] == ["name", "x", "y", "z", ""]
    words = " ".join(account.sentences())
    for part in ("Columns left out: 'dev'", "Unit mm, stated in line 2", "Line 8 left out"):
        assert part in words


@pytest.mark.parametrize(
    ("head", "mm"),
    [("# All dimensions INCH\n", None), ("# All dimensions INCH\n# unit: mm\n", 1.5),
     ("# All dimensions INCH\nX [mm];Y [mm];Z [mm]\n", 1.5), ("# 2 inch stem\n", 1.5),
     ("单位: 英寸\n点号;X;Y;Z\n7;", 38.1), ("番号;X座標(mm);Y座標(mm);Z座標(mm)\n7;", 1.5)],
)  # fmt: skip
def test_a_mentioned_unit_counts_without_a_stated_one(
    tmp_path: Path, head: str, mm: float | None
) -> None:
    file = tmp_path / "points.txt"
    file.write_text(f"{head}1.5;2.25;3.125\n", encoding="utf-8")
    if mm is None:
        with pytest.raises(InputError, match="line 1: 'All dimensions INCH' is not a clear unit"):
            read_points_file(file)
    else:
        assert read_points_file(file).points[0, 0] == mm


CASES = {
    "control.txt": (100.0, 200.0, 10.0), "feet.txt": (100.0, 200.0, 10.0),
    "micron.txt": (100.0, 200.0, 10.0), "micrometer.txt": (100.0, 200.0, 10.0),
    "mil.txt": (100.0, 200.0, 10.0), "inch_mark.txt": (100.0, 200.0, 10.0),
    "dmis.txt": (100.0, 200.0, 10.0), "zoll.txt": (100.0, 200.0, 10.0),
    "prose_mm.txt": (100.0, 200.0, 10.0), "prose_lab.txt": (100.0, 200.0, 10.0),
    "yxz.txt": (100.0, 200.0, 10.0), "northing.csv": (100.0, 200.0, 10.0), "id_x_y.csv": None,
    "profile_decimal_comma.txt": None, "deviation_column.txt": (3.5, 10.0, 5.0),
    "mesh.obj": (0.0, 0.0, 0.0), "summary_rows.txt": (0.0, 0.0, 0.0),
    "unicode_minus.txt": (-1.01016, 1.01016, 0.0), "apostrophe_thousands.txt": (999.0, 1.0, 5.0),
    "comma_thousands.csv": (2000.0, 1.0, 5.0),
}  # fmt: skip
"""Centroids, mm; None for files that are refused."""


def test_cases_from_outside(reference: Path) -> None:
    folder = reference.parent / "cases" / "points"
    for name, centre in CASES.items():
        if centre is None:
            with pytest.raises(InputError):
                read_points_file(folder / name)
        else:
            # The noise is 0.002 mm, its mean below 0.01; the points are evenly spread.
            found = read_points_file(folder / name).points.mean(axis=0)
            assert found == pytest.approx(centre, abs=0.01), name
