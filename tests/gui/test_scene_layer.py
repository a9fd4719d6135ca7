"""Static layers of the 3-D view are made once and painted in small pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QColor, QFont, QImage, QPainter
from PySide6.QtWidgets import QApplication

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobView, Target
from ocmm_core.inspection.finished import reopen_job
from ocmm_gui.app import make_application
from ocmm_gui.kit import DEFAULT_THEME, THEMES, text_font
from ocmm_gui.scene import Orbit, StillScene, _scene_layer, paint_scene
from ocmm_gui.scene._scene import Dots, Lines, Tag
from ocmm_gui.scene._scene_layer import SceneLayer, painted_still
from ocmm_gui.views import job_items
from ocmm_gui.views._contents import JobDrawing, target_items
from tests.gui.long_job import make_long_job

THEME = THEMES[DEFAULT_THEME]
SIZE = QSize(500, 300)


@pytest.fixture(scope="module")
def app() -> QApplication:
    return make_application()


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> JobView:
    folder = tmp_path_factory.mktemp("scene")
    return reopen_job(make_long_job(folder), folder, calibrations=folder).view


def scene_of(job: JobView, azimuth: float = 0.7) -> StillScene:
    items, reach = job_items(job, THEME)
    start = Orbit(np.zeros(3), azimuth, 0.4, 10.0, np.array([0.0, 0.0, 1.0]))
    orbit = start.fitted(reach, SIZE.width(), SIZE.height())
    return StillScene(items, orbit, SIZE, 1.0, THEME.panel)


def at_once(scene: StillScene, font: QFont) -> QImage:
    return painted_still(scene, font).image


def by_painter(scene: StillScene, font: QFont) -> QImage:
    image = QImage(SIZE, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(QColor(scene.background))
    painter = QPainter(image)
    box = QRectF(0.0, 0.0, SIZE.width(), SIZE.height())
    paint_scene(painter, scene.items, scene.orbit, box, font, scene.background)
    painter.end()
    return image


def channels(image: QImage) -> Float:
    size = (image.height(), image.width(), 4)
    return np.frombuffer(image.constBits(), np.uint8).reshape(size)[..., :3].astype(np.float64)


def test_a_picture_by_loops_is_that_by_qpainter_but_for_rims(job: JobView) -> None:
    scene, font = scene_of(job), text_font(12)
    scene = replace(scene, items=tuple(i for i in scene.items if not isinstance(i, Tag)))
    ours, theirs = (channels(made(scene, font)) for made in (at_once, by_painter))
    drawn = np.abs(theirs - theirs[0, 0]).max(axis=2) > 16.0
    off = np.abs(ours - theirs).max(axis=2)
    # Coverage of a pixel is computed otherwise, and lines have round ends there.
    assert drawn.sum() > 5000
    assert off[drawn].mean() < 12.0
    assert (off > 128.0).sum() < 0.01 * drawn.sum()


def test_dots_lie_over_lines_also_of_features_that_changed_last(app: QApplication) -> None:
    line = Lines(np.array([[[-50.0, 0.0, 0.0], [50.0, 0.0, 0.0]]]), "#ff0000", 3.0)
    dot = Dots(np.zeros((1, 3)), "#00ff00", 12.0, "#0000ff")
    orbit = Orbit(np.zeros(3), 0.7, 0.4, 60.0, np.array([0.0, 0.0, 1.0]))
    below = StillScene((dot,), orbit, SIZE, 1.0, THEME.panel)
    scene = replace(below, items=(line,), below=below)
    layer = SceneLayer(app)
    for _ in range(3):
        # The third time the lines below are a kept picture.
        scene = replace(scene, items=(*scene.items,))
        while not layer.shows(scene):
            layer.picture(scene, text_font(12))
            app.processEvents()
        image = layer.picture(scene, text_font(12)).image
        places = orbit.project(np.array([[0.0, 0.0, 0.0], [25.0, 0.0, 0.0]]), *SIZE.toTuple())
        seen = [image.pixelColor(int(x), int(y)) for x, y, _ in places]
        assert seen == [QColor("#00ff00"), QColor("#ff0000")]
    layer.deleteLater()


def test_only_what_has_changed_is_made_again(job: JobView) -> None:
    drawing = JobDrawing()
    before, _ = drawing.items(job, THEME)
    assert drawing.items(job, THEME)[0] is before
    first, *others = job.features
    less = replace(first, points=first.points[:-1])
    after, reach = drawing.items(replace(job, features=(less, *others)), THEME)
    alike = {id(item) for item in before} & {id(item) for item in after}
    own, _ = JobDrawing().items(replace(job, features=(less,)), THEME)
    assert len(after) - len(alike) <= len(own)
    # The same picture as by drawing all of it.
    fresh, again = job_items(replace(job, features=(less, *others)), THEME)
    assert [type(item) for item in after] == [type(item) for item in fresh]
    np.testing.assert_array_equal(reach, again)


def test_a_theme_and_a_chosen_point_change_what_is_seen(job: JobView) -> None:
    drawing = JobDrawing()
    before, _ = drawing.items(job, THEME)
    other = next(theme for name, theme in THEMES.items() if name != DEFAULT_THEME)
    assert drawing.items(job, other)[0] is not before
    number = job.features[0].points[0].number
    chosen, _ = drawing.items(job, THEME, number)
    assert len(chosen) == len(before) + 2


@pytest.mark.parametrize("slice_s", [10.0, 0.0])
def test_the_picture_is_the_same_however_long_the_slices_are(
    app: QApplication, job: JobView, monkeypatch: pytest.MonkeyPatch, slice_s: float
) -> None:
    monkeypatch.setattr(_scene_layer, "_SLICE_S", slice_s)
    layer, scene, font = SceneLayer(app), scene_of(job), text_font(12)
    told: list[None] = []
    layer.changed.connect(lambda: told.append(None))
    first = layer.picture(scene, font).image
    wanted = at_once(scene, font)
    assert (first == wanted) == (slice_s > 0.0)
    for _ in range(10 * len(scene.items)):
        app.processEvents()
    assert layer.picture(scene, font).image == wanted
    assert bool(told) == (slice_s == 0.0)
    layer.deleteLater()


def test_the_scene_before_is_shown_until_the_next_is_painted_if_the_eye_has_not_moved(
    app: QApplication, job: JobView, monkeypatch: pytest.MonkeyPatch
) -> None:
    layer, scene, font = SceneLayer(app), scene_of(job), text_font(12)
    layer.picture(scene, font)
    for _ in range(10 * len(scene.items)):
        app.processEvents()
    monkeypatch.setattr(_scene_layer, "_SLICE_S", 0.0)
    before = at_once(scene, font)
    more = replace(scene, items=scene.items[::-1])
    assert layer.picture(more, font).image == before
    turned = scene_of(job, 1.4)
    assert layer.picture(turned, font).image not in (before, at_once(turned, font))
    # Back to the shown state: nothing is painted again.
    assert layer.picture(scene, font).image == before
    # Words of another theme could not be read over the background of this one.
    other = replace(scene, background="#ffffff")
    assert layer.picture(other, font).image.pixelColor(1, 1) == QColor("#ffffff")
    layer.deleteLater()


def test_the_next_point_of_a_line_has_a_ring_though_nobody_knows_its_side(job: JobView) -> None:
    up = np.array([0.0, 0.0, 1.0])
    place, tip = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 60.0])
    for normal, stems in ((up, 1), (np.zeros(3), 0)):
        target = Target("E", place, normal, place + 3.0 * normal)
        items = target_items(replace(job, target=target), tip, THEME, up)
        lines = [item.segments for item in items if isinstance(item, Lines)]
        assert len(lines) == 1 + stems
        assert np.ptp(lines[-1][..., 2]) == pytest.approx(0.0, abs=1e-9)
        assert np.linalg.norm(lines[-1][..., :2] - place[:2], axis=-1).min() > 1.0


@pytest.mark.parametrize("slice_s", [10.0, 0.0])
def test_a_scene_over_a_cached_one_is_the_picture_painted_at_once(
    app: QApplication, job: JobView, monkeypatch: pytest.MonkeyPatch, slice_s: float
) -> None:
    monkeypatch.setattr(_scene_layer, "_SLICE_S", slice_s)
    layer, scene, font = SceneLayer(app), scene_of(job), text_font(12)
    plain = tuple(item for item in scene.items if not isinstance(item, Tag))
    below = replace(scene, items=plain[:-6])
    # Once painted directly, once as a picture that is kept, once from it.
    for first in (6, 5, 4):
        over = replace(scene, items=plain[-first:], below=below)
        layer.picture(over, font)
        for _ in range(10 * len(scene.items)):
            app.processEvents()
        assert layer.shows(over)
        wanted = at_once(replace(scene, items=(*below.items, *over.items)), font)
        # Of 255: antialiased edges one over the other are rounded twice.
        assert far_off(layer.picture(over, font).image, wanted) <= 4
    layer.deleteLater()


def far_off(image: QImage, other: QImage) -> int:
    """Return the greatest difference of a colour of a pixel, 0 to 255."""
    bytes_of = [np.array(one.constBits()).astype(int) for one in (image, other)]
    return int(np.abs(bytes_of[0] - bytes_of[1]).max())


def test_features_at_rest_are_the_same_tuple_while_another_one_grows(job: JobView) -> None:
    drawing = JobDrawing()
    drawing.items(job, THEME)
    first, *others = job.features
    grown = [replace(first, points=first.points[:-count]) for count in (1, 2, 3)]
    drawing.items(replace(job, features=(grown[0], *others)), THEME)
    still = drawing.still
    for feature in grown[1:]:
        items, _ = drawing.items(replace(job, features=(feature, *others)), THEME)
        assert drawing.still is still
        assert {id(one) for one in (*still, *drawing.changing)} == {id(one) for one in items}
