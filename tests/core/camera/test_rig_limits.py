"""Impossible sizes of a rig, found by damaging rigs a million times."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError


@pytest.mark.parametrize(
    ("line", "instead", "words"),
    [
        (r"^points = .*$", "points = 300000000", "Give at most 100000"),
        (r"^focal = .*$", "focal = 1e-320", "too flat to determine"),
    ],
)
def test_a_rig_that_cannot_be_is_refused_at_once(
    tmp_path: Path, line: str, instead: str, words: str
) -> None:
    good = resource("rigs", "recommended.toml").read_text("utf-8")
    path = tmp_path / "rig.toml"
    path.write_text(re.sub(line, instead, good, count=1, flags=re.MULTILINE), "utf-8")
    with pytest.raises(InputError, match=words):
        load_rig(path)
