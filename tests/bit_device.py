"""Description of a camera with single bits and gaps, for tests."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import resource

BITS = """
[[inputs]]
index = 0x1A00
entries = [
    { index = 0x6000, sub = 1, type = "BOOL", role = ["button"] },
    { index = 0, sub = 0, type = "BITS", bits = 5, role = ["ignored"] },
    { index = 0x6000, sub = 2, type = "BITS", bits = 13, role = ["counter"] },
    { index = 0x6001, sub = 1, type = "BOOL", role = ["valid"], slots = true },
    { index = 0, sub = 0, type = "BITS", bits = 3, role = ["ignored"] },
    { index = 0x6002, sub = 1, type = "DINT", bits = 22, role = ["x", "y"], slots = true },
]

[[outputs]]
index = 0x1600
entries = [
    { index = 0x7000, sub = 1, type = "BITS", bits = 3, role = ["constant"], value = 5 },
    { index = 0, sub = 0, type = "BITS", bits = 6, role = ["ignored"] },
    { index = 0x7000, sub = 2, type = "BITS", bits = 11, role = ["heartbeat"] },
]
"""


def bit_device(folder: Path, old: str = "", new: str = "") -> Path:
    """Return a description with bits, with one text replaced."""
    text = resource("devices", "plain-spots.toml").read_text(encoding="utf-8")
    head = text[: text.index("[[inputs]]")].replace("exposures = 4", "exposures = 1")
    head = head.replace("clock =", "cycle_ns = 1_000_000\nclock =")
    whole = head + BITS
    assert old in whole
    path = folder / "bits.toml"
    path.write_text(whole.replace(old, new) if old else whole, encoding="utf-8")
    return path
