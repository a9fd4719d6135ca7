"""Wrong or malicious templates: reported with line and field, and never printed."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_core.errors import InputError
from ocmm_core.export.template import Particulars, headed_paper, keep_given, load_paper
from ocmm_core.settings import SettingsFile, SettingsStore

TEMPLATE = """schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
title = "Test report"
statements = ["One."]
[laboratory]
name = "Laboratory"
logo = "logo.png"
country = "DE"
[machine]
serial = "0001"
"""
PNG = b"\x89PNG\r\n\x1a\n" + b"0" * 64


def _written(folder: Path, text: str = TEMPLATE) -> Path:
    (folder / "logo.png").write_bytes(PNG)
    path = folder / "lab.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "line", "field"),
    [
        ('country = "DE"', 'country = "Germany"', 9, "laboratory.country"),
        ('name = "Laboratory"', "name = 7", 7, "laboratory.name"),
        ('serial = "0001"', "serial = 1", 11, "machine.serial"),
        ('serial = "0001"', 'number = "1"', 11, "machine.number"),
        ('title = "Test report"', 'titel = "Test report"', 4, "titel"),
        ('statements = ["One."]', "statements = [1]", 5, "statements"),
        ('statements = ["One."]', f'statements = ["{"x" * 10_000}"]', 5, "statements"),
        ('statements = ["One."]', 'sections = ["results"]', 5, "sections"),
        ('logo = "logo.png"', 'logo = "../../../etc/passwd"', 8, "laboratory.logo"),
        ('logo = "logo.png"', 'logo = "gone.png"', 8, "laboratory.logo"),
        ('logo = "logo.png"', 'logo = "lab.toml"', 8, "laboratory.logo"),
        ("[machine]", "[machines]", 10, "machines"),
    ],
)
def test_a_fault_names_the_line_and_the_field(
    tmp_path: Path, old: str, new: str, line: int, field: str
) -> None:
    assert old in TEMPLATE
    path = _written(tmp_path, TEMPLATE.replace(old, new))
    with pytest.raises(InputError) as caught:
        load_paper(path)
    assert f"lab.toml, line {line}: field '{field}' " in caught.value.what
    assert caught.value.remedy
    assert len(caught.value.what) < 600


def test_what_is_no_toml_is_told_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 4"):
        load_paper(_written(tmp_path, TEMPLATE.replace('title = "Test report"', "title = ")))


def test_a_field_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="field 'name' is missing"):
        load_paper(_written(tmp_path, TEMPLATE.replace('name = "lab"\n', "")))


def test_a_logo_that_is_too_large_is_refused(tmp_path: Path) -> None:
    path = _written(tmp_path)
    (tmp_path / "logo.png").write_bytes(PNG + bytes(3_000_000))
    with pytest.raises(InputError, match=r"line 8: field 'laboratory\.logo'"):
        load_paper(path)


def test_a_customer_of_10_000_characters_is_refused_before_a_page_is_made(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'customer' is too long"):
        keep_given(tmp_path / "A.ocmm", Particulars(customer="x" * 10_000))


def test_a_preview_changes_no_template_of_the_station(tmp_path: Path) -> None:
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "user.toml"), {}
    )
    path = _written(tmp_path)
    store.change({"report.template": path, "report.laboratory": "The name of the settings"})
    before = sorted(one for one in tmp_path.rglob("*"))
    paper = headed_paper(store.load().settings)
    assert paper.template.laboratory.name == "The name of the settings"
    assert paper.template.machine.serial == "0001"
    assert paper.logo == PNG
    assert sorted(one for one in tmp_path.rglob("*")) == before
    path.write_text(TEMPLATE.replace('country = "DE"', "country = 3"), encoding="utf-8")
    with pytest.raises(InputError, match=r"lab\.toml, line 9: field 'laboratory\.country'"):
        headed_paper(store.load().settings)
