"""Sounds for busy hands and eyes; silent if none can be played.

Qt's own player is not shipped (it includes a video codec library). Windows uses ``winsound``; Linux
passes the tone to the sound system's player without waiting. The readout always flashes, so nothing
depends on hearing.
"""

from __future__ import annotations

import io
import math
import sys
import wave
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, QProcess, QStandardPaths, QTemporaryDir

from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import Verdict

if TYPE_CHECKING:
    from ocmm_core.inspection.evaluation import Target

RATE_HZ = 22050
_CONCERT_HZ, _STEPS_PER_OCTAVE = 440.0, 6
_PITCH_S = 0.05
"""Length of the guiding tone."""
USUAL_VOLUME = 80
"""Default volume, per cent."""
_PLAYERS = (("paplay",), ("pw-play",), ("aplay", "-q"))


class Sound(Enum):
    """Sounds: (tone in Hz, length in s) in sequence; 0 Hz is a pause.

    All differ in rhythm and melody, so that they remain distinct without high tones. Single short
    tones are reserved for `Approach`.
    """

    TAKEN = ((1320.0, 0.05), (1976.0, 0.08))
    REFUSED = ((220.0, 0.16), (165.0, 0.22))
    WRONG_FACE = ((196.0, 0.08), (294.0, 0.08), (0.0, 0.06), (196.0, 0.08), (294.0, 0.08))
    FEATURE_COMPLETE = ((880.0, 0.08), (1109.0, 0.08), (1320.0, 0.16))
    TICK = ((587.0, 0.04), (0.0, 0.05), (587.0, 0.04))
    STARTED = ((660.0, 0.45),)
    TOO_FAST = ((988.0, 0.05), (0.0, 0.04), (988.0, 0.05), (0.0, 0.04), (988.0, 0.05))
    LOST_CONTACT = ((494.0, 0.06), (0.0, 0.05), (370.0, 0.06), (0.0, 0.05), (370.0, 0.06))
    SCAN_DONE = ((784.0, 0.06), (988.0, 0.06), (1175.0, 0.06), (1568.0, 0.14))
    IN_DOUBT = ((523.0, 0.12), (392.0, 0.12), (523.0, 0.20))
    OUT_OF_TOLERANCE = ((330.0, 0.18), (330.0, 0.18), (247.0, 0.30))


def tone_wav(notes: Sequence[tuple[float, float]], volume: int = USUAL_VOLUME) -> bytes:
    """Return notes (Hz, s) as WAV, mono, 16 bit; ``volume``: per cent, about even to the ear."""
    swing = 0.8 * (min(max(volume, 0), 100) / 100.0) ** 2
    parts = []
    for pitch, length in notes:
        t = np.arange(int(length * RATE_HZ)) / RATE_HZ
        # Ramps of 8 ms avoid clicks.
        ramp = np.clip(np.minimum(t, length - t) / 0.008, 0.0, 1.0)
        parts.append(swing * ramp * np.sin(2.0 * np.pi * pitch * t))
    samples = (np.concatenate(parts) * 32767).astype("<i2")
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE_HZ)
        file.writeframes(samples.tobytes())
    return buffer.getvalue()


def scale_step(hertz: float) -> int:
    """Return the nearest step of the scale of guiding tones."""
    return round(_STEPS_PER_OCTAVE * math.log2(max(hertz, 1.0) / _CONCERT_HZ))


def step_wav(step: int, volume: int = USUAL_VOLUME) -> bytes:
    """Return the short tone of a scale step as a WAV file."""
    return tone_wav(((_CONCERT_HZ * 2.0 ** (step / _STEPS_PER_OCTAVE), _PITCH_S),), volume)


class SoundPlayer(QObject):
    """Play `Sound` without waiting, raising or leaving processes."""

    def __init__(
        self, parent: QObject | None = None, *, enabled: bool = True, volume: int = USUAL_VOLUME
    ) -> None:
        super().__init__(parent)
        self._volume = volume
        self._command: tuple[str, ...] = ()
        self._process: QProcess | None = None
        self._folder: QTemporaryDir | None = None
        self._files: dict[Sound, str] = {}
        self._pitches: dict[int, str] = {}
        self.enable(enabled)

    def can_play(self) -> bool:
        """Return whether sounds are enabled and a player exists."""
        return bool(self._files) and (bool(self._command) or sys.platform == "win32")

    def enable(self, enabled: bool, volume: int | None = None) -> None:
        """Enable or disable sounds, and set the volume."""
        louder = volume is not None and volume != self._volume
        if enabled == bool(self._files) and not louder:
            return
        if volume is not None:
            self._volume = volume
        self._pitches.clear()
        if not enabled:
            self._files.clear()
            return
        self._folder = self._folder or QTemporaryDir()
        if not self._folder.isValid():
            return
        for sound in Sound:
            path = Path(self._folder.filePath(f"{sound.name.lower()}.wav"))
            try:
                path.write_bytes(tone_wav(sound.value, self._volume))
            except OSError:
                return
            self._files[sound] = str(path)
        for name, *options in _PLAYERS:
            program = QStandardPaths.findExecutable(name)
            if program:
                self._command = (program, *options)
                break

    def play(self, sound: Sound) -> None:
        """Start a sound, without interrupting a playing one."""
        if sound in self._files:
            self._start(self._files[sound])

    def play_pitch(self, hertz: float) -> None:
        """Start a short tone on the nearest step of the scale."""
        step = scale_step(hertz)
        folder = self._folder
        if folder is not None and self._files:
            path = self._pitches.get(step, "")
            if not path:
                path = folder.filePath(f"pitch{step}.wav")
                try:
                    Path(path).write_bytes(step_wav(step, self._volume))
                except OSError:
                    return
                self._pitches[step] = path
            self._start(path)

    def _start(self, path: str) -> None:
        if sys.platform == "win32":
            import winsound

            try:
                winsound.PlaySound(
                    path, winsound.SND_FILENAME | winsound.SND_ASYNC | winsound.SND_NODEFAULT
                )
            except RuntimeError:
                self._files.clear()
        elif self._command and (
            self._process is None or self._process.state() is QProcess.ProcessState.NotRunning
        ):
            if self._process is None:
                self._process = QProcess(self)
            program, *options = self._command
            self._process.start(program, [*options, path])

    def close(self) -> None:
        """Stop playing; idempotent."""
        self._files.clear()
        if self._process is not None:
            self._process.kill()
            self._process.waitForFinished(200)
            self._process = None


def verdict_sound(verdict: Verdict | None) -> Sound:
    """Return the sound of a verdict; None is a feature without tolerance."""
    return {
        None: Sound.FEATURE_COMPLETE,
        Verdict.CONFORM: Sound.FEATURE_COMPLETE,
        Verdict.NOT_CONFORM: Sound.OUT_OF_TOLERANCE,
    }.get(verdict, Sound.IN_DOUBT)


class Approach:
    """Guide to the next point by a tone that rises with nearness, silent at rest."""

    def __init__(self, player: SoundPlayer | None) -> None:
        self._player = player
        self._step: int | None = None
        self.enabled = True

    def update(self, target: Target | None, tip_world: Float | None) -> None:
        """Sound the ball position if it came nearer or moved away."""
        if target is None or tip_world is None or self._player is None or not self.enabled:
            self._step = None
            return
        distance = target.distance(tip_world)
        # Imported late: the Start page plays the same sounds without it.
        from ocmm_core.inspection.evaluation import FAR_MM, cue

        if distance > FAR_MM:
            self._step = None
            return
        pitch = cue(distance).tone_hz
        step = scale_step(pitch)
        if self._step is not None and step != self._step:
            self._player.play_pitch(pitch)
        self._step = step
