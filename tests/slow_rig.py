"""The recommended rig with an eighth of the frames, for what the rate plays no part in."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import resource


def slow_rig_in(folder: Path) -> Path:
    """Write the document of that rig and return its place."""
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    assert "frame_rate_hz = 8000" in text
    file = folder / "slow_rig.toml"
    file.write_text(text.replace("frame_rate_hz = 8000", "frame_rate_hz = 1000"), "utf-8")
    return file
