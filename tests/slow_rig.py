"""The recommended rig with fewer frames, for tests independent of the rate."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import resource

SLOW_HZ = 1000
"""For jobs, an eighth of the frames."""
CALM_HZ = 2000
"""For guided procedures and acceptance tests, a quarter: these want a hundred frames of a ball that
rests, and the virtual hand holds it still for some tenths of a second."""


def slow_rig_in(folder: Path, rate_hz: int = SLOW_HZ) -> Path:
    """Write the document of such a rig and return its place."""
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    assert "frame_rate_hz = 8000" in text
    file = folder / f"rig_{rate_hz}_hz.toml"
    file.write_text(text.replace("frame_rate_hz = 8000", f"frame_rate_hz = {rate_hz}"), "utf-8")
    return file
