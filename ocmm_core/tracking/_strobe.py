"""Strobe codes: an LED is identified by the frames in which it is dark.

The cameras count exposures together, synchronised with the LEDs. In every period of that counter
each LED is dark for one frame, its own. So a slot observed for two periods identifies its LED, or
belongs to no LED of this body: a lamp is never off, and an occluded LED is off in other frames. A
frame with one dark LED is measured with the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import InputError
from ocmm_core.geometry import Int

MAX_PERIOD = 64
"""Frames; two of them must pass before an LED is named."""

PERIODS = 2
"""Observed before a slot is labelled; in one, an occlusion of a frame might look like the code."""

NOT_NAMED = -2
"""A slot without an identified LED of this body."""


class StrobeEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The code of a body in its document: the dark frame of each LED in the period."""

    period: int
    dark: list[int]


@dataclass(frozen=True, slots=True)
class StrobeCode:
    """The code of a body."""

    period: int
    dark: Int
    """(L,): remainder of the exposure counter by the period at which the LED is dark."""


def strobe_code(path: Path, entry: StrobeEntry | None, n_leds: int) -> StrobeCode | None:
    """Return the code of a document, or None.

    InputError if two LEDs are dark in the same frame, one has no frame, or the period is unusable.
    """
    if entry is None:
        return None
    numbers = entry.dark
    wrong = ""
    if not max(4, n_leds) <= entry.period <= MAX_PERIOD:
        wrong = f"'strobe.period' is {entry.period}, but must be {max(4, n_leds)} to {MAX_PERIOD}"
    elif len(numbers) != n_leds:
        wrong = f"'strobe.dark' has {len(numbers)} numbers for {n_leds} LEDs"
    elif len(set(numbers)) < n_leds or not 0 <= min(numbers) <= max(numbers) < entry.period:
        wrong = f"'strobe.dark' is {numbers}"
    if wrong:
        raise InputError(
            "body.strobe",
            f"{path}: field {wrong}.",
            "Give every LED a frame of its own in which it is dark, from 0 to the period less one.",
        )
    return StrobeCode(entry.period, np.array(numbers, dtype=np.int64))


def is_lit(code: StrobeCode, counter: Int) -> NDArray[np.bool_]:
    """Return the lit LEDs in frames (n,) of the exposure counter, (n, L)."""
    lit: NDArray[np.bool_] = counter[:, None] % code.period != code.dark
    return lit


def dark_bits(code: StrobeCode, counter: Int) -> NDArray[np.uint64]:
    """Return the dark LEDs in frames (n,) of the exposure counter: (n,), bit l for LED l."""
    weights = np.uint64(1) << np.arange(len(code.dark), dtype=np.uint64)
    return ~is_lit(code, counter) @ weights


def frames_needed(code: StrobeCode) -> int:
    """Return the number of consecutive frames needed by `decode`."""
    return PERIODS * code.period


def decode(code: StrobeCode, counter: Int, there: NDArray[np.bool_]) -> Int | None:
    """Return the LED of each slot, (C, S), `NOT_NAMED` if unidentified.

    None for too few frames, or gaps between them. ``counter`` (n,) is the exposure counter of the
    last frames, ``there`` (n, C, S) whether slots held a spot.
    """
    need = frames_needed(code)
    counter, there = counter[-need:], there[-need:]
    if len(counter) < need or counter[-1] - counter[0] != need - 1:
        return None
    led_of_slot = np.full(there.shape[1:], NOT_NAMED, dtype=np.int64)
    for led, lit in enumerate(is_lit(code, counter).T):
        led_of_slot[(there == lit[:, None, None]).all(axis=0)] = led
    return led_of_slot


class StrobeReader:
    """Read the code from consecutive frames; for one thread."""

    def __init__(self, code: StrobeCode) -> None:
        self._code = code
        self._counter = np.empty(0, dtype=np.int64)
        self._there: NDArray[np.bool_] | None = None

    def gaps(self, counter: Int) -> list[int]:
        """Return the indices of ``counter`` (n,) preceded by a gap."""
        before = self._counter[-1:] if len(self._counter) else counter[:1] - 1
        return np.flatnonzero(np.diff(counter, prepend=before) != 1).tolist()

    def decode(self, counter: Int, there: NDArray[np.bool_]) -> Int | None:
        """Return the result of `decode` for frames that follow those of `remember`.

        Also None if an LED is dark in the last frame, unless every frame has a dark one.
        """
        dark = ~is_lit(self._code, counter[-1:]).all()
        if dark and self._code.period > len(self._code.dark):
            return None
        if self._there is not None and len(counter) < frames_needed(self._code):
            counter = np.concatenate([self._counter, counter])
            there = np.concatenate([self._there, there])
        return decode(self._code, counter, there)

    def remember(self, counter: Int, there: NDArray[np.bool_]) -> None:
        """Keep the last frames needed for decoding."""
        need = frames_needed(self._code)
        if self._there is not None and len(counter) < need:
            counter = np.concatenate([self._counter, counter])
            there = np.concatenate([self._there, there])
        self._counter, self._there = counter[-need:].copy(), there[-need:].copy()
