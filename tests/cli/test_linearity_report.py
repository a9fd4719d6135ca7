"""A linearity study on the terminal: its chart in characters and as SVG, and its verdict."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from ocmm_cli.acceptance._msa_report import linearity_chart, print_linearity, text_chart
from ocmm_cli.terminal import PlainConsole
from ocmm_shop.studies import linearity_of
from tests.shop.studies.test_linearity import REFERENCES, good, trend_of


@pytest.mark.parametrize("steep", [0.0, 0.01])
def test_the_charts_show_line_band_and_verdict(steep: float) -> None:
    values = {name: many + steep * REFERENCES[name] for name, many in good().items()}
    found = linearity_of(trend_of(values), REFERENCES)
    rows = text_chart(found)
    assert len(rows) == 7
    assert all("x" in row for row in rows[1:6])
    root = ElementTree.fromstring(linearity_chart(found))  # noqa: S314 -- ours
    space = "{http://www.w3.org/2000/svg}"
    assert len(root.findall(f"{space}circle")) == 60
    words = [one.text for one in root.iter(f"{space}text")]
    assert f"Linearity of WIDTH: {found.word}" in words
    assert "SIMULATED" not in "".join(map(str, words))
    assert "SIMULATED: Linearity of WIDTH" in linearity_chart(found, simulated=True)
    console = PlainConsole(record=True, width=120)
    print_linearity(console, found)
    told = console.export_text()
    assert ("NOT LINEAR" in told) is bool(steep)
