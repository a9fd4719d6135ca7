"""Numbers, lengths and dates on the screen: one place writes them, and every field reads both."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, date, datetime

import numpy as np
import pytest
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QApplication

from ocmm_gui.kit import (
    DASHES,
    NumberStyle,
    day_words,
    key_words,
    length_number,
    length_words,
    localised,
    millimetres,
    numbers_in_use,
    style_of,
    time_words,
    tr,
    use_language,
    use_numbers,
)
from tests.gui.plain_numbers import plain_number


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    yield
    use_numbers(NumberStyle())


@pytest.mark.parametrize(
    ("language", "decimal", "comma"),
    [
        ("en", "locale", False),
        ("de", "locale", True),
        ("de", "point", False),
        ("en", "comma", True),
    ],
)
def test_the_decimal_sign_follows_language_and_setting(
    language: str, decimal: str, comma: bool
) -> None:
    assert style_of(language, decimal).comma is comma


def test_without_a_choice_everything_is_as_in_files() -> None:
    assert numbers_in_use() == NumberStyle()
    assert millimetres(-1.2345) == "-1.234"
    assert localised("1.5 ± 0.2") == "1.5 ± 0.2"
    assert type(tr("{x:.1f}")) is str
    assert day_words("2026-11-26T10:00:00") == "2026-11-26"


def test_german_numbers_have_a_comma_in_texts_and_in_sentences() -> None:
    use_numbers(style_of("de"))
    assert millimetres(-1.2345, signed=True) == "-1,234"
    assert millimetres(None) == DASHES
    assert millimetres(-0.0001) == "0,000"
    assert localised("1.5 ± 0.2 µm, .3, 4.") == "1,5 ± 0,2 µm, .3, 4."
    said = tr("{a:.1f} {b:+.2f} {c:,} {d} {e} {f:g} {g:.2f} {h}")
    filled = said.format(
        a=1.25, b=np.float64(-3.0), c=1234567, d="1.5", e=2, f=0.5, g=np.float32(0.25), h=True
    )
    # An inserted text is a name or file, and stays.
    assert filled == "1,2 -3,00 1.234.567 1.5 2 0,5 0,25 True"
    assert tr("{x:.1f}").format(x=float("nan")) == "nan"


def test_days_are_written_as_in_the_language() -> None:
    use_numbers(style_of("de"))
    when = datetime(2026, 3, 9, 7, 5, tzinfo=UTC)
    assert day_words(when) == day_words(date(2026, 3, 9)) == "09.03.2026"
    assert day_words("2026-03-09T07:05:00+00:00") == "09.03.2026"
    assert day_words("unknown day") == "unknown day"
    assert time_words(when) == "09.03.2026 07:05"


@pytest.mark.parametrize(
    ("typed", "read"),
    [
        ("1,5", "1.5"),
        (" 1.5 ", "1.5"),
        ("-0,25", "-0.25"),
        ("12", "12"),
        # The sign that separates thousands is ambiguous.
        ("1.234,5", None),
        ("1,234.5", None),
        ("1,2,3", None),
    ],
)
def test_a_field_takes_comma_and_point(typed: str, read: str | None) -> None:
    if read is None:
        with pytest.raises(ValueError, match="could not convert"):
            float(plain_number(typed))
    else:
        assert plain_number(typed) == read


@pytest.mark.parametrize("value_mm", [0.0, 0.001, -0.001, 25.4, 1234.5678, -0.0004])
def test_inch_has_the_resolution_of_mm_and_is_named(value_mm: float) -> None:
    use_numbers(style_of("en", units="inch"))
    text = length_words(value_mm)
    number, unit = text.split()
    assert unit == "in"
    # Half a step of the last decimal, and the rounding of a float.
    assert float(number) * 25.4 == pytest.approx(value_mm, abs=0.5e-5 * 25.4 + 1e-9)
    use_numbers(style_of("en"))
    assert length_words(value_mm).endswith(" mm")
    assert length_number(value_mm, signed=True)[0] in "+-"


def test_keys_are_named_as_on_the_keyboard(qapp: QApplication) -> None:
    assert key_words("Ctrl+Shift+PgUp") == "Ctrl+Shift+PgUp"
    assert key_words(QKeySequence("Ctrl++")) == "Ctrl++"
    assert key_words("+") == "+"
    assert key_words("") == ""
    use_language(qapp, "de")
    try:
        assert key_words("Ctrl+Shift+PgUp") == "Strg+Umschalt+Bild↑"
        assert key_words("Return") == "Eingabe"
        assert key_words("F8") == "F8"
    finally:
        use_language(qapp, "en")
