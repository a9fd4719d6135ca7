"""Network adapter settings by ethtool(8)."""

from __future__ import annotations

import contextlib
import re

from ocmm_core.doctor._computer import Computer, NotAskedError

COALESCING, FEATURES = "-C", "-K"
PAUSE, EEE = "-a", "--show-eee"
_PACKAGE = "ethtool"
_TITLES = {"generic-receive-offload": "gro", "large-receive-offload": "lro"}


def settings(computer: Computer, name: str, kind: str) -> dict[str, str]:
    """Return the changeable settings of a kind, by option; NotAskedError if unknown.

    ``kind`` is `COALESCING` or `FEATURES`: the option that sets them; lower case queries.
    """
    said = computer.run("ethtool", kind.lower(), name, package=_PACKAGE)
    if kind == FEATURES:
        found = re.findall(r"^([a-z-]+): (on|off)$", said, re.MULTILINE)
        return {_TITLES[title]: state for title, state in found if title in _TITLES}
    times = dict(re.findall(r"^(rx-usecs|tx-usecs):\s*(\d{1,7})$", said, re.MULTILINE))
    adaptive = re.search(r"^Adaptive RX: (on|off)\s+TX: (on|off)$", said, re.MULTILINE)
    if adaptive is None:
        return times
    # First off, then zero: some drivers refuse times in adaptive mode.
    return {"adaptive-rx": adaptive[1], "adaptive-tx": adaptive[2], **times}


def fixed_features(computer: Computer, name: str) -> dict[str, str]:
    """Return the features fixed by the driver, by option."""
    said = computer.run("ethtool", FEATURES.lower(), name, package=_PACKAGE)
    found = re.findall(r"^([a-z-]+): (on|off) \[fixed\]$", said, re.MULTILINE)
    return {_TITLES[title]: state for title, state in found if title in _TITLES}


def is_on(computer: Computer, name: str, kind: str) -> bool:
    """Return whether `PAUSE` frames or `EEE` are on; False if unknown."""
    with contextlib.suppress(NotAskedError):
        said = computer.run("ethtool", kind, name, package=_PACKAGE)
        return re.search(r"^(?:RX|TX):\s*on$|EEE status: enabled", said, re.MULTILINE) is not None
    return False


def change_setting(computer: Computer, name: str, kind: str, option: str, value: str) -> None:
    """Set one option; raise NotAskedError if the driver refuses."""
    computer.run("ethtool", kind, name, option, value, package=_PACKAGE)
