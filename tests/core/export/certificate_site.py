"""The laboratory named on the certificates of tests."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.export.template import Paper, Particulars, load_paper

TEMPLATE = """
schema = "ocmm.report-template/1"
unit = "mm"
name = "lab"
place = "Room 2"
[laboratory]
name = "Laboratory"
address = ["1 Street", "Town"]
country = "DE"
[machine]
name = "Optical CMM"
"""


def lab(folder: Path) -> Paper:
    path = folder / "lab.toml"
    path.write_text(TEMPLATE, encoding="utf-8")
    return load_paper(path, Particulars(customer="Customer AG"))
