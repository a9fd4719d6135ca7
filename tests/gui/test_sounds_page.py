"""Sounds differ in rhythm and direction, each is explained, and played ones are shown."""

from __future__ import annotations

import wave
from io import BytesIO
from itertools import combinations, pairwise

import numpy as np
import pytest
from PySide6.QtGui import QAccessible
from pytestqt.qtbot import QtBot

from ocmm_gui.home._settings_parts import SOUND_WORDS, SoundsPage
from ocmm_gui.kit import Sound
from ocmm_gui.kit._sound import tone_wav

LONG_S = 0.15
"""Tones that are shorter are heard as short ones."""


def rhythm(sound: Sound) -> tuple[str, ...]:
    """Return long and short tones and pauses, without any pitch."""
    return tuple(
        "pause" if not hertz else "long" if length >= LONG_S else "short"
        for hertz, length in sound.value
    )


def direction(sound: Sound) -> tuple[int, ...]:
    """Return whether the melody goes up (1), stays (0) or goes down (-1) at each step."""
    pitches = [hertz for hertz, _ in sound.value if hertz]
    return tuple(int(np.sign(b - a)) for a, b in pairwise(pitches))


@pytest.mark.parametrize(("first", "second"), list(combinations(Sound, 2)))
def test_no_two_sounds_go_alike(first: Sound, second: Sound) -> None:
    # Combined: a sound with another melody is distinguishable at any speed.
    assert direction(first) != direction(second) or rhythm(first) != rhythm(second)
    pitches = [max(hertz for hertz, _ in sound.value) for sound in (first, second)]
    # A tone and a half in a hall with echoes; the taps differ by their pause.
    higher = abs(12.0 * np.log2(pitches[0] / pitches[1]))
    assert higher > 1.0 or direction(first) != direction(second)


def test_a_single_short_tone_is_the_approach_alone() -> None:
    assert ("short",) not in [rhythm(sound) for sound in Sound]


@pytest.mark.parametrize("sound", Sound)
def test_volume_makes_it_louder_and_nothing_else(sound: Sound) -> None:
    loud = {}
    for volume in (5, 50, 100):
        with wave.open(BytesIO(tone_wav(sound.value, volume))) as file:
            samples = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
        loud[volume] = int(np.abs(samples).max()), samples.size
    assert 0 < loud[5][0] < loud[50][0] < loud[100][0] <= 32767
    assert len({size for _, size in loud.values()}) == 1


def test_every_sound_is_on_the_page_with_its_meaning(qtbot: QtBot) -> None:
    assert set(SOUND_WORDS) == set(Sound)
    page = SoundsPage()
    qtbot.addWidget(page)
    page.show()
    page.use(enabled=True, volume=50)
    assert set(page.buttons) == {*Sound, None}
    names = set()
    for sound, button in page.buttons.items():
        interface = QAccessible.queryAccessibleInterface(button)
        names.add(interface.text(QAccessible.Text.Name))
        described = interface.text(QAccessible.Text.Description)
        if sound is not None:
            assert SOUND_WORDS[sound].goes in described
            assert SOUND_WORDS[sound].means in described
        # Without a sound device a sentence appears, and no error is raised.
        button.click()
    assert len(names) == len(Sound) + 1
    page.use(enabled=False, volume=50)
    assert not any(button.isEnabled() for button in page.buttons.values())
    assert "off" in page.told.text()
    page.close_work()
