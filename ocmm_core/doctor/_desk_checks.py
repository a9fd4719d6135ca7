from __future__ import annotations

import re

from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red

SMALLEST = (1024, 640)
"""Minimum size of the window (`ocmm_gui.window`), px."""
ROOMY = (1280, 720)
"""From this size digits readable from three metres fit next to the plan."""
_DRM = "/sys/class/drm"
_PLAYERS = ("paplay", "pw-play", "aplay")
"""Sound players used by the window (`ocmm_gui.kit`)."""
_LARGEST_SCALE = 8.0


def screen(computer: Computer) -> Answer:
    """Return whether the window fits on the scaled screen."""
    modes = _modes(computer) if computer.has(_DRM) else []
    if not modes:
        raise NotAskedError(
            "The kernel shows no connected screen.", "Run this at the station with its screen on."
        )
    scale, source = _scale(computer)
    width, height = max(modes)
    wide, high = int(width / scale), int(height / scale)
    shown = f"{width} x {height}, scale {scale:g}{source}"
    if wide < SMALLEST[0] or high < SMALLEST[1]:
        return red(
            "screen.small",
            f"The screen is too small for the window: {shown}; {SMALLEST[0]} x {SMALLEST[1]} "
            "are needed.",
            "Use a larger screen, or a smaller scale.",
        )
    if wide < ROOMY[0] or high < ROOMY[1]:
        return amber(
            "screen.narrow",
            f"The screen is small: {shown}.",
            f"Use {ROOMY[0]} x {ROOMY[1]} or more, so that digits can be read from afar.",
        )
    return green(f"{shown}.")


def sound(computer: Computer) -> Answer:
    """Return whether the tones of touches can be played."""
    players = [one for one in _PLAYERS if computer.tool(one)]
    if not players:
        return amber(
            "sound.no_player",
            "No program that plays sounds: touches are shown, not heard.",
            "Install one: apt install pulseaudio-utils",
        )
    if not computer.has("/proc/asound/cards"):
        cards = "no soundcards"
    else:
        cards = computer.text("/proc/asound/cards")
    if "no soundcards" in cards:
        return amber(
            "sound.no_card",
            "The computer has no sound card: touches are shown, not heard.",
            "Connect a loudspeaker, e.g. by USB or in the screen.",
        )
    return green(f"{players[0]}, with a sound card.")


def _modes(computer: Computer) -> list[tuple[int, int]]:
    """Return width and height of the preferred mode of each connected screen, px."""
    found = []
    for name in computer.names(_DRM):
        folder = f"{_DRM}/{name}"
        if not computer.has(f"{folder}/status") or not computer.has(f"{folder}/modes"):
            continue
        if computer.text(f"{folder}/status") != "connected":
            continue
        # The kernel lists the preferred mode first.
        mode = re.match(r"(\d{2,5})x(\d{2,5})", computer.text(f"{folder}/modes"))
        if mode is None:
            raise NotAskedError(f"The screen at {name} does not say how many points it has.")
        found.append((int(mode[1]), int(mode[2])))
    return found


def _scale(computer: Computer) -> tuple[float, str]:
    """Return the screen scale factor and its source."""
    variable = computer.environment.get("QT_SCALE_FACTOR", "")
    if variable:
        return _factor(variable, "the variable QT_SCALE_FACTOR"), " (QT_SCALE_FACTOR)"
    settings = computer.home / ".config/monitors.xml"
    if computer.has(settings):
        found = re.findall(r"<scale>([^<]*)</scale>", computer.text(settings))
        if found:
            return max(_factor(one, str(settings)) for one in found), " (desktop)"
    return 1.0, ""


def _factor(text: str, where: str) -> float:
    if not re.fullmatch(r"\d{1,2}(?:\.\d{1,20})?", text) or not 0 < float(text) <= _LARGEST_SCALE:
        raise NotAskedError(f"{where} holds no scale.")
    return float(text)
