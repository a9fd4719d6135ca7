"""Write the golden files of the `ocmm` in the path: ``python tests/golden/write.py FOLDER``.

Run it with the version that is about to be replaced (installer/RELEASING.md), never for files that
are there already. The rig is virtual and its seed fixed, so results repeat; keys and times do not.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

PLANS = Path(__file__).with_name("plans")
_HOMES = ("XDG_CONFIG_DIRS", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")
_POLL_S = 0.02


def write(folder: Path) -> None:
    """Write one file of each kind into a new folder."""
    station = folder / "station"
    shutil.copytree(PLANS, station)
    homes = {name: str(station / "home" / name.lower()) for name in _HOMES}
    environment = {**os.environ, **homes, "HOME": str(station)}

    def ocmm(*words: str) -> None:
        done = subprocess.run(
            ["ocmm", *words], cwd=station, env=environment, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        # 1: a characteristic does not conform, or is not proven.
        if done.returncode not in (0, 1):
            raise SystemExit(f"ocmm {' '.join(words)}: {done.returncode}\n{done.stderr}")
        sys.stdout.write(f"{done.returncode}  ocmm {' '.join(words)}\n")

    ocmm("key", "show")
    ocmm("plan", "release", "ball.toml", "--by", "Q. Engineer")
    ocmm("measure", "--plan", "ball.toml", "--out", "jobs", "--archive", "archive.sqlite")
    for plan in sorted(PLANS.glob("*.toml")):
        if plan.name != "ball.toml":
            ocmm("measure", "--plan", plan.name, "--out", "jobs", "--archive", "off")
    ocmm("record", "--plan", "ball.toml", "--seconds", "0.1", "--out", "frames.rec")
    ocmm("acceptance", "interim", "--folder", "acceptance")
    ocmm(
        "msa", "plan", "study.toml", "--name", "GRR", "--parts", "5", "--operators", "A,B",
        "--trials", "2",
    )  # fmt: skip
    interrupt(station, environment)
    # Commands above would use it.
    ocmm("settings", "set", "window.theme", "light")
    ocmm("settings", "set", "instrument.source", "ethercat:service")
    forget(station)


def forget(station: Path) -> None:
    """Remove files about this computer: the queue of the archive, and memories of paths."""
    shutil.rmtree(station / "home/xdg_data_home/ocmm/outbox", ignore_errors=True)
    for memory in (station / "home/xdg_state_home").rglob("*.json"):
        if str(station) in memory.read_text("utf-8"):
            memory.unlink()


def interrupt(station: Path, environment: dict[str, str]) -> None:
    """Measure a job, and kill the program after two points."""
    measuring = subprocess.Popen(
        ["ocmm", "measure", "--plan", "ball.toml", "--out", "open", "--speed", "1",
         "--archive", "off"],
        cwd=station, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    while points_in(station / "open") < 2:
        if measuring.poll() is not None:
            raise SystemExit("The job to interrupt ended first.")
        time.sleep(_POLL_S)
    measuring.kill()
    measuring.wait()


def points_in(folder: Path) -> int:
    """Return the number of points in a copy of the job: the program locks the job itself."""
    with tempfile.TemporaryDirectory() as name:
        try:
            for file in folder.glob("*.ocmm*"):
                shutil.copy(file, name)
            (job,) = Path(name).glob("*.ocmm")
            with closing(sqlite3.connect(job)) as db:
                return int(db.execute("SELECT count(*) FROM observation").fetchone()[0])
        except (OSError, ValueError, sqlite3.Error):
            return 0


if __name__ == "__main__":
    write(Path(sys.argv[1]).resolve())
