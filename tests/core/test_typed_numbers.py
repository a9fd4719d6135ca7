"""Every typed number is finite, within its range and in its unit, or refused with both."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.calibration.records import load_bar, load_sphere
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.tracking import load_probe, load_reference
from ocmm_core.typed_numbers import BALL, NUMBER_FIELDS, NumberField

HOSTILE = (
    "nan", "NaN", "inf", "-inf", "1e400", "0", "-0", "-6", "-1e-9", "6000", "1e9", "1e-30", "6",
    "6.0", "6,0", "1,234", "1.234", "1.2.3", "1,2,3", "6 mm", "0.236 in", '6"', "6 °F", "6 m",
    "6 bananas", "6 6", "", " ", "six", "0x6", "1_0", "6e", "٦", "--6", "+6",
    "6\N{NO-BREAK SPACE}mm", "2", "100", "20000",
)  # fmt: skip


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("field", NUMBER_FIELDS, ids=lambda field: field.quantity.field)
def test_a_typed_number_is_in_its_range_or_refused_with_it(field: NumberField, comma: bool) -> None:
    one = field.quantity
    taken = 0
    error: InputError | None
    for text in HOSTILE:
        try:
            value = field.read(text, comma=comma)
        except InputError as refused:
            error = refused
        else:
            error = None
        if error is not None:
            assert f"{one.least:g} to {one.most:g}" in error.remedy
            assert one.unit in error.remedy
            continue
        taken += 1
        assert math.isfinite(value)
        assert one.least <= value <= one.most, text
        assert not field.whole or value == int(value)
    assert taken


def test_a_length_may_be_typed_in_inch_and_other_quantities_may_not() -> None:
    assert BALL.read("0.25 in") == 6.35
    assert BALL.read('0.25"') == 6.35
    assert BALL.read("6,35 mm", comma=True) == 6.35
    for field in NUMBER_FIELDS:
        if field.quantity.unit != "mm":
            with pytest.raises(InputError):
                field.read("1 in")


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -6.0, 6000.0])
def test_a_ball_that_no_probe_has_is_refused(value: float) -> None:
    with pytest.raises(InputError, match="The typed ball diameter is"):
        BALL.check(value)


_NUMBERS = re.compile(r"(\w+) = (-?[\d.]+(?:e-?\d+)?|\[-?\d[-\d., e]*\])\s*(?:#.*)?")
_FREE = {
    "position",
    "direction",
    "tip",
    "volume_min",
    "volume_max",
    "nests",
    "leds",
    "temperatures",
}
"""Numbers that may have any sign; a plausible size of them depends on others."""
_SIGNED = {"expansion", "u0_px", "v0_px", "k1", "k2", "p1", "p2"}
_LARGE = {"pattern_length_px"}
DOCUMENTS = [
    (("rigs", "recommended.toml"), load_rig), (("probes", "standard.toml"), load_probe),
    (("references", "plate.toml"), load_reference), (("artefacts", "bar.toml"), load_bar),
    (("artefacts", "sphere.toml"), load_sphere),
]  # fmt: skip


@pytest.mark.parametrize(("place", "load"), DOCUMENTS, ids=[place[1] for place, _ in DOCUMENTS])
def test_a_document_with_an_impossible_number_is_refused(
    place: tuple[str, str], load: Callable[[Path], object], tmp_path: Path
) -> None:
    lines = resource(*place).read_text("utf-8").split("\n")
    file, taken, tried = tmp_path / "x.toml", [], 0
    for row, line in enumerate(lines):
        found = _NUMBERS.fullmatch(line.strip())
        if found is None:
            continue
        key, old = found.groups()
        signed = key in _FREE or key in _SIGNED
        texts = ["nan", "inf"] + ["-1.0"] * (not signed) + ["1e9"] * (key not in _FREE | _LARGE)
        for text in texts:
            new = f"[{', '.join([text] * len(old.split(',')))}]" if "[" in old else text
            file.write_text("\n".join([*lines[:row], f"{key} = {new}", *lines[row + 1 :]]), "utf-8")
            tried += 1
            try:
                load(file)
            except InputError:
                continue
            taken.append((row + 1, key, text))
    assert not taken
    assert tried >= 15
