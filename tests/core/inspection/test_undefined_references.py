"""Plans that refer to undefined items, or to themselves: each is found by `ocmm plan check`."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.errors import InputError

SOUND = """schema = "ocmm.plan/1"
name = "P"
part = "PART"
unit = "mm"

[[features]]
name = "TOP"
shape = "Plane"
points = 9
point = [50.0, 25.0, 20.0]
length = 100.0
width = 50.0

[[features]]
name = "BASE"
shape = "Plane"
points = 9
point = [50.0, 25.0, 0.0]
direction = [0.0, 0.0, -1.0]

[[features]]
name = "LEFT"
shape = "Plane"
points = 9
point = [0.0, 25.0, 10.0]
direction = [-1.0, 0.0, 0.0]

[[features]]
name = "BORE"
shape = "Cylinder"
points = 12
point = [20.0, 20.0, 10.0]
diameter = 8.0
side = "inner"
length = 20.0

[[features]]
name = "RIM"
shape = "Circle"
points = 8
point = [70.0, 20.0, 20.0]
diameter = 6.0
side = "inner"
projection = "TOP"

[[constructions]]
kind = "intersection"
name = "EDGE"
features = ["TOP", "LEFT"]

[[constructions]]
kind = "intersection"
name = "CORNER"
features = ["BORE", "TOP"]

[[constructions]]
kind = "midpoint"
name = "MIDDLE"
features = ["CORNER", "RIM"]

[[characteristics]]
name = "place"
kind = "position"
features = ["BORE"]
datums = ["BASE", "LEFT"]
upper = 0.2

[[characteristics]]
name = "flat"
kind = "form"
features = ["TOP"]
upper = 0.1
"""
BLOCK = '\n[[constructions]]\nkind = "{}"\nname = "{}"\nfeatures = {}\n'
MIDDLE = 'features = ["CORNER", "RIM"]'


def added(kind: str, name: str, features: str) -> tuple[str, str]:
    return SOUND, SOUND + BLOCK.format(kind, name, features)


REFUSED = {
    "tolerance of an undefined feature": ('features = ["BORE"]', 'features = ["BOER"]'),
    "tolerance by an undefined datum": ('datums = ["BASE", "LEFT"]', 'datums = ["BASE", "B"]'),
    "tolerance by its own feature": ('datums = ["BASE", "LEFT"]', 'datums = ["BORE"]'),
    "undefined plane of projection": ('projection = "TOP"', 'projection = "LID"'),
    "projection onto a constructed plane": (
        'projection = "TOP"\n', 'projection = "HALF"\n'
        + BLOCK.format("bisector", "HALF", '["TOP", "BASE"]')
    ),
    "construction of an undefined feature": (MIDDLE, 'features = ["CORNER", "BALL"]'),
    "construction of itself": (MIDDLE, 'features = ["MIDDLE", "RIM"]'),
    "circle of two": (SOUND, SOUND + BLOCK.format("midpoint", "M1", '["M2", "RIM"]')
        + BLOCK.format("midpoint", "M2", '["M1", "CORNER"]')),
    "circle of three": (SOUND, SOUND + BLOCK.format("midpoint", "M1", '["M3", "RIM"]')
        + BLOCK.format("midpoint", "M2", '["M1", "RIM"]')
        + BLOCK.format("midpoint", "M3", '["M2", "CORNER"]')),
    "alignment by an undefined feature": (
        SOUND, SOUND + '\n[alignment]\ntype = "plane-axis-point"\nplane = "BASE"\n'
        'axis = "BORE"\npoint = "X"\n'
    ),
}  # fmt: skip
"""Text of the sound plan, and its replacement: the plan cannot be loaded."""
FIELDS = {
    "tolerance": "characteristics[0].", "undefined": "features[4].projection",
    "projection": "features[4].projection", "construction": "constructions",
    "circle": "constructions", "alignment": "alignment.",
}  # fmt: skip
"""Field that the sentence names, by the first word of a case."""
UNDEFINED = {
    "parallel planes": added("intersection", "NEW", '["TOP", "BASE"]'),
    "axis in a plane": added("intersection", "NEW", '["BORE", "LEFT"]'),
    "middle of an undefined one": (
        SOUND, SOUND + BLOCK.format("intersection", "NEW", '["BORE", "LEFT"]')
        + BLOCK.format("midpoint", "LATER", '["NEW", "RIM"]')
    ),
}  # fmt: skip
"""The same for constructions that the nominals do not define."""


def check(folder: Path, text: str) -> tuple[int, str]:
    """Return exit code and output of ``ocmm plan check``; an InputError is code 2."""
    plan = folder / "p.toml"
    plan.write_text(text, encoding="utf-8")
    try:
        done = CliRunner().invoke(app, ["plan", "check", str(plan)], catch_exceptions=False)
    except InputError as error:
        return 2, str(error)
    return done.exit_code, " ".join(done.output.split())


def test_accepts_the_sound_plan(tmp_path: Path) -> None:
    code, words = check(tmp_path, SOUND)
    assert code == 0, words
    assert "good. 5 features with 47 points, 3 constructions, 2 characteristics" in words


@pytest.mark.parametrize("name", REFUSED)
def test_refuses_references_to_undefined_items(tmp_path: Path, name: str) -> None:
    old, new = REFUSED[name]
    assert old in SOUND
    code, words = check(tmp_path, SOUND.replace(old, new, 1))
    assert code == 2, words
    at = FIELDS[name.partition(" ")[0]]
    assert f"field '{at}" in words, words


@pytest.mark.parametrize("name", UNDEFINED)
def test_reports_constructions_without_nominal(tmp_path: Path, name: str) -> None:
    old, new = UNDEFINED[name]
    code, words = check(tmp_path, SOUND.replace(old, new, 1))
    assert code == 1, words
    assert "The nominals do not define NEW" in words
