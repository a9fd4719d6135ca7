"""Write the golden files of the `ocmm` in the path: ``python tests/golden/write.py FOLDER``.

Run it with the version that is about to be replaced (installer/RELEASING.md), never for files that
are there already. The rig is virtual and its seed fixed, so results repeat; keys and times do not.
The memory of the station contains its folder: write to a neutral place, and move the folder.
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
INSTRUMENT = Path(__file__).with_name("instrument")
"""A rig of 2 kHz, and 80 positions with their spots."""
_HOMES = ("XDG_CONFIG_DIRS", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME")
_POLL_S = 0.02


class Station:
    """A folder with a home of its own, and the commands that write into it."""

    def __init__(self, folder: Path, files: Path) -> None:
        self.folder = folder
        shutil.copytree(files, folder)
        homes = {name: str(folder / "home" / name.lower()) for name in _HOMES}
        self.environment = {**os.environ, **homes, "HOME": str(folder)}

    def ocmm(self, *words: str) -> None:
        """Run a command, and end unless it could run."""
        done = subprocess.run(
            ["ocmm", *words], cwd=self.folder, env=self.environment, capture_output=True,
            text=True, check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        # 1: a characteristic does not conform, or is not proven; a session waits.
        if done.returncode not in (0, 1):
            raise SystemExit(f"ocmm {' '.join(words)}: {done.returncode}\n{done.stderr}")
        sys.stdout.write(f"{done.returncode}  ocmm {' '.join(words)}\n")


def measure(folder: Path) -> None:
    """Write a file of each kind but calibrations into a new folder."""
    station = Station(folder, PLANS)
    ocmm = station.ocmm
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
    interrupt(folder, station.environment)
    # Commands above would use it.
    ocmm("settings", "set", "window.theme", "light")
    ocmm("settings", "set", "instrument.source", "ethercat:service")
    forget(folder)


def calibrate(folder: Path) -> None:
    """Write records of cameras, probe and tip, and waiting sessions, into a new folder."""
    station = Station(folder, INSTRUMENT)
    station.ocmm("key", "show")
    site = [
        "--rig", "rig.toml", "--calibrations", "cameras", "--temperature", "20",
        "--temperature-u", "0.5", "--who", "Q. Engineer",
    ]  # fmt: skip
    tip = [*site, "--probes", "probes", "--tip", "6 mm"]
    known = ["cameras", "--points", "points.csv", "--spots", "spots.csv", *site]
    probe = ["probe", "--poses", "100", *tip]
    for words in (known, ["verify", *site], probe, ["tip", *tip], ["check-tip", *tip]):
        station.ocmm("calibrate", *words, "--accept")
    for words in (["verify", *site], ["check-tip", *tip]):
        station.ocmm("calibrate", *words)


def write(folder: Path) -> None:
    """Write the files of two stations into a new folder."""
    measure(folder / "station")
    calibrate(folder / "calibration")


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
