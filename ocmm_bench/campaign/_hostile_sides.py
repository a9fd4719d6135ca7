"""Hostile files in place of trusted files and next to them, given to real commands.

Generated from `side_files.SIDE_FILES`, the hostile kinds below, and the commands that read each
kind of trusted file. A trial is one of all pairs. Root runs the commands as an ordinary user, who
owns the station and meets unreadable files and those of another user.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import socket
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from ocmm_bench.campaign._hostile import good_files, quiet
from ocmm_bench.campaign._hostile_runs import (
    CommandResult,
    Forgery,
    ordinary_user,
    run_aside,
    run_here,
)
from ocmm_bench.campaign._trials import Trial, changed_environment
from ocmm_bench.campaign._writers import CalibrationSite
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.session import HEADER_EVENT, header_text
from ocmm_core.side_files import SIDE_FILES, SideFile, Trusted
from ocmm_core.storage import JobFile

_LONGEST_CLOCK_S = 30.0
"""A command blocked on a pipe never ends; a busy computer takes less than this."""
_HUGE, _SHORTEST = 3 << 30, 40
_ANOTHER_USER = 4711
_SECRET, _NEIGHBOUR = "secret.txt", "jobs/NEIGHBOUR.ocmm"
_XDG = {
    "XDG_DATA_HOME": "data", "XDG_STATE_HOME": "state", "XDG_CONFIG_HOME": "config",
    "XDG_CACHE_HOME": "cache", "HOME": "home",
}  # fmt: skip


def _socket(path: Path, secret: Path) -> None:
    # Socket names are limited to about 100 bytes; a trial folder's path may be longer.
    folder = os.open(path.parent, os.O_PATH)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(f"/proc/self/fd/{folder}/{path.name}")
    finally:
        os.close(folder)


def _device(path: Path, secret: Path) -> None:
    try:
        os.mknod(path, 0o20666, os.makedev(1, 5))
    except OSError:
        path.symlink_to("/dev/zero")


def _sparse(path: Path, secret: Path) -> None:
    with path.open("ab") as stream:
        stream.truncate(_HUGE)


def _unreadable(path: Path, secret: Path) -> None:
    path.touch()
    path.chmod(0)


def _of_another(path: Path, secret: Path) -> None:
    path.touch()
    if os.getuid() == 0:
        os.chown(path, _ANOTHER_USER, _ANOTHER_USER)


def _journal(path: Path, secret: Path) -> None:
    """Write a hot rollback journal that names the secret as its super-journal."""
    name = str(secret).encode()
    head = bytes.fromhex("d9d505f920a163d7") + bytes(4) + b"\1\2\3\4" + bytes(4) + b"\0\0\2\0"
    tail = len(name).to_bytes(4, "big") + (sum(name) & 0xFFFFFFFF).to_bytes(4, "big")
    tail += bytes.fromhex("d9d505f920a163d7")
    path.write_bytes(head + b"\0\0\x10\0" + bytes(512 - 28) + b"\xff" * 4 + name + tail)


Make = Callable[[Path, Path], object]
"""Makes something at a path, given a file outside that must not change."""

MAKERS: dict[str, Make] = {
    "pipe": lambda path, secret: os.mkfifo(path),
    "socket": _socket,
    "device": _device,
    "folder": lambda path, secret: path.mkdir(),
    "link": lambda path, secret: path.symlink_to(secret),
    "link to /dev/zero": lambda path, secret: path.symlink_to("/dev/zero"),
    "link to a file of the system": lambda path, secret: path.symlink_to("/proc/self/mem"),
    "link to nothing": lambda path, secret: path.symlink_to(path.with_name("nothing")),
    "second name": lambda path, secret: os.link(secret, path),
    "huge sparse": _sparse,
    "unreadable": _unreadable,
    "another user's": _of_another,
    "empty": lambda path, secret: path.write_bytes(b""),
    "hot journal": _journal,
}


@dataclass(frozen=True, slots=True)
class SidePlace:
    """A kind of trusted file in a station of a trial."""

    trusted: str
    """Path below the folder of the trial."""
    commands: Sequence[Sequence[str]]
    """Commands that read it; ``@`` is the folder of the trial."""


_JOB = "@/jobs/J.ocmm"
_PART = ("--plan", "@quick", "--out", "@/jobs", "--batch", "B1", "--serial", "1")
"""Part of the neighbouring job, which must be found despite hostile files next to it."""
_PLACES: dict[Trusted, tuple[SidePlace, ...]] = {
    Trusted.JOB: (
        SidePlace(
            "jobs/J.ocmm",
            (
                ("report", _JOB, "--format", "json", "--incomplete", "--out", "@/out"),
                ("audit", "verify", _JOB, f"@/{_NEIGHBOUR}"),
                ("audit", "adopt", _JOB, "--who", "A. Example", "--reason", "test"),
                ("environment", _JOB),
                ("environment", _JOB, "--room", "20.1", "--who", "A. Example"),
                ("recall", "@/jobs"),
                ("compare", _JOB, f"@/{_NEIGHBOUR}"),
                ("archive", "send", "@/jobs"),
                ("measure", "--continue", _JOB, "--incomplete"),
                ("measure", *_PART),
            ),
        ),
    ),
    Trusted.DATABASE: (
        SidePlace(
            "data/ocmm/outbox/outbox.sqlite",
            (("archive", "status"), ("archive", "send", f"@/{_NEIGHBOUR}")),
        ),
        SidePlace(
            "data/ocmm/archive.sqlite",
            (("archive", "today"), ("archive", "verify"), ("archive", "send", f"@/{_NEIGHBOUR}")),
        ),
    ),
    Trusted.CHAIN: (
        SidePlace(
            "cameras/events.jsonl",
            (
                ("audit", "verify", "@/cameras"),
                ("calibrate", "status", "--calibrations", "@"),
            ),
        ),
    ),
    Trusted.RECORDING: (
        SidePlace(
            "R.ocrec",
            (("measure", "--plan", "@quick", "--source", "replay:@/R.ocrec", "--uncalibrated",
              "--incomplete", "--out", "@/out"),),
        ),
    ),
    Trusted.SETTINGS: (
        SidePlace(
            "config/ocmm/settings.toml",
            (("settings", "show"), ("settings", "set", "job.operator", "A")),
        ),
    ),
    Trusted.KEYS: (
        SidePlace(
            "data/ocmm/keys/known_keys.json",
            (("key", "show"), ("audit", "verify", f"@/{_NEIGHBOUR}")),
        ),
    ),
    Trusted.MEMORY: (SidePlace("", (("audit", "verify", f"@/{_NEIGHBOUR}"),)),),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class SidePair:
    """A hostile file at one name, and the command that meets it."""

    name: str
    path: str
    """Path of the hostile file, below the folder of the trial."""
    make: Make
    command: Sequence[str] = field(default_factory=tuple)


def side_pairs(site: Path) -> list[SidePair]:
    found = []
    for kind, places in _PLACES.items():
        for place in places:
            for path in _named(site, place, SIDE_FILES[kind]):
                found += [
                    SidePair(f"{kind.name.lower()}: {word} at {path}, {one[0]}", path, make, one)
                    for word, make in MAKERS.items()
                    for one in place.commands
                ]
    return found


def _named(site: Path, place: SidePlace, sides: Sequence[SideFile]) -> Iterator[str]:
    if not place.trusted:
        memories = sorted((site / "state/ocmm/histories").glob("*.json"))
        yield from (str(one.relative_to(site)) for one in memories[:1])
        return
    folder, _, name = place.trusted.rpartition("/")
    for side in sides:
        yield f"{folder}/{side.name.format(name)}".lstrip("/")


def made_site(folder: Path) -> Path:
    """Return a station with two jobs, a history, a recording, an archive, settings and keys."""
    site = folder / "site"
    jobs = site / "jobs"
    jobs.mkdir(parents=True)
    with _home(site):
        good = good_files(folder)
        shutil.copy(good["job"], jobs / "J.ocmm")
        shutil.copy(good["job"], site / _NEIGHBOUR)
        with JobFile.open(site / _NEIGHBOUR) as job:
            part = JobHeader(job.head.operator, job.head.part, job.head.serial, "", "B1")
            job.append_event(HEADER_EVENT, header_text(part))
        shutil.copy(good["recording"], site / "R.ocrec")
        CalibrationSite.made(site / "cameras")
        for command in (
            ("settings", "set", "job.operator", "A"),
            ("archive", "send", str(jobs / "NEIGHBOUR.ocmm")),
            ("audit", "verify", str(jobs / "NEIGHBOUR.ocmm")),
            ("key", "replace", "--who", "A. Example", "--reason", "test"),
        ):
            run_here(list(command))
    (site / _SECRET).write_text("what no file next to a job may delete or change\n")
    return site


def tried(site: Path, pair: SidePair, folder: Path, user: int | None) -> tuple[CommandResult, str]:
    """Give a hostile file to its command; return the result and the forbidden outcome."""
    place = folder / "trial"
    shutil.copytree(site, place, symlinks=True)
    if user is not None:
        for one in (place, *place.rglob("*")):
            os.chown(one, user, user, follow_symlinks=False)
    try:
        hostile = place / pair.path
        secret = place / _SECRET
        if hostile.exists() and pair.make not in (_sparse, _unreadable, _of_another):
            hostile.unlink()
        hostile.parent.mkdir(parents=True, exist_ok=True)
        pair.make(hostile, secret)
        before = _digests(place)
        with _home(place):
            words = folder / "words.txt"
            answer = run_aside(_filled(pair.command, place), words, _LONGEST_CLOCK_S, user)
        fault = answer.fault(Forgery(pair.name, lambda good, path: None, harmless=True), 2.0)
        if answer.clock_s > _LONGEST_CLOCK_S:
            fault = "hang"
        elif fault == "no sentence" and len(answer.words) > _SHORTEST:
            # Commands for many files print one line for each, without the name of the program.
            fault = ""
        return answer, fault or ("changed" if _digests(place) != before else "")
    finally:
        shutil.rmtree(place, ignore_errors=True)
        (folder / "words.txt").unlink(missing_ok=True)


def _filled(command: Sequence[str], place: Path) -> list[str]:
    quick = str(resource("plans", "quick.toml"))
    return [quick if one == "@quick" else one.replace("@", str(place)) for one in command]


def hostile_sides(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each pair, in random order; refused files count as acknowledged."""
    with tempfile.TemporaryDirectory(prefix="ocmm-sides-") as name, quiet():
        folder, user = Path(name), ordinary_user()
        folder.chmod(0o755)
        site = made_site(folder)
        pairs = side_pairs(site)
        random.Random(seed).shuffle(pairs)  # noqa: S311 - an order, no secret
        for number, pair in enumerate(pairs[:runs]):
            if number in done:
                continue
            answer, fault = tried(site, pair, folder, user)
            refused = int(answer.code == 2 and not fault)
            note = "" if not fault else (
                f"{pair.name}: exit {answer.code}, {answer.clock_s:.1f} s, "
                f"{answer.memory_mb:.0f} MB: {' '.join(answer.words.split())[-300:]}"
            )  # fmt: skip
            found = {SIDE_FINDINGS[fault]: 1} if fault else {}
            yield Trial("sides", seed, number, refused, found, note)


SIDE_FINDINGS = {
    "traceback": "tracebacks", "hang": "hangs above 5 s", "memory": "above 512 MB",
    "no sentence": "without a sentence", "changed": "other files changed",
}  # fmt: skip


def _digests(place: Path) -> dict[str, str]:
    """Return the hashes of the files that must not change, by name."""
    keys = place / "data/ocmm/keys"
    files = (place / _SECRET, place / _NEIGHBOUR, *keys.glob("*.key"))
    return {
        str(one): hashlib.sha256(one.read_bytes()).hexdigest()
        for one in files
        if one.is_file() and not one.is_symlink()
    }


def _home(place: Path) -> AbstractContextManager[None]:
    return changed_environment({name: place / folder for name, folder in _XDG.items()})
