"""Files of corrections for controls, read back by programs of others."""

from __future__ import annotations

import csv
import io
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_machine import (
    DIALECTS,
    CorrectionDocument,
    CorrectionLine,
    correction_file,
    load_corrections,
)
from tests.host import HANG_S, amount, needs_package, needs_tools
from tests.machine.cut_parts import NOON, document

INCH = 25.4
_FIRST, _WIDTH, _TURN = 5221, 20, 9
"""Parameters of LinuxCNC: X of G54, those of one work offset, and its rotation behind X."""


def _line(after: dict[str, float], **more: object) -> CorrectionLine:
    return CorrectionLine(
        utc=NOON.isoformat(), who="tester", software="", what="corrected", document="",
        before=dict.fromkeys(after, 0.0), after=after, expanded=dict.fromkeys(after, 0.002),
        **more,  # type: ignore[arg-type]
    )  # fmt: skip


def _work(folder: Path, number: int, resolution: float = 0.0001) -> CorrectionDocument:
    return document(
        folder,
        [{"name": axis, "kind": "work", "axis": axis, "number": number} for axis in "xyzc"],
        [{"characteristic": "A", "offsets": ["x"], "acts": "position", "direction": "+X"}],
        None, resolution=resolution,
    )  # fmt: skip


def _tools(folder: Path, **more: object) -> CorrectionDocument:
    return document(
        folder,
        [{"name": f"{kind} {register}", "kind": kind, "number": 3, "register": register, **more}
         for kind in ("length", "radius") for register in ("geometry", "wear")],
        [{"characteristic": "A", "offsets": ["length wear"], "acts": "position",
          "direction": "+Z"}],
    )  # fmt: skip


def _interpreted(folder: Path, text: bytes) -> dict[int, float]:
    """Return the parameters that the interpreter of LinuxCNC stores after a program."""
    (folder / "part.ngc").write_bytes(text)
    (folder / "tool.tbl").write_text("", encoding="ascii")
    stored = folder / "rs274.var"
    stored.write_text("5220 1\n", encoding="ascii")
    done = subprocess.run(
        ["rs274", "-g", "-t", "tool.tbl", "-v", stored.name, "part.ngc"],
        cwd=folder, capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr + done.stdout
    assert "PROGRAM_END" in done.stdout
    lines = stored.read_text(encoding="ascii").split("\n")
    return {int(name): float(value) for name, value in (line.split() for line in lines if line)}


def test_linuxcnc_reads_every_work_offset(tmp_path: Path) -> None:
    """1,000 random frames in the long form; its file has six decimals of an inch: 1.3e-5 mm."""
    needs_tools("rs274")
    rng = np.random.default_rng(46)
    worst = 0.0
    count = amount(50, 1000)
    for _ in range(count):
        number = int(rng.integers(1, 10))
        wanted = dict(zip("xyz", rng.uniform(-2000, 2000, 3).round(4).tolist(), strict=True))
        wanted["c"] = round(float(rng.uniform(-180, 180)), 4)
        some = {name: value for name, value in wanted.items() if rng.random() < 0.8}
        text = correction_file(
            _work(tmp_path, number), _line(some), "linuxcnc", practice=False
        )  # fmt: skip
        found = _interpreted(tmp_path, text)
        first = _FIRST + _WIDTH * (number - 1)
        for k, axis in enumerate("xyz"):
            error = abs(INCH * found.get(first + k, 0.0) - some.get(axis, 0.0))
            worst = max(worst, error)
            assert error <= 1.3e-5, (text, found)
        assert abs(found.get(first + _TURN, 0.0) - some.get("c", 0.0)) <= 1e-6
        others = [found.get(_FIRST + _WIDTH * (n - 1) + k, 0.0)
                  for n in range(1, 10) if n != number for k in range(10)]  # fmt: skip
        assert not any(others)
    print(f"{count} frames, worst {worst:.1e} mm")  # noqa: T201


def test_a_practice_file_changes_nothing(tmp_path: Path) -> None:
    needs_tools("rs274")
    wanted = {"x": 10.0, "y": 20.0, "z": -5.0, "c": 0.5}
    text = correction_file(_work(tmp_path, 1), _line(wanted), "linuxcnc", practice=True)
    # Comments only: the interpreter needs an end of the program to accept it at all.
    found = _interpreted(tmp_path, text + b"M2\n")
    assert not any(found.get(number, 0.0) for number in range(5221, 5390))


def _code(content: bytes) -> list[str]:
    """Return the lines that are no comments."""
    return [one for one in content.decode("ascii").split("\n") if one and one[0] not in "(;"]


WORK = {"x": -350.123, "y": -200.456, "z": -410.0}
TOOLS = {"length geometry": 100.5, "length wear": -0.012, "radius geometry": 5.0,
         "radius wear": -0.006}  # fmt: skip


@pytest.mark.parametrize(
    ("dialect", "number", "expected"),
    [
        ("linuxcnc", 1, ["G21 G90 G10 L2 P1 X-350.123", "G21 G90 G10 L2 P1 Y-200.456",
                         "G21 G90 G10 L2 P1 Z-410.000", "M2"]),
        ("fanuc", 6, ["G90 G10 L2 P6 X-350.123", "G90 G10 L2 P6 Y-200.456",
                      "G90 G10 L2 P6 Z-410.000", "M30"]),
        ("fanuc", 7, ["G90 G10 L20 P1 X-350.123", "G90 G10 L20 P1 Y-200.456",
                      "G90 G10 L20 P1 Z-410.000", "M30"]),
        ("siemens", 1, ["$P_UIFR[1,X,FI]=-350.123", "$P_UIFR[1,Y,FI]=-200.456",
                        "$P_UIFR[1,Z,FI]=-410.000", "M30"]),
    ],
)  # fmt: skip
def test_work_offsets(dialect: str, number: int, expected: Sequence[str], tmp_path: Path) -> None:
    found = correction_file(_work(tmp_path, number, 0.001), _line(WORK), dialect, practice=False)
    assert _code(found) == expected


@pytest.mark.parametrize(
    ("dialect", "expected"),
    [
        ("fanuc", ["G90 G10 L10 P3 R100.500", "G90 G10 L11 P3 R-0.012", "G90 G10 L12 P3 R5.000",
                   "G90 G10 L13 P3 R-0.006", "M30"]),
        ("siemens", ["$TC_DP3[3,1]=100.500", "$TC_DP12[3,1]=-0.012", "$TC_DP6[3,1]=5.000",
                     "$TC_DP15[3,1]=-0.006", "M30"]),
    ],
)  # fmt: skip
def test_tools(dialect: str, expected: Sequence[str], tmp_path: Path) -> None:
    assert _code(correction_file(_tools(tmp_path), _line(TOOLS), dialect, practice=False)) == [
        *expected
    ]


def test_turning_tools_of_fanuc(tmp_path: Path) -> None:
    lathe = document(
        tmp_path,
        [{"name": f"{kind} {register}", "kind": kind, "number": 3, "register": register}
         for kind in ("turn-x", "turn-z") for register in ("geometry", "wear")],
        [{"characteristic": "A", "offsets": ["turn-x wear"], "acts": "outer"}],
    )  # fmt: skip
    values = {"turn-x geometry": 80.0, "turn-x wear": -0.02, "turn-z geometry": 40.0,
              "turn-z wear": 0.01}  # fmt: skip
    found = _code(correction_file(lathe, _line(values), "fanuc", practice=False))
    assert found == ["G10 P10003 X80.000", "G10 P3 X-0.020", "G10 P10003 Z40.000",
                     "G10 P3 Z0.010", "M30"]  # fmt: skip
    for dialect in ("linuxcnc", "siemens", "heidenhain"):
        with pytest.raises(InputError, match="No public form"):
            correction_file(lathe, _line(values), dialect, practice=False)


def test_a_table_of_heidenhain_is_read_by_another_program(tmp_path: Path) -> None:
    content = correction_file(_tools(tmp_path), _line(TOOLS), "heidenhain", practice=False)
    assert content.decode("ascii").split("\n") == [
        "BEGIN OCMM.T MM", "T       L           DL          R           DR          ",
        "3       +100.500    -0.012      +5.000      -0.006      ", "[END]", "",
    ]  # fmt: skip
    needs_package("pyLSV2", "reads tables of Heidenhain")
    from pyLSV2.table_reader import NCTable  # type: ignore[import-not-found, import-untyped, unused-ignore]

    path = tmp_path / "ocmm.t"
    path.write_bytes(content)
    (row,) = NCTable.parse_table(path).rows
    assert {name: float(row[name]) for name in ("T", "L", "DL", "R", "DR")} == {
        "T": 3.0, "L": 100.5, "DL": -0.012, "R": 5.0, "DR": -0.006,
    }  # fmt: skip


@pytest.mark.parametrize(("counts", "diameter"), [("radius", "10.000"), ("diameter", "5.000")])
def test_measured_tools_are_assets_of_mtconnect(counts: str, diameter: str, tmp_path: Path) -> None:
    """Names and order of MTConnectAssets_1.3.xsd; wear has no place there."""
    values = {"length geometry": 100.5, "radius geometry": 5.0}
    tools = _tools(tmp_path, counts=counts)
    for practice in (False, True):
        content = correction_file(tools, _line(values), "mtconnect", practice=practice)
        root = etree.fromstring(content)
        space = {"m": "urn:mtconnect.org:MTConnectAssets:1.3"}
        assert [etree.QName(one).localname for one in root] == ["Header", "Assets"]
        (tool,) = root.iterfind("m:Assets/m:CuttingTool", space)
        assert (tool.get("toolId"), tool.get("serialNumber")) == ("T3", "T3")
        names = [
            etree.QName(one).localname for one in tool.iterfind("m:CuttingToolLifeCycle/*", space)
        ]
        assert names == ["CutterStatus", "ProgramToolNumber", "Measurements"]
        sizes = tool.iterfind("m:CuttingToolLifeCycle/m:Measurements/*", space)
        found = {one.get("code"): (one.get("units"), one.text or "") for one in sizes}
        texts = ("", "") if practice else ("100.500", diameter)
        assert found == {"LF": ("MILLIMETER", texts[0]), "DC": ("MILLIMETER", texts[1])}
        assert ("PRACTICE" in tool.findtext("m:Description", "", space)) is practice
    with pytest.raises(InputError, match="No public form"):
        correction_file(tools, _line({"length wear": 0.1}), "mtconnect", practice=False)


def test_what_is_not_certain_is_refused(tmp_path: Path) -> None:
    """Rotation of Fanuc, presets of Heidenhain, wear of LinuxCNC, diameters of Siemens."""
    turned = _line({"c": 0.05})
    for dialect in ("fanuc", "heidenhain"):
        with pytest.raises(InputError, match="No public form"):
            correction_file(_work(tmp_path, 1), turned, dialect, practice=False)
    for dialect, number in (("linuxcnc", 10), ("fanuc", 55), ("siemens", 100)):
        with pytest.raises(InputError, match="No public form"):
            correction_file(_work(tmp_path, number), _line(WORK), dialect, practice=False)
    with pytest.raises(InputError, match="No public form"):
        correction_file(_tools(tmp_path), _line({"length wear": 0.1}), "linuxcnc", practice=False)
    by_diameter = _tools(tmp_path, counts="diameter")
    for dialect in ("siemens", "heidenhain", "linuxcnc"):
        with pytest.raises(InputError, match="No public form"):
            correction_file(by_diameter, _line({"radius geometry": 5.0}), dialect, practice=False)
    with pytest.raises(InputError, match="not known"):
        correction_file(by_diameter, _line({}), "mazatrol", practice=False)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_hostile_names_stay_in_comments(dialect: str, tmp_path: Path) -> None:
    hostile = ") M30\nG10 L50 (\x1b;Größe"
    line = _line({"length geometry": 1.0}, job=hostile, serial=hostile)
    for practice in (False, True):
        content = correction_file(_tools(tmp_path), line, dialect, practice=practice)
        if dialect == "csv":
            (row,) = csv.DictReader(io.StringIO(content.decode("utf-8-sig"), newline=""))
            assert row["Job"].lstrip("'") == hostile
            assert row["New"] == ("" if practice else "1.000")
            continue
        if dialect == "mtconnect":
            (size,) = etree.fromstring(content).iterfind(".//{*}Measurements/{*}*")
            assert size.text == (None if practice else "1.000")
            continue
        code = _code(content)
        assert not any("L50" in one or "M30" in one for one in code[:-1])
        assert not practice or not code


def test_the_template_is_usable() -> None:
    template = load_corrections(resource("corrections", "mill.toml"))
    assert {one.kind for one in template.offset} == {"work", "radius"}
