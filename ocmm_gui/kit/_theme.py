"""Themes of the window: three from one table, set once on the application.

Light for glare, dark for a dim measuring room, high contrast for weak eyes. Colour is never the
only cue: every state also has a word and a shape. Colours of outcomes also differ for colour-blind
users (`tests/gui/test_colour_blind.py`).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cache
from string import Template
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontDatabase, QFontMetricsF, QPalette
from PySide6.QtWidgets import QApplication, QWidget

from ocmm_core.documents import read_text, resource
from ocmm_core.tolerances.decisions import Verdict

CAP_HEIGHT = 0.729
"""Height of a capital over the pixel size of DejaVu; other fonts are within 3 %."""

FAR_SHARE = 63.0 / 1080.0
"""Capitals readable at three metres: 17.5 mm, 20 minutes of arc, on a screen of 24 inches."""
LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
WRAPPED = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
"""`LEFT`, `RIGHT`, `WRAPPED`: places of a painted text in its box."""


@dataclass(frozen=True, slots=True)
class Theme:
    """A theme; colours as ``#rrggbb``."""

    name: str
    background: str
    panel: str
    border: str
    """`background`, `panel`, `border`: surfaces and outlines."""
    text: str
    muted: str
    """`text`, `muted`: primary and secondary text."""
    accent: str
    on_accent: str
    """`accent`, `on_accent`: primary button and selection, and text on them."""
    good: str
    warn: str
    bad: str
    """`good`, `warn`, `bad`: text and marks of the three outcomes."""
    zone_good: str
    zone_warn: str
    zone_bad: str
    """`zone_good`, `zone_warn`, `zone_bad`: of the tolerance bar; marks on them: ``text``."""
    border_px: int

    def colour(self, name: str) -> str:
        """Return the colour of a field such as ``warn``; any other text is returned unchanged."""
        return str(getattr(self, name, name))


THEMES = {
    theme.name: theme
    for theme in (
        Theme("dark", "#14181c", "#1d242a", "#3d4852", "#f0f4f8", "#aab6c2", "#3cc4ff", "#0b1116",
              "#00ff62", "#c4a201", "#ff7b7d", "#176251", "#66551b", "#642429", 1),
        Theme("light", "#eef2f5", "#ffffff", "#b4bec8", "#101418", "#46515c", "#005fb8", "#ffffff",
              "#114129", "#734800", "#ab5249", "#4ed9be", "#e4ce90", "#e19292", 1),
        Theme("contrast", "#000000", "#000000", "#ffffff", "#ffffff", "#ffffff", "#00e5ff",
              "#000000", "#00c17f", "#ffe017", "#fd694c", "#025b39", "#736011", "#760001", 2),
    )
}  # fmt: skip
DEFAULT_THEME = "dark"


@runtime_checkable
class ThemedWidget(Protocol):
    """A widget painted in theme colours."""

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        ...


class Themed:
    """Base of widgets with a theme, which they show by `_paint` or an own `set_theme`."""

    _theme = THEMES[DEFAULT_THEME]

    def set_theme(self, theme: Theme) -> None:
        """Show the widget in ``theme`` from now on."""
        self._theme = theme
        self._paint()

    def _paint(self) -> None:
        """Show the present state in the colours of the theme; by default paint again."""
        if isinstance(self, QWidget):
            self.update()


def verdict_colour(theme: Theme, verdict: Verdict | None) -> str:
    return {
        Verdict.CONFORM: theme.good,
        Verdict.NOT_CONFORM: theme.bad,
        Verdict.NOT_PROVEN: theme.warn,
    }.get(verdict or Verdict.NOT_MEASURED, theme.muted)


def text_font(pixels: float, *, bold: bool = False) -> QFont:
    """Return the font of words at a size in pixels."""
    font = QFont()
    font.setFamilies(["DejaVu Sans", "Segoe UI", "Noto Sans"])
    font.setStyleHint(QFont.StyleHint.SansSerif)
    return _sized(font, pixels, bold)


def digit_font(pixels: float, *, bold: bool = True) -> QFont:
    """Return the font of numbers: digits of equal width, so that they do not move."""
    font = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
    font.setFamilies(["DejaVu Sans Mono", "Consolas", font.family()])
    return _sized(font, pixels, bold)


def _sized(font: QFont, pixels: float, bold: bool) -> QFont:
    font.setPixelSize(max(1, round(pixels)))
    font.setBold(bold)
    # A copied "ff" must be two letters: hashes have many.
    for feature in ("liga", "clig", "dlig"):
        font.setFeature(QFont.Tag(feature), 0)
    return font


def fitted(font: QFont, text: str, width: float, height: float, limit: float) -> QFont:
    """Return ``font`` at the largest fitting pixel size, ``limit`` at most."""
    probe = QFont(font)
    probe.setPixelSize(100)
    metrics = QFontMetricsF(probe)
    wide = max(metrics.horizontalAdvance(text), metrics.boundingRect(text).width(), 1.0)
    # Two lines of a pixel keep the anti-aliased edge inside the widget.
    size = min(limit, 100.0 * (width - 2.0) / wide, 100.0 * height / metrics.height())
    probe.setPixelSize(max(6, int(size)))
    return probe


def far_type(widget: QWidget) -> int:
    """Return the pixel size of type readable at three metres in a widget's window."""
    return math.ceil(FAR_SHARE * widget.window().height() / CAP_HEIGHT)


def wrapped_pixels(text: str, box: QRectF, limit: int, *, bold: bool = False) -> int:
    """Return the largest pixel size of a wrapped text, `limit` at most."""
    for pixels in range(limit, 9, -2):
        metrics = QFontMetricsF(text_font(pixels, bold=bold))
        # Painting may wrap a line that just fits.
        if box.contains(metrics.boundingRect(box.adjusted(1, 0, -1, 0), WRAPPED, text)):
            return pixels
    return 9


def make_palette(theme: Theme) -> QPalette:
    role = QPalette.ColorRole
    palette = QPalette()
    for name, colour in (
        (role.Window, theme.background), (role.WindowText, theme.text),
        (role.Base, theme.panel), (role.AlternateBase, theme.background),
        (role.Text, theme.text), (role.PlaceholderText, theme.muted),
        (role.Button, theme.panel), (role.ButtonText, theme.text), (role.BrightText, theme.bad),
        (role.Highlight, theme.accent), (role.HighlightedText, theme.on_accent),
        (role.ToolTipBase, theme.panel), (role.ToolTipText, theme.text),
        (role.Link, theme.accent), (role.Mid, theme.border), (role.Dark, theme.border),
    ):  # fmt: skip
        palette.setColor(name, QColor(colour))
    for name in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, name, QColor(theme.muted))
    return palette


def make_style_sheet(theme: Theme) -> str:
    """Return the few rules that a palette cannot express: outlines and button roles."""
    line = f"{theme.border_px}px solid {theme.border}"
    return Template(_style_rules()).substitute(asdict(theme), line=line)


@cache
def _style_rules() -> str:
    return read_text(resource("window", "window.qss"))


def apply_theme(window: QWidget, theme: Theme) -> None:
    """Apply a theme to the application and all self-painted widgets of `window`."""
    dress_application(theme)
    dress(window, theme)


def dress_application(theme: Theme) -> None:
    """Apply a theme to the application; fast before a window exists, then a second."""
    app, sheet = QApplication.instance(), make_style_sheet(theme)
    if isinstance(app, QApplication) and app.styleSheet() != sheet:
        app.setPalette(make_palette(theme))
        app.setStyleSheet(sheet)


def dress(whole: QWidget, theme: Theme) -> None:
    """Set the theme of every self-painted widget in `whole`."""
    for widget in (whole, *whole.findChildren(QWidget)):
        # Most are plain, and the question for a protocol takes twenty times as long.
        if hasattr(widget, "set_theme") and isinstance(widget, ThemedWidget):
            widget.set_theme(theme)


def use_role(widget: QWidget, role: str) -> None:
    """Change the style sheet role of an existing widget."""
    if widget.property("role") != role:
        widget.setProperty("role", role)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
