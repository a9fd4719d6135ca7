"""Names in any script: accepted characters, one spelling, and file names made from them."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export.report import check_file_stem, check_name
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.plan import feature_table, load_plan, save_plan
from ocmm_core.inspection.session import check_header
from ocmm_core.names import (
    LONGEST_NAME,
    ascii_name,
    file_stem,
    label_fault,
    name_fault,
    normal_name,
    usable_name,
)
from ocmm_shop.archive.questions import Query

NFD = unicodedata.normalize("NFD", "Größe é")
GOOD = ("Ø40/7", "Größe é", "零件 4711", "Деталь №7", 'Nabe "A", 2 x', "한글", "ক্‌ষ", "#1", "½")
BAD = {
    "": "is empty",
    "a\u202eb": "U+202E, character 2",
    "\u2066a": "U+2066, character 1",
    "a\u200eb": "U+200E",
    "\u200dab": "U+200D",
    "a\u200db": "U+200D",
    "\u0995\u200d": "U+200D",
    "a\nb": "a control character",
    "a\x00b": "U+0000",
    "a\u2028b": "an end of line",
    "a\u00a0b": "a special space",
    "a\ue000": "a private character",
    "a\U000e0041": "U+E0041",
    " a": "begins or ends with a space",
    "a ": "begins or ends with a space",
    "=1+1": "a formula",
    "\uff1d1+1": "a formula",
    "-4711": "a formula",
    "@SUM": "a formula",
    "\u0301a": "a combining mark",
    "x" * (LONGEST_NAME + 1): "has 61 characters; at most 60",
    NFD: "NFC",
}
HOSTILE = (
    *GOOD, "..", "../../etc/passwd", "..\\..\\x", ".hidden", "-rf", "~x", "CON", "con.txt", "LPT¹",
    "nul", "a:b", "a*?", "a.", "a..", "<>|", "A/B", "A_B", "A\\B", "C:\\x", "\U0001d538" * 60,
    "零" * 60,
    "a\u202eb", "\ud800", "", " ",
)  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_labels_of_any_script_are_accepted(name: str) -> None:
    assert label_fault(name) == ""
    check_header(JobHeader(name, name, name, name, name))
    assert check_name("plan", name) == name


@pytest.mark.parametrize("name", BAD)
def test_a_refused_label_is_told_exactly_what_is_refused(name: str) -> None:
    assert BAD[name] in label_fault(name)
    assert name_fault(name)
    if name and name != NFD:
        with pytest.raises(InputError, match=re.escape(label_fault(name))):
            check_header(JobHeader("anna", "PART", "1", "", name))


def test_names_that_plans_refer_to_leave_out_signs_of_lists_and_formulas() -> None:
    for name in ("Ø40/7", "BORE 1.2-3", "Fläche_A", "面 1", "_x"):
        assert name_fault(name) == ""
    for sign in ",;\"'$\\|`{}[]<>*?:%&!":
        assert f"contains '{sign}'" in name_fault(f"A{sign}B")
        assert label_fault(f"A{sign}B") == ""
    assert "begins with '.'" in name_fault(".x")
    for text in (*HOSTILE, "a,b", "BORE <1>"):
        made = usable_name(text)
        assert made == "" or name_fault(made) == ""


def test_file_names_are_valid_on_every_system_and_never_one_for_two_names() -> None:
    rng = np.random.default_rng(20261128)
    signs = 'aB7 ._-~/\\:*?"<>|ØßЖ零\U0001d538\u0301\u202e\u200d\x00\n'
    names = {*HOSTILE, *(
        "".join(rng.choice(list(signs), int(rng.integers(1, 61))).tolist()) for _ in range(2000)
    )}  # fmt: skip
    made: dict[str, str] = {}
    for name in names:
        stem = file_stem(name)
        assert not set(stem) & set('<>:"/\\|?*'), name
        assert stem.isprintable() or "\ud800" in stem
        assert stem[0] not in ".-~"
        assert not stem.endswith((".", " "))
        assert stem.split(".")[0].upper() not in ("CON", "NUL", "LPT¹", "AUX")
        assert len(f"{stem}-99999_SIMULATED_INCOMPLETE_cloud_centres.asc.seal.json".encode()) <= 255
        # A blank is written as "_", nothing else may meet.
        key = normal_name(name).replace(" ", "_")
        assert made.setdefault(stem, key) == key
        if "\ud800" not in stem:
            assert check_file_stem(stem) == stem
    with pytest.raises(StorageError, match=r"not a valid file name"):
        check_file_stem("a:b")


def test_names_for_programs_that_read_ascii_stay_different() -> None:
    names = ("Ä", "Ö", "Ø", "零", "件", "A", "Ä.001")
    found = [ascii_name(name) for name in names]
    assert all(name.isascii() for name in found)
    assert len(set(found)) == len(names)
    assert found[-1] == f"{found[0]}.001"


def test_one_name_has_one_spelling(tmp_path: Path) -> None:
    """A name typed on a Mac (NFD) and on Windows (NFC) is one part."""
    header = JobHeader(NFD, NFD, NFD, NFD, NFD)
    assert header == JobHeader(*[normal_name(NFD)] * 5)
    assert Query(part=NFD) == Query(part=normal_name(NFD))
    text = resource("plans", "quick.toml").read_text()
    for word in ('"QUICK"', "BED"):
        text = text.replace(word, word.replace("BED", NFD) if word == "BED" else f'"{NFD}"')
    path = tmp_path / "p.toml"
    path.write_text(text)
    plan = load_plan(path)
    assert normal_name(NFD) in plan.shapes
    save_plan(plan, tmp_path / "q.toml")
    assert load_plan(tmp_path / "q.toml") == plan
    table = tmp_path / "t.csv"
    table.write_text(f"name,shape,x,y,z\n{NFD},Point,1,2,3\n")
    assert feature_table(table).features[0].name == normal_name(NFD)
    table.write_text("name,shape,x,y,z\nA\u202eB,Point,1,2,3\n")
    with pytest.raises(InputError, match=r"U\+202E, character 2"):
        feature_table(table)
