"""At any window size no digit is covered and no word cut, also while a job is measured."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.acceptance import OpenTest
from ocmm_gui.access import fitting_factor
from ocmm_gui.kit import tr, use_language
from tests.generated_jobs import generated_job
from tests.gui.window_pages import covered, faults, walk
from tests.host import HANG_MS, long_form

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

SIZES = tuple(
    (width, height)
    for width in (1280, 1366, 1600, 1920, 2560, 3840, 1440)
    for height in (720, 768, 900, 1080, 1440, 2160)
)
"""42 sizes as pages see them: a screen that is smaller is painted smaller."""
LARGE = (1920, 1080)
_SETTLE = 6


def _with_many_characteristics() -> list[int]:
    """Return the generated jobs whose shown feature has most characteristics."""

    def count(seed: int) -> int:
        job = generated_job(seed)[0]
        name = "" if job.shown is None else job.shown.name
        return sum(name in item.features for item in job.characteristics)

    return sorted(range(60), key=count)[-3:]


def test_a_feature_never_covers_the_digits(open_window: OpenWindow, qapp: QApplication) -> None:
    """N = 3 jobs, each resized to 5 sizes and back (42 in the long form)."""
    window = open_window(start=False).window
    desk = window.desk
    found = []
    jobs = _with_many_characteristics()
    sizes = SIZES if long_form() else SIZES[::9]
    for seed in jobs:
        job = generated_job(seed)[0]
        desk.show_job(job)
        # A large size between two small ones: hidden parts return.
        for size in (one for small in sizes for one in (LARGE, small, LARGE)):
            window.resize(*size)
            for _ in range(_SETTLE):
                qapp.processEvents()
            found += [f"job {seed}, {size}: {fault}" for fault in covered(window)]
            found += [f"job {seed}, {size}: {fault}" for fault in faults(desk.feature)]
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_no_page_covers_or_cuts_anything(open_window: OpenWindow, qapp: QApplication) -> None:
    """In the short form two of 42 sizes: the smallest one, and it made wider."""
    sizes = SIZES if long_form() else ((1280, 720), (1440, 720))

    def look(widget: QWidget) -> Iterator[str]:
        yield from faults(widget)
        yield from covered(widget)

    window = open_window(speed=0.1, tests=True).window
    found = walk(window, qapp, ("contrast",), sizes, look=look)
    assert not found, "\n".join(found)


@pytest.mark.slow
@pytest.mark.parametrize("language", ["en", "de"] if long_form() else ["de"])
def test_bands_above_a_page_cut_nothing(
    open_window: OpenWindow, qapp: QApplication, qtbot: QtBot, language: str
) -> None:
    """Practice and a notice of several lines take room from each page at the smallest size."""
    use_language(qapp, language)
    bench = open_window(speed=0.1, tests=True, practice=True)
    bench.notices.warn(2 * f"{tr('Nothing was changed.')} " + 150 * "x ")
    found = walk(bench.window, qapp, ("contrast",), ((1280, 720),))
    start = bench.window.tests.desk.start
    bench.window.tests.calls()["acceptance"]()
    qtbot.waitUntil(
        lambda: start.begin_button.isEnabled() and not start.unfinished.count(), timeout=HANG_MS
    )
    start.show_unfinished([OpenTest(Path("a"), "Interim check of the system", "demo", 3, 5)])
    for _ in range(_SETTLE):
        qapp.processEvents()
    found += [f"unfinished test: {fault}" for fault in faults(bench.window)]
    assert start.resume_button.isVisible()
    use_language(qapp, "en")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("size", "factor"),
    [
        ((1920, 1080), 1.0), ((1280, 800), 1.0), ((1280, 720), 0.9), ((1024, 640), 0.8),
        ((960, 540), 0.7),
        ((800, 600), 0.6), ((1080, 1920), 0.8), ((640, 360), 0.5),
    ],
)  # fmt: skip
def test_pages_shrink_to_a_screen_that_they_do_not_fit(
    size: tuple[int, int], factor: float
) -> None:
    assert fitting_factor(QSize(*size)) == pytest.approx(factor)
