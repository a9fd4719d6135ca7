"""Check of settings: commands started with sudo read those of root."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.doctor._computer import Computer
from ocmm_core.doctor._result import Answer, amber, green
from ocmm_core.settings import SETTINGS_NAME, SettingsFile


def settings(computer: Computer) -> Answer:
    """Return whether root, as whom commands with sudo run, has the settings of the station."""
    root = Path("~root/.config/ocmm").expanduser()
    found = computer.environment.get("XDG_CONFIG_DIRS") or "/etc/xdg"
    station = Path(found.partition(":")[0], "ocmm")
    config = computer.environment.get("XDG_CONFIG_HOME") or computer.home / ".config"
    own = root if computer.uid == 0 else Path(config, "ocmm")
    if not computer.has(root / SETTINGS_NAME):
        return green("Root has no settings of its own.")
    # NotAskedError if this user cannot read it.
    computer.text(root / SETTINGS_NAME)
    below, mine, of_root = (
        SettingsFile(computer.place(folder / SETTINGS_NAME)).read().values
        for folder in (station, own, root)
    )
    mine = {**below, **({} if own == root else mine)}
    different = sorted(key for key, value in of_root.items() if mine.get(key) != value)
    if not different:
        return green("Those of root are the same.")
    return amber(
        "settings.of_root",
        f"Root has other settings than this station: {', '.join(different)}. Commands with sudo "
        "use them.",
        f"Set them with ocmm settings set --station, then remove {root / SETTINGS_NAME}.",
    )
