"""The 3-D view over all steps of three plans: the work is visible, and labels do not overlap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_cad.step import read_model
from ocmm_core.camera import load_rig
from ocmm_core.composition import RECOMMENDED_RIG
from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.part_model import PartModel
from ocmm_core.tracking import load_probe
from ocmm_gui.kit import THEMES
from ocmm_gui.rendering import RenderMode
from ocmm_gui.views import PointView
from tests.cad.step_models import bent_pocket, written
from tests.gui.plan_steps import Step, measured_steps, nominal_steps
from tests.gui.test_point_view import live_at
from tests.host import HANG_MS, HANG_S
from tests.made_parts import PartMaker

SIZES = ((616, 430), (1250, 800), (2500, 1500))
CASES = [*product(("demo", "gauge", "model"), SIZES)]


def demo_part() -> PartModel:
    """Return the part below the nominals of the demonstration, in their frame."""
    maker = PartMaker().box((-165.0, -64.0, -12.0), (165.0, 64.0, 0.0))
    maker.box((-100.0, -20.0, 0.0), (-44.0, 18.0, 20.34)).ball((-140.0, 0.0, 50.0), 9.99)
    maker.tube((-140.0, 0.0, 0.0), 41.0, 4.0).box((-16.0, -32.0, 0.0), (80.0, 32.0, 15.0))
    for x, y in ((2.0, -17.0), (62.0, -17.0), (62.0, 17.0), (2.0, 17.0)):
        maker.tube((x, y, 0.0), 15.0, 10.0, hollow=True)
    return maker.tube((114.0, 0.0, 0.0), 32.0, 15.0).disc((114.0, 0.0, 32.0), 15.0).part()


def model_plan() -> tuple[tuple[NominalFeature, ...], PartModel]:
    """Return a block with a post and a sleeve, and features on all sides."""
    maker = PartMaker().box((0.0, 0.0, 0.0), (120.0, 80.0, 40.0))
    maker.tube((30.0, 40.0, 40.0), 35.0, 12.0).disc((30.0, 40.0, 75.0), 12.0)
    maker.tube((90.0, 40.0, 40.0), 20.0, 20.0)
    model = maker.tube((90.0, 40.0, 40.0), 20.0, 14.0, hollow=True).part()
    planes = [
        ("TOP", (60.0, 70.0, 40.0), (0.0, 0.0, 1.0)), ("LEFT", (0.0, 40.0, 20.0), (-1.0, 0.0, 0.0)),
        ("FRONT", (60.0, 0.0, 20.0), (0.0, -1.0, 0.0)),
        ("BACK", (60.0, 80.0, 20.0), (0.0, 1.0, 0.0)),
        ("RIGHT", (120.0, 40.0, 20.0), (1.0, 0.0, 0.0)),
    ]  # fmt: skip
    features = [
        NominalFeature(
            name=name, shape=Shape.PLANE, points=6, point=point, direction=direction,
            length=20.0, width=15.0,
        )
        for name, point, direction in planes
    ]  # fmt: skip
    features.append(
        NominalFeature(
            name="POST", shape=Shape.CYLINDER, points=12, point=(30.0, 40.0, 58.0),
            direction=(0.0, 0.0, 1.0), diameter=24.0, length=20.0, side="outer",
        )
    )  # fmt: skip
    features.append(
        NominalFeature(
            name="BORE", shape=Shape.CYLINDER, points=12, point=(90.0, 40.0, 50.0),
            direction=(0.0, 0.0, 1.0), diameter=28.0, length=10.0, side="inner",
        )
    )  # fmt: skip
    return tuple(features), model


def step_plan(folder: Path) -> tuple[tuple[NominalFeature, ...], PartModel]:
    """Return the program's plan from a STEP file: a block with a pocket."""
    read = read_model(
        written(folder / "pocket.stp", bent_pocket()), timeout_s=HANG_S, with_part=True
    )
    assert read.part is not None
    return read.features, read.part


@pytest.fixture(scope="module")
def plans(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Step]]:
    demo = list(measured_steps("demo.toml", tmp_path_factory.mktemp("demo"), demo_part()))
    features, model = model_plan()
    return {
        "demo": demo,
        "gauge": list(measured_steps("gauge.toml", tmp_path_factory.mktemp("gauge"))),
        "model": list(nominal_steps(features, model, demo[0].job)),
    }


class Watched:
    """A view that is shown one step after another."""

    def __init__(self, qtbot: QtBot, size: tuple[int, int]) -> None:
        self.body = load_probe(resource("probes", "standard.toml"))
        self.view = PointView(load_rig(RECOMMENDED_RIG), self.body)
        self.view.resize(*size)
        qtbot.addWidget(self.view)
        self.view.show()
        self._job: JobView | None = None

    def show(self, step: Step) -> None:
        if step.job is not self._job:
            self._job = step.job
            self.view.show_job(step.job)
        self.view.show_live(live_at(step.ball_world, step.ball_world - self.body.tip_probe))

    def paint(self) -> None:
        self.view.grab()


def every(steps: list[Step], n: int) -> Iterator[Step]:
    return iter(steps[::n])


@pytest.mark.parametrize(("plan", "size"), CASES)
def test_ball_target_and_feature_are_in_the_picture_at_every_step(
    qtbot: QtBot, plans: dict[str, list[Step]], plan: str, size: tuple[int, int]
) -> None:
    watched, turns, unseen, targets = Watched(qtbot, size), 0, 0, 0
    side = None
    for step in plans[plan]:
        watched.show(step)
        work = watched.view.work
        assert len(work.ball) == 1
        assert watched.view.shows(work.needed())
        now = watched.view.projected(np.concatenate([np.zeros((1, 3)), np.eye(3)]))
        now = np.round((now[1:] - now[0]) / np.linalg.norm(now[1:] - now[0]), 6)
        turns += side is not None and not np.array_equal(now, side)
        side = now
        if step.job.target is not None:
            targets += 1
            unseen += not watched.view.sees(step.job.target)
    assert targets > 50
    # Inside a bore a place on the near wall is seen from nowhere well: it shows through.
    assert unseen <= (0 if plan == "gauge" else 0.02 * targets)
    # It does not turn with every point.
    assert turns < 0.15 * len(plans[plan])


@pytest.mark.slow
def test_the_plan_of_a_step_file_is_followed(
    qtbot: QtBot, plans: dict[str, list[Step]], tmp_path: Path
) -> None:
    watched, steps = Watched(qtbot, SIZES[1]), 0
    for step in nominal_steps(*step_plan(tmp_path), plans["demo"][0].job):
        watched.show(step)
        assert watched.view.shows(watched.view.work.needed())
        steps += 1
    assert steps > 50


@pytest.mark.parametrize(("plan", "size"), CASES)
def test_words_cover_neither_each_other_nor_ball_nor_target(
    qtbot: QtBot, plans: dict[str, list[Step]], plan: str, size: tuple[int, int]
) -> None:
    watched = Watched(qtbot, size)
    steps = plans[plan]
    seen = 0
    for step in every(steps, max(len(steps) // 16, 1)):
        watched.show(step)
        watched.paint()
        words, free = watched.view.painted_labels(), watched.view.kept_free
        again = watched.view.painted_labels()
        watched.paint()
        assert [(text, rect) for text, rect in watched.view.painted_labels()] == again
        seen += len(words)
        for (one, first), (other, second) in combinations(words, 2):
            assert not first.intersects(second), (one, other)
        ball, target = watched.view.work.ball, watched.view.work.target
        places = [ball] if target is None else [ball, target.surface_world[None]]
        for place in np.concatenate(places):
            point = QPointF(*watched.view.projected(place[None])[0].tolist())
            assert any(rect.contains(point) for rect in free)
        for text, rect in words:
            assert not any(rect.intersects(kept) for kept in free), text
            assert watched.view.rect().contains(rect.toAlignedRect()), text
    assert seen > 16


def test_the_view_of_the_user_wins_until_it_is_given_back(
    qtbot: QtBot, plans: dict[str, list[Step]]
) -> None:
    watched = Watched(qtbot, SIZES[1])
    watched.show(plans["model"][0])
    QTest.keyClick(watched.view, Qt.Key.Key_Left)
    for _ in range(12):
        QTest.keyClick(watched.view, Qt.Key.Key_Plus)
    mark = np.eye(3)
    before = watched.view.projected(mark)
    for step in plans["model"]:
        watched.show(step)
        np.testing.assert_array_equal(watched.view.projected(mark), before)
    watched.view.fit()
    assert watched.view.shows(watched.view.work.needed())


def test_a_part_that_nobody_has_aligned_says_so_until_it_is(
    qtbot: QtBot, plans: dict[str, list[Step]]
) -> None:
    watched = Watched(qtbot, SIZES[1])
    first, last = plans["demo"][0], plans["demo"][-1]
    watched.show(first)
    assert "roughly" in watched.view.rough_words()
    aligned = next(
        step for step in plans["demo"] if step.job.target and not step.job.target.approximate
    )
    watched.show(aligned)
    assert not watched.view.rough_words()
    assert last.job.complete


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("with_part", [True, False])
def test_the_first_place_is_in_the_picture_before_anything_is_located(
    qtbot: QtBot, plans: dict[str, list[Step]], size: tuple[int, int], with_part: bool
) -> None:
    watched = Watched(qtbot, size)
    step = plans["demo"][0]
    job = step.job if with_part else replace(step.job, placed_part=None)
    assert job.planned is not None
    assert job.target is None
    watched.show(Step(job, step.ball_world))
    watched.paint()
    work = watched.view.work
    assert work.target is not None
    assert watched.view.shows(work.needed())
    words = [text for text, _ in watched.view.painted_labels()]
    assert job.planned.nominal.name in words
    assert "touch here first, roughly" in words
    # A sentence marks the place as a guess, and names the feature to touch.
    said = watched.view.rough_words()
    assert "roughly" in said
    assert job.planned.nominal.name in said


def test_a_moving_probe_paints_no_part(qtbot: QtBot, plans: dict[str, list[Step]]) -> None:
    watched = Watched(qtbot, SIZES[1])
    step = plans["model"][10]
    watched.show(step)
    settle(qtbot, watched.view)
    before = watched.view.still.scene
    for shift in np.linspace(0.0, 6.0, 7):
        watched.show(Step(step.job, step.ball_world + np.array([shift, 0.0, 0.0])))
        watched.paint()
        assert watched.view.still.scene is before
    watched.view.next_mode()
    settle(qtbot, watched.view)
    assert watched.view.still.scene is not before
    assert watched.view.mode() is RenderMode.HIDDEN_LINES


def test_points_behind_the_part_are_not_drawn_over_it(
    qtbot: QtBot, plans: dict[str, list[Step]]
) -> None:
    watched = Watched(qtbot, SIZES[1])
    watched.view.set_theme(THEMES["light"])
    step = plans["demo"][-1]
    bore = step.job.feature("BORE_A").points[0].surface_world
    watched.show(Step(step.job, bore + np.array([-90.0, 0.0, 60.0])))
    images = []
    for lift in (0, 1):
        # From below the bed hides the features on its top.
        for _ in range(16):
            QTest.keyClick(watched.view, Qt.Key.Key_Up if lift else Qt.Key.Key_Down)
        settle(qtbot, watched.view)
        image = watched.view.grab().toImage()
        x, y = watched.view.projected(bore[None])[0].astype(int).tolist()
        images.append([image.pixelColor(x + dx, y) for dx in (-1, 0, 1)])
    below, above = images
    assert len({colour.rgb() for colour in below}) == 1, "bare metal"
    assert below[1] != above[1]


def test_an_animated_view_goes_there_calmly_and_arrives(
    qtbot: QtBot, plans: dict[str, list[Step]]
) -> None:
    body = load_probe(resource("probes", "standard.toml"))
    view = PointView(load_rig(RECOMMENDED_RIG), body, animated=True)
    view.resize(800, 600)
    qtbot.addWidget(view)
    view.show()
    at_once = Watched(qtbot, (800, 600))
    for step in (plans["model"][0], plans["model"][len(plans["model"]) // 2]):
        view.show_job(step.job)
        view.show_live(live_at(step.ball_world, step.ball_world - body.tip_probe))
        at_once.show(step)
        # Wherever it is on its way, the ball is in the picture.
        assert view.shows(step.ball_world[None])
        qtbot.waitUntil(lambda: not view.easing.is_running(), timeout=HANG_MS)
    assert view.shows(view.work.needed())


def settle(qtbot: QtBot, view: PointView) -> None:
    """Let the view come to rest and be painted in full."""
    qtbot.waitUntil(lambda: not view.is_moving(), timeout=HANG_MS)
    view.grab()
    while not view.is_painted():
        QApplication.processEvents()
        view.grab()
