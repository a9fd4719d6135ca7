"""One version: sources, changelog, citation and installation commands agree."""

from __future__ import annotations

import re

import pytest

from installer.locks import ROOT
from ocmm_core import __version__


@pytest.mark.parametrize(
    ("place", "pattern"),
    [
        ("CITATION.cff", r"^version: (\S+)$"),
        ("README.md", r"ocmm[_-](\d[\d.]*\d)[_-]"),
        ("installer/station/README.md", r"ocmm_(\d[\d.]*\d)_"),
    ],
)
def test_states_the_version_of_the_sources(place: str, pattern: str) -> None:
    found = re.findall(pattern, (ROOT / place).read_text("utf-8"), re.MULTILINE)
    assert set(found) == {__version__}


def test_changelog_starts_with_the_version_of_the_sources() -> None:
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = re.findall(r"^## \[(\d[\d.]*)\] - (\d{4}-\d\d-\d\d)$", text, re.MULTILINE)
    assert released[0][0] == __version__
    assert [day for _version, day in released] == sorted(
        (day for _v, day in released), reverse=True
    )
