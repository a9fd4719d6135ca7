"""The page about the camera's objects and the ESI file: as generated, and complete."""

from __future__ import annotations

from ocmm_bench.conform._object_page import PAGE, object_page
from ocmm_core.documents import resource
from ocmm_core.fieldbus.device import ERROR_TEXTS, object_dictionary
from ocmm_sim.slave import ESI_FILE, esi_document


def test_the_files_in_the_repository_are_the_generated_ones() -> None:
    hint = "run: python -m ocmm_bench.conform._object_page"
    assert resource(*ESI_FILE).read_bytes() == esi_document(), hint
    assert PAGE.read_text("utf-8") == object_page(), hint


def test_the_page_names_every_object_and_error() -> None:
    page = object_page()
    for index, item in object_dictionary(serial=0).items():
        assert f"### 0x{index:04X} {item.name}\n" in page
    for code, words in ERROR_TEXTS.items():
        assert f"| {code:#06x} | {words} |" in page
    for line in page.splitlines():
        assert line.count("|") == 0 or line.startswith("| ")
