"""Guidance: the ring closes, the tone rises, the picture is that of the step."""

from __future__ import annotations

import io
import wave
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import Target, cue
from ocmm_core.inspection.plan import load_plan
from ocmm_gui.kit import THEMES, Approach, SoundPlayer
from ocmm_gui.kit._sound import scale_step, step_wav
from ocmm_gui.operator._view_parts import TargetRing
from ocmm_gui.views import StepPicture
from ocmm_gui.views._contents import nominal_items

PLACE = np.array([10.0, 20.0, 30.0])
UP = np.array([0.0, 0.0, 1.0])
TARGET = Target("BORE", PLACE, UP, PLACE + 3.0 * UP)


class Heard(SoundPlayer):
    """A player that records its requested sounds."""

    def __init__(self) -> None:
        super().__init__(enabled=False)
        self.pitches: list[float] = []

    def play_pitch(self, hertz: float) -> None:
        """Remember the pitch."""
        self.pitches.append(hertz)


def _at(distance: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(TARGET.ball_world + distance * UP)


def test_the_tone_rises_on_the_way_and_a_probe_at_rest_is_silent(qtbot: QtBot) -> None:
    heard = Heard()
    approach = Approach(heard)
    for distance in (200.0, 120.0, 80.0, 40.0, 20.0, 10.0, 5.0, 2.0, 0.5):
        approach.update(TARGET, _at(distance))
    assert heard.pitches == sorted(heard.pitches)
    assert heard.pitches[-1] > 4.0 * heard.pitches[0]
    count = len(heard.pitches)
    for _ in range(5):
        approach.update(TARGET, _at(0.5))
    approach.enabled = False
    approach.update(TARGET, _at(50.0))
    approach.update(None, _at(20.0))
    assert len(heard.pitches) == count


@pytest.mark.parametrize("distance", [100.0, 40.0, 12.0, 5.0, 1.0])
def test_what_is_heard_is_higher_the_nearer_the_point_is(distance: float) -> None:
    assert _heard_hz(0.5 * distance) >= _heard_hz(distance)
    # The scale has six steps in an octave: the played tone is within half a step of the cue.
    assert abs(np.log2(_heard_hz(distance) / cue(distance).tone_hz)) <= 1.0 / 12.0 + 1e-3
    assert _heard_hz(1.0) == pytest.approx(8.0 * _heard_hz(100.0), rel=1e-3)


def _heard_hz(distance: float) -> float:
    """Return the strongest frequency in the samples that are played."""
    with wave.open(io.BytesIO(step_wav(scale_step(cue(distance).tone_hz)))) as file:
        rate, frames = file.getframerate(), file.readframes(file.getnframes())
    samples = np.frombuffer(frames, "<i2").astype(float)
    # Neither clipped nor with the click of a tone that is cut off.
    assert 10_000 < np.abs(samples).max() < 32_000
    assert max(abs(samples[0]), abs(samples[-1])) < 500
    length = 1 << 17
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples)), length))
    return float(spectrum.argmax() * rate / length)


def test_the_ring_says_how_far_the_next_point_is(qtbot: QtBot) -> None:
    ring = TargetRing()
    qtbot.addWidget(ring)
    ring.resize(120, 140)
    ring.show_target(TARGET, _at(12.0))
    assert ring.distance_text() == "12 mm to the next point"
    far = _accented(ring)
    ring.show_target(TARGET, _at(1.5))
    near = _accented(ring)
    # The ring is drawn in a line of constant width: nearer is shorter.
    assert 0 < near < far
    ring.show_target(TARGET, None)
    assert ring.distance_text() == ""


def _accented(ring: TargetRing) -> int:
    image = ring.grab().toImage()
    colours = {THEMES["dark"].accent, THEMES["dark"].good}
    return sum(
        image.pixelColor(x, y).name() in colours
        for x in range(image.width())
        for y in range(image.height())
    )


def test_the_picture_of_a_step_is_the_file_or_the_feature(qtbot: QtBot, tmp_path: Path) -> None:
    plan = load_plan(resource("plans", "gauge.toml"))
    picture = StepPicture()
    qtbot.addWidget(picture)
    picture.resize(240, 150)
    shown = set()
    for feature in plan.features:
        picture.show_step(feature, tmp_path)
        assert not picture.has_picture()
        items, reach = nominal_items(feature, "#3cc4ff", "#ffffff")
        assert items
        assert np.isfinite(reach).all()
        shown.add(bytes(picture.grab().toImage().constBits()))
    assert len(shown) >= 8
    image = QImage(40, 30, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.red)
    assert image.save(str(tmp_path / "step.png"))
    with_picture = type(plan.features[0])(
        name="P", shape=plan.features[0].shape, points=3, point=(0.0, 0.0, 0.0), picture="step.png"
    )
    picture.show_step(with_picture, tmp_path)
    assert picture.has_picture()
