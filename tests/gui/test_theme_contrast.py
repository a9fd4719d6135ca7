"""Every text is legible on its background, in every theme."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QPalette

from ocmm_gui.kit import THEMES
from ocmm_gui.kit._theme import make_palette

WCAG_AA = 4.5
"""Least contrast of text (WCAG 2.1, 1.4.3)."""

TEXTS = ("text", "muted", "accent", "good", "warn", "bad")


def contrast_ratio(first: str, second: str) -> float:
    """Return the contrast of two colours, 1 to 21 (WCAG 2.1, 1.4.3)."""
    high, low = sorted((_luminance(first), _luminance(second)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    weights = (0.2126, 0.7152, 0.0722)
    channels = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return sum(w * c for w, c in zip(weights, linear, strict=True))


def test_contrast_of_black_and_white_is_21() -> None:
    assert contrast_ratio("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast_ratio("#777777", "#777777") == pytest.approx(1.0)
    # Known value of the WCAG examples: #767676 is the lightest grey that passes on white.
    assert contrast_ratio("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("surface", ["background", "panel"])
def test_text_stands_out(name: str, text: str, surface: str) -> None:
    theme = THEMES[name]
    assert contrast_ratio(getattr(theme, text), getattr(theme, surface)) >= WCAG_AA


@pytest.mark.parametrize("name", THEMES)
def test_button_and_marker_stand_out(name: str) -> None:
    theme = THEMES[name]
    assert contrast_ratio(theme.on_accent, theme.accent) >= WCAG_AA
    for zone in (theme.zone_good, theme.zone_warn, theme.zone_bad):
        assert contrast_ratio(theme.text, zone) >= WCAG_AA


@pytest.mark.parametrize("name", THEMES)
def test_palette_follows_the_table(name: str) -> None:
    palette, theme = make_palette(THEMES[name]), THEMES[name]
    assert palette.color(QPalette.ColorRole.Window).name() == theme.background
    assert palette.color(QPalette.ColorRole.Text).name() == theme.text
