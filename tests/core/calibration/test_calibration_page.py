"""The page about calibration agrees with the program."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.core import TyperGroup

from ocmm_cli._app import _BUILT
from ocmm_core.calibration.cameras import load_spots, read_reference_points

_ROOT = Path(__file__).resolve().parents[3]
_PAGE = _ROOT / "docs" / "technician" / "calibration.md"
_MODULES = ("_guards", "_network", "_model_fit", "_procedure_known_points")


def test_every_reason_to_refuse_a_calibration_has_its_row() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    found = re.search(r"<!-- codes:[^\n]*-->\n(.*?)\n<!-- end of codes -->", page, re.DOTALL)
    assert found is not None
    said = re.findall(r"^\| `(\S+)` \|", found[1], re.MULTILINE)
    folder = _ROOT / "ocmm_core" / "calibration" / "cameras"
    source = "".join((folder / f"{name}.py").read_text(encoding="utf-8") for name in _MODULES)
    # Codes are single words in quotation marks; comparisons contain them as well.
    assert sorted(said) == sorted(set(re.findall(r'"(calibration\.\w+)"', source)))


def test_the_files_on_the_page_are_read(tmp_path: Path) -> None:
    page = _PAGE.read_text(encoding="utf-8")
    points_text, spots_text = re.findall(r"```\n(# ocmm .*?)```", page, re.DOTALL)[:2]
    (tmp_path / "points.csv").write_text(points_text, encoding="utf-8")
    (tmp_path / "spots.csv").write_text(spots_text, encoding="utf-8")
    points = read_reference_points(tmp_path / "points.csv").points
    assert points.positions_world[1].tolist() == [-150.0, -100.0, -200.0]
    assert points.sigma == pytest.approx(0.0017)
    assert points.length_sigma == 3e-6
    assert load_spots(tmp_path / "spots.csv", points).serials == (20330001,)


def test_what_the_page_tells_to_type_is_understood() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    group = _BUILT["calibrate"]
    assert isinstance(group, TyperGroup)
    lines = re.findall(r"^ocmm calibrate (\S+) (.*)$", page, re.MULTILINE)
    assert {name for name, _ in lines} == {"cameras", "relocate", "verify"}
    for name, rest in lines:
        known = {text for one in group.commands[name].params for text in one.opts}
        assert set(re.findall(r"--\S+", rest)) <= known, name


def test_what_the_page_points_to_exists() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+)\)", page):
        assert (_PAGE.parent / link).exists(), link
    for name in set(re.findall(r"(?:tests|benchmarks)/[\w/]*\.py", page)):
        assert (_ROOT / name).is_file(), name
