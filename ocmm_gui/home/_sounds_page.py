"""Page of all sounds: name, description, meaning, and visible equivalent."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QGridLayout, QPushButton, QScrollArea, QVBoxLayout, QWidget

from ocmm_gui.home._setting_row import HIGH_PX
from ocmm_gui.kit import (
    NarrowButton,
    PlainLabel,
    Sound,
    SoundPlayer,
    later,
    literal,
    panel,
    sentence_label,
    text_font,
    tr,
)

_APPROACH_HZ = (587.0, 740.0, 880.0)
_NEAR_MS = 250


@dataclass(frozen=True, slots=True)
class SoundWords:
    name: str
    goes: str
    means: str
    """Event, and its visible equivalent."""


SOUND_WORDS = {
    Sound.TAKEN: SoundWords(
        later("Point taken"), later("two short, high, rising"),
        later("A point is in the job. The readout flashes green, the count goes up."),
    ),
    Sound.REFUSED: SoundWords(
        later("Touch refused"), later("two low, falling"),
        later("No point was taken. The readout flashes red, the reason stands below it."),
    ),
    Sound.WRONG_FACE: SoundWords(
        later("Wrong face"), later("low and up, twice"),
        later("The touch was on another face. No point was taken, the reason stands below."),
    ),
    Sound.FEATURE_COMPLETE: SoundWords(
        later("Feature finished"), later("three short, rising"),
        later("Nothing speaks against it. The verdict stands in words with a tick."),
    ),
    Sound.IN_DOUBT: SoundWords(
        later("In doubt"), later("three, down and up again"),
        later("Neither conform nor not conform. The verdict stands in words with a triangle."),
    ),
    Sound.OUT_OF_TOLERANCE: SoundWords(
        later("Not conform"), later("three long, low, the last one lower"),
        later("Out of tolerance. The verdict stands in words with a cross."),
    ),
    Sound.TICK: SoundWords(
        later("Countdown"), later("two taps"),
        later("A sweep is about to begin. The page counts down."),
    ),
    Sound.STARTED: SoundWords(
        later("Sweep begins"), later("one long"),
        later("Poses are taken now. The page says so and counts them."),
    ),
}  # fmt: skip
"""One entry per sound; a test compares it with `Sound`."""

_APPROACH = SoundWords(
    later("Approach"), later("single short tones, rising"),
    later("The ball comes nearer to the next point. Ring and distance show it; U turns it off."),
)  # fmt: skip


class SoundsPage(QWidget):
    """One line per sound, with a play button."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Test of sounds"))
        self._player: SoundPlayer | None = None
        self._enabled, self._volume = True, 0
        self.told = sentence_label(tr("About the sounds"), 15)
        self.buttons: dict[Sound | None, QPushButton] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(6)
        grid.setColumnStretch(1, 2)
        grid.setColumnStretch(2, 5)
        lines: tuple[tuple[Sound | None, SoundWords], ...] = (
            *SOUND_WORDS.items(), (None, _APPROACH),
        )  # fmt: skip
        for row, (sound, words) in enumerate(lines):
            name, goes, means = tr(words.name), tr(words.goes), tr(words.means)
            button = NarrowButton(f"♪ {name}")
            button.setAccessibleName(tr("Play: {name}").format(name=name))
            button.setAccessibleDescription(f"{goes}. {means}")
            button.setToolTip(literal(f"{goes}. {means}"))
            button.setMinimumHeight(HIGH_PX)
            button.setFont(text_font(16))
            button.clicked.connect(lambda _checked=False, sound=sound: self.play(sound))
            self.buttons[sound] = button
            grid.addWidget(button, row, 0)
            for column, text in enumerate((goes, means), 1):
                label = sentence_label(tr("About {setting}").format(setting=name), 15)
                label.setText(text)
                label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
                grid.addWidget(label, row, column)
        grid.setRowStretch(99, 1)
        head = PlainLabel(tr("Everything that is heard is seen, too. Volume and off: Window."))
        head.setFont(text_font(15))
        head.setProperty("role", "muted")
        head.setWordWrap(True)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setWidget(panel(grid))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(head)
        layout.addWidget(area, 1)
        layout.addWidget(self.told)

    def use(self, *, enabled: bool, volume: int) -> None:
        """Set the volume, or show that sounds are off."""
        self._enabled, self._volume = enabled, volume
        if self._player is not None:
            self._player.enable(enabled, volume)
        for button in self.buttons.values():
            button.setEnabled(enabled)
        self.told.setText("" if enabled else tr("Sounds are off. Turn them on in Window."))

    def play(self, sound: Sound | None) -> None:
        """Play a sound; None plays the guiding tones."""
        if self._player is None:
            # Files are only written on demand.
            self._player = SoundPlayer(self, enabled=self._enabled, volume=self._volume)
        if not self._player.can_play():
            self.told.setText(
                tr("Nothing is heard: no program that plays sounds was found on this computer.")
            )
            return
        self.told.setText("")
        if sound is not None:
            self._player.play(sound)
            return
        for place, hertz in enumerate(_APPROACH_HZ):
            QTimer.singleShot(_NEAR_MS * place, self, lambda hertz=hertz: self._step(hertz))

    def close_work(self) -> None:
        if self._player is not None:
            self._player.close()
            self._player = None

    def _step(self, hertz: float) -> None:
        if self._player is not None:
            self._player.play_pitch(hertz)
