"""Nothing that is written on a page is cut off, on any page, in any theme, on both screens."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from PySide6.QtWidgets import QApplication, QWidget

from ocmm_gui.kit import CAP_HEIGHT, THEMES, NumberStyle, style_of, use_language, use_numbers
from ocmm_gui.kit._theme import FAR_SHARE
from tests.gui.shown_english import english_in
from tests.gui.window_pages import Pseudo, faults, walk
from tests.host import long_form

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

SIZES = ((1280, 720), (1920, 1080))
ALL_SIZES = (*SIZES, (3840, 2160))
"""At 200 % a screen of 2160 lines has the points of one of 1080."""


WIDEST_FRAMES = "contrast"
"""Themes differ in their colours, and this one in the width of its frames, which takes room."""


def test_nothing_is_cut_off(open_window: OpenWindow, qapp: QApplication) -> None:
    window = open_window(speed=0.1).window
    if long_form():
        found = walk(window, qapp, tuple(THEMES), SIZES)
    else:
        # The largest content at the least room; the other size in another theme.
        found = walk(window, qapp, (WIDEST_FRAMES,), SIZES[:1])
        found += walk(window, qapp, ("light",), SIZES[1:])
    assert not found, "\n".join(found)


LANGUAGES_TRIED = ("pseudo", "de")


@pytest.fixture(params=LANGUAGES_TRIED)
def longer_language(request: pytest.FixtureRequest, qapp: QApplication) -> Iterator[str]:
    """Show German, or a language that is 40 % longer than English."""
    pseudo = Pseudo()
    use_language(qapp, "de")
    use_numbers(style_of("de"))
    if request.param == "pseudo":
        # Asked before the German that stays below it.
        qapp.installTranslator(pseudo)
    yield request.param
    qapp.removeTranslator(pseudo)
    use_language(qapp, "en")
    use_numbers(NumberStyle())


@pytest.mark.slow
def test_nothing_is_cut_off_in_a_longer_language(
    open_window: OpenWindow, qapp: QApplication, longer_language: str
) -> None:
    """In German no text contains English, but for names, paths and settings."""

    def look(widget: QWidget) -> Iterator[str]:
        yield from faults(widget)
        if longer_language == "de":
            yield from english_in(widget)

    window = open_window(speed=0.1).window
    if long_form():
        found = walk(window, qapp, tuple(THEMES), ALL_SIZES, look=look)
    else:
        sizes = (ALL_SIZES[0], ALL_SIZES[-1])
        found = walk(window, qapp, (WIDEST_FRAMES,), sizes, look=look)
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("size", "least"), [((1280, 720), 24.0), ((1920, 1080), 25.0), ((3840, 2160), 50.0)]
)
def test_the_digits_beside_the_coach_are_read_from_some_steps_away(
    size: tuple[int, int], least: float, open_window: OpenWindow, qapp: QApplication
) -> None:
    # A capital of 7 mm on a 24-inch screen; the far view is for three metres.
    window = open_window(speed=0.1, led=True).window
    window.resize(*size)
    for _ in range(4):
        qapp.processEvents()
    assert window.desk.coach.isVisible()
    assert window.desk.readout.cap_height() >= least


def test_the_far_view_is_read_at_three_metres(open_window: OpenWindow, qapp: QApplication) -> None:
    window = open_window(speed=0.1).window
    window.show_far(True)
    for size in SIZES:
        window.resize(*size)
        qapp.processEvents()
        qapp.processEvents()
        # A capital of 17.5 mm on a 24-inch screen of any resolution; a pixel is lost to whole type
        # sizes.
        least = FAR_SHARE * size[1] - 1.0
        for text, pixels in window.far.type_pixels().items():
            assert CAP_HEIGHT * pixels >= least, (text, size)
        assert window.far.readout.cap_height() >= least
