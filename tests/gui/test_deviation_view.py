"""Deviations on the screen and on paper: the meaning of the colours, in words as well."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import DeviationClass, deviation_picture
from ocmm_core.tracking import load_probe
from ocmm_gui.kit import THEMES
from ocmm_gui.rendering import ValueField, mesh_of
from ocmm_gui.reports._pdf import lay_out
from ocmm_gui.results._result_table import DeviationView
from ocmm_gui.scene import Diamonds, Dots, Lines, Tag
from ocmm_gui.views import (
    PointView,
    deviation_colour,
    deviation_items,
    deviations_of,
    job_items,
    scale_words,
)
from ocmm_gui.views._contents import JobDrawing
from ocmm_gui.views._deviations import field_colours, surface_colour
from tests.core.export.sample_report import sample_report, sample_view
from tests.deviating_job import deviating_job, held_back, placed_part
from tests.gui.pdf_texts import texts
from tests.host import HANG_S

UP = np.array([0.0, 0.0, 1.0])
THEME = pytest.mark.parametrize("theme", THEMES.values(), ids=THEMES)


def shown(view: DeviationView) -> QImage:
    view.resize(700, 460)
    view.show()
    QApplication.processEvents()
    return view.grab().toImage()


def colours(image: QImage) -> set[str]:
    picture = image.convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(picture.constBits(), "<u4").reshape(picture.height(), -1)
    return {QColor(int(one)).name() for one in np.unique(pixels[::2, : picture.width()])}


@THEME
def test_no_two_classes_look_alike(theme: object) -> None:
    made = next(item for item in THEMES.values() if item is theme)
    found = [deviation_colour(made, kind) for kind in DeviationClass]
    assert len(set(found)) == len(found) or made.name == "contrast"
    # Outside is marked by a sign, accepted by a filled end: not by colour alone.
    view, _ = deviating_job()
    items = deviation_items(deviations_of(view), made)
    hollow = [item for item in items if isinstance(item, Dots) and item.colour == made.panel]
    filled = [item for item in items if isinstance(item, Dots) and item.colour == made.good]
    assert len(hollow) == len(filled) == 1
    outside = [item for item in items if isinstance(item, Diamonds)]
    assert sum(len(item.points) for item in outside) == 1
    named = [item for item in items if isinstance(item, Tag)]
    assert [item.text for item in named] == ["T8 +0.030 mm"]


@pytest.mark.usefixtures("qapp")
@THEME
def test_the_scale_has_what_the_whiskers_have(theme: object) -> None:
    made = next(item for item in THEMES.values() if item is theme)
    view, _ = deviating_job()
    window = DeviationView()
    window.set_theme(made)
    window.show_job(view, UP)
    seen = colours(shown(window))
    for kind in (*list(DeviationClass)[:4],):
        assert deviation_colour(made, kind) in seen, kind
    described = window.accessibleDescription()
    for word in ("1 too much", "45 accepted", "24 within, not accepted"):
        assert word in described
    window.close()


@pytest.mark.usefixtures("qapp")
def test_nothing_green_where_nothing_is_accepted() -> None:
    theme = THEMES["light"]
    view, _ = deviating_job()
    doubtful = replace(view, characteristics=view.characteristics[:1])
    window = DeviationView()
    window.set_theme(theme)
    window.show_job(doubtful, UP)
    assert theme.good not in colours(shown(window))
    window.close()


@pytest.mark.usefixtures("qapp")
def test_a_job_without_deviations_shows_none_and_keys_turn_one_that_has() -> None:
    window = DeviationView()
    window.show_job(sample_view(), UP)
    assert window.isHidden()
    assert window.accessibleDescription() == ""
    view, _ = deviating_job()
    window.show_job(view, UP)
    before = shown(window)
    QTest.keyClick(window, Qt.Key.Key_Left)
    QApplication.processEvents()
    assert window.grab().toImage() != before
    window.close()


def test_the_scene_holds_the_whiskers_of_the_core() -> None:
    view, _ = deviating_job()
    theme = THEMES["dark"]
    picture = deviations_of(view)
    assert picture.whiskers
    items, _ = job_items(view, theme)
    drawn = np.concatenate(
        [item.segments for item in items if isinstance(item, Lines) and item.width in (2.4, 3.4)]
    )
    wanted = {tuple(np.round([*one.base_world, *one.end_world], 9)) for one in picture.whiskers}
    assert wanted <= {tuple(np.round(one.ravel(), 9)) for one in drawn}


def test_a_held_point_is_grey_and_said() -> None:
    view, _ = deviating_job()
    point = view.feature("T3").points[0]
    held = held_back(view, point)
    picture = deviations_of(held)
    assert picture.count(DeviationClass.HELD) == 1
    assert "1 held back" in scale_words(picture)[1]
    theme = THEMES["light"]
    assert deviation_colour(theme, DeviationClass.HELD) == theme.muted


def test_what_has_not_changed_is_not_made_again() -> None:
    view, _ = deviating_job()
    drawing = JobDrawing()
    first, _ = drawing.items(view, THEMES["dark"])
    again, _ = drawing.items(replace(view, paused=True), THEMES["dark"])
    assert first is again
    other, _ = drawing.items(view, THEMES["light"])
    assert other is not first


@pytest.mark.usefixtures("qapp")
def test_the_live_view_shows_the_scale_with_the_job() -> None:
    theme = THEMES["light"]
    window = PointView(
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
    )
    window.set_theme(theme)
    window.resize(900, 600)
    view, _ = deviating_job()

    def blue(job: JobView) -> bool:
        window.show_job(job)
        window.show()
        QApplication.processEvents()
        image = window.grab().toImage()
        return deviation_colour(theme, DeviationClass.LESS) in colours(image)

    assert blue(view)
    assert not blue(sample_view())
    window.close()


@pytest.mark.usefixtures("qapp")
def test_the_report_says_the_scale_in_words() -> None:
    view, nominals = deviating_job()
    told = texts(lay_out(sample_report(view, nominals=nominals)))
    words, counted = scale_words(deviation_picture(view.characteristics))
    assert words in told
    assert counted in told
    assert "upper limit" in told
    assert "base, left" in told


def waited_for(window: DeviationView | PointView) -> QImage:
    window.resize(700, 460)
    window.show()
    until = time.monotonic() + HANG_S
    while not window.is_painted() and time.monotonic() < until:
        QApplication.processEvents()
    assert window.is_painted()
    return window.grab().toImage()


def pixels_like(image: QImage, colour: str) -> NDArray[np.bool_]:
    """Return the pixels with the hue of a colour at any brightness."""
    wanted = QColor(colour)
    seen = [[image.pixelColor(x, y) for x in range(0, image.width(), 3)]
            for y in range(0, int(0.8 * image.height()), 3)]  # fmt: skip
    return np.array(
        [[abs(one.hsvHue() - wanted.hsvHue()) < 12 and one.hsvSaturation() > 60 for one in row]
         for row in seen]
    )  # fmt: skip


def inside(image: QImage, colour: str) -> int:
    """Return the number of such pixels between four alike."""
    alike = pixels_like(image, colour)
    whole = alike[1:-1, 1:-1] & alike[:-2, 1:-1] & alike[2:, 1:-1]
    return int(np.sum(whole & alike[1:-1, :-2] & alike[1:-1, 2:]))


def share_like(image: QImage, colour: str) -> float:
    """Return the share of such pixels."""
    return float(np.mean(pixels_like(image, colour)))


@pytest.mark.usefixtures("qapp")
def test_the_part_has_the_colours_of_its_deviations_and_none_while_it_is_not_aligned() -> None:
    theme = THEMES["dark"]
    view, _ = deviating_job()
    up = placed_part().T_world_from_model.rotation[:, 2]
    images = {}
    for is_rough in (False, True):
        window = DeviationView()
        window.set_theme(theme)
        window.show_job(replace(view, placed_part=placed_part(is_rough=is_rough)), up)
        images[is_rough] = waited_for(window)
        window.close()
    amber = surface_colour(theme, DeviationClass.WITHIN_ONLY)
    red = surface_colour(theme, DeviationClass.MORE)
    assert share_like(images[False], amber) > 0.03
    assert share_like(images[True], amber) < 0.01
    # Names of points are red as well, in both, but thin: no pixel has its neighbours alike.
    assert inside(images[False], red) > inside(images[True], red) + 10


@pytest.mark.usefixtures("qapp")
def test_the_live_view_has_the_colours_too() -> None:
    theme = THEMES["light"]
    window = PointView(
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
    )
    window.set_theme(theme)
    view, _ = deviating_job()
    window.show_job(replace(view, placed_part=placed_part()))
    window.fit()
    amber = surface_colour(theme, DeviationClass.WITHIN_ONLY)
    assert share_like(waited_for(window), amber) > 0.03
    # As lines alone nothing has a colour, and the scale does not say so.
    window.next_mode()
    assert share_like(waited_for(window), amber) < 0.01
    window.close()


def test_colours_of_a_field_never_look_better_than_the_numbers() -> None:
    field = ValueField(
        mesh=mesh_of(placed_part().model),
        parents=np.arange(6),
        values=np.array([0.0, 0.0, 1.0 + 1e-9, -1e9, np.nan, 0.999]),
        good=np.array([True, False, True, True, True, True]),
        reach_mm=1.0,
    )
    base = np.full((6, 3), 17, dtype=np.uint8)
    for theme in THEMES.values():
        found = [
            "#" + "".join(f"{c:02x}" for c in row) for row in field_colours(field, base, theme)
        ]
        wanted = [
            surface_colour(theme, DeviationClass.WITHIN),
            surface_colour(theme, DeviationClass.WITHIN_ONLY),
            surface_colour(theme, DeviationClass.MORE),
            surface_colour(theme, DeviationClass.LESS),
            "#111111",
        ]
        assert found[:5] == wanted
        # Close to the limit it is neither the colour of the middle nor that beyond.
        assert found[5] not in wanted


def test_the_report_says_how_far_colours_reach() -> None:
    view, nominals = deviating_job()
    aligned = replace(view, placed_part=placed_part())
    words = "Colour: between points, to 10.0 mm. Grey: not measured."
    assert words in texts(lay_out(sample_report(aligned, nominals=nominals)))
    rough = replace(view, placed_part=placed_part(is_rough=True))
    assert words not in texts(lay_out(sample_report(rough, nominals=nominals)))
    assert words not in texts(lay_out(sample_report(view, nominals=nominals)))
