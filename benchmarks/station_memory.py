"""Attacks on the memory of the station, and honest moves of its files.

Things: histories of calibrations; folders with a released plan and signed settings.
Attacks: an older copy of a thing, or a complete older history of the same cameras, is put back
under another path (symbolic link of the folder or its parent, renamed, hard links, `..`, another
case, a copy elsewhere), with the memory whole or damaged; the clock is set back after such a move;
changed jobs are adopted. None may be VALID, INTACT or released. Plans and settings are trusted if
the memory of them is deleted: those attacks are not tried.
Honest moves: folders renamed, homes moved, computers exchanged, programs upgraded, backups restored
by name. None may be called a forgery.
Run: ``python -m benchmarks.station_memory --n 5000 --honest 500``.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import timedelta
from functools import partial
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.evidence_site import NOW
from benchmarks.tampering import EDITS, Site, make_site
from ocmm_bench.campaign import other_station
from ocmm_core.calibration.records import CalibrationStore, State
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.export.audits import audit
from ocmm_core.inspection.plan import plan_release, release_plan
from ocmm_core.seals import KeyFolder, memory_folder, start_memory
from ocmm_core.settings import SettingsFile
from ocmm_core.storage import JobFile
from tests.core.calibration.made_records import MADE, make_record, make_verification

TRIALS, HONEST = 5_000, 500
Rng = np.random.Generator
Move = Callable[["Template", Rng], tuple[Path, bool]]
"""An honest move; returns the folder afterwards, and whether it must count."""
_LATER = MADE + timedelta(days=600)
ACCUSING = ("forged", "does not belong", "was replaced", "was changed", "signature")
"""Words that call a file a forgery."""


@dataclass(slots=True)
class Found:
    """Trials by kind, attacks that passed, and honest moves that were called a forgery."""

    done: Counter[str] = field(default_factory=Counter)
    passed: list[str] = field(default_factory=list)
    accused: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Judged:
    """Whether a folder counts, None if only parts of it do, and why not."""

    valid: bool | None
    reason: str
    remedy: str


def _history(folder: Path, day: int, shift: int = 0, by: str = "technician") -> CalibrationStore:
    """Return a verified calibration of cameras in a folder."""
    first = make_record()
    cameras = tuple(
        msgspec.structs.replace(one, serial=one.serial + shift) for one in first.cameras
    )
    record = make_record(cameras=cameras, points=400 + day, made_by=by)
    store, at = CalibrationStore(folder), MADE + timedelta(hours=day)
    store.accept(record, "technician", "new", at)
    store.verify(make_verification(record), at)
    return store


def _state(folder: Path) -> State:
    with suppress(OcmmError):
        return CalibrationStore(folder).status(NOW).state
    return State.UNUSABLE


def _replaced(old: Path, there: Path, rng: Rng) -> Path:
    del rng
    shutil.rmtree(there)
    return Path(shutil.copytree(old, there))


def _linked(old: Path, there: Path, rng: Rng) -> Path:
    moved = there.with_name(f"kept{rng.integers(1 << 40)}")
    there.rename(moved)
    there.symlink_to(old, target_is_directory=True)
    return there


def _parent_linked(old: Path, there: Path, rng: Rng) -> Path:
    elsewhere = old.parent / f"parent{rng.integers(1 << 40)}"
    shutil.copytree(old, elsewhere / there.name)
    there.parent.rename(there.parent.with_name("moved"))
    there.parent.symlink_to(elsewhere, target_is_directory=True)
    return there


def _renamed(old: Path, there: Path, rng: Rng) -> Path:
    return Path(shutil.copytree(old, there.with_name(f"other{rng.integers(1 << 40)}")))


def _hard_linked(old: Path, there: Path, rng: Rng) -> Path:
    del rng
    shutil.rmtree(there)
    return Path(shutil.copytree(old, there, copy_function=os.link))


def _by_dots(old: Path, there: Path, rng: Rng) -> Path:
    return _replaced(old, there, rng).parent / ".." / there.parent.name / there.name


def _other_case(old: Path, there: Path, rng: Rng) -> Path:
    del rng
    return Path(shutil.copytree(old, there.with_name(there.name.upper())))


def _as_virtual(old: Path, there: Path, rng: Rng) -> Path:
    del rng
    return Path(shutil.copytree(old, there.parent / "virtual-probes" / there.name))


PATHS: tuple[Callable[[Path, Path, Rng], Path], ...] = (
    _replaced, _linked, _parent_linked, _renamed, _hard_linked, _by_dots, _other_case, _as_virtual,
)  # fmt: skip


def _whole(folder: Path) -> None:
    del folder


def _each(folder: Path) -> Iterator[Path]:
    return (one for one in folder.iterdir() if one.suffix == ".json")


def _emptied(folder: Path) -> None:
    for one in _each(folder):
        one.write_bytes(b"")


def _cut(folder: Path) -> None:
    for one in _each(folder):
        one.write_bytes(one.read_bytes()[:20])


def _garbage(folder: Path) -> None:
    for one in _each(folder):
        one.write_bytes(b"\xff" * 80)


def _deleted(folder: Path) -> None:
    for one in list(_each(folder)):
        one.unlink()


def _all_deleted(folder: Path) -> None:
    shutil.rmtree(folder)


def _writable(folder: Path) -> None:
    for one in _each(folder):
        one.chmod(0o666)


def _open_folder(folder: Path) -> None:
    folder.chmod(0o777)


def _folders(folder: Path) -> None:
    for one in list(_each(folder)):
        one.unlink()
        one.mkdir()


def _pipes(folder: Path) -> None:
    for one in list(_each(folder)):
        one.unlink()
        os.mkfifo(one)


def _links(folder: Path) -> None:
    for one in list(_each(folder)):
        kept = one.rename(one.with_suffix(".kept"))
        one.symlink_to(kept)


MEMORIES: tuple[Callable[[Path], None], ...] = (
    _whole, _emptied, _cut, _garbage, _deleted, _all_deleted, _writable, _open_folder, _folders,
    _pipes, _links,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Template:
    """A station with a history, an older copy of it, an older complete one, and its memory."""

    home: Path
    root: Path
    current: Path
    older: Path
    former: Path


def make_template(folder: Path) -> Template:
    """Return the station; the environment must name its home."""
    root = folder / "calibrations"
    there, kept = root / "recommended", folder / "kept"
    _history(there, 0)
    kept.mkdir()
    there.rename(kept / "former")
    store = _history(there, 24)
    shutil.copytree(there, kept / "older")
    store.suspect("technician", "A camera was hit.", None, MADE + timedelta(hours=30))
    store.verify(make_verification(store.active() or make_record()), MADE + timedelta(hours=31))
    home = memory_folder().parent
    shutil.copytree(home, folder / "memory")
    return Template(folder / "memory", root, there, kept / "older", kept / "former")


@contextmanager
def _fresh(template: Template, folder: Path, number: int) -> Iterator[Template]:
    """Return a copy of the station with its memory, to be attacked."""
    here = folder / f"trial{number}"
    shutil.rmtree(memory_folder().parent)
    shutil.copytree(template.home, memory_folder().parent)
    shutil.copytree(template.root, here / "calibrations")
    shutil.copytree(template.older.parent, here / "kept")
    try:
        yield Template(
            template.home, here / "calibrations", here / "calibrations" / template.current.name,
            here / "kept" / "older", here / "kept" / "former",
        )  # fmt: skip
    finally:
        shutil.rmtree(here)


def run_attacks(trials: int, seed: int, folder: Path) -> Found:
    """Restore older histories, damage memories, set clocks back; return the counts of VALID."""
    found = Found()
    template = make_template(folder)
    for number in range(trials):
        rng = np.random.default_rng((seed, number))
        path = PATHS[number % len(PATHS)]
        memory = MEMORIES[(number // len(PATHS)) % len(MEMORIES)]
        what = ("older", "former", "current")[int(rng.integers(3))]
        with _fresh(template, folder, number) as at:
            if what == "current":
                # The clock: a check was later, then the folder was moved.
                _ = CalibrationStore(at.current).status(_LATER)
                old = at.current.rename(at.older.with_name("again"))
                shutil.copytree(old, at.current)
            else:
                old = getattr(at, what)
            memory(memory_folder())
            there = path(old, at.current, rng)
            name = f"{what}, {path.__name__}, {memory.__name__}, trial {number}"
            found.done[f"{what}, memory {memory.__name__.strip('_')}"] += 1
            if _state(there) in (State.VALID, State.DUE):
                found.passed.append(name)
    return found


def make_documents(folder: Path) -> Template:
    """Return a station with a folder of a plan and settings, in two versions each."""
    now, older = folder / "calibrations" / "documents", folder / "kept" / "older"
    now.mkdir(parents=True)
    plan, settings = now / "plan.toml", SettingsFile(now / "settings.toml")
    shutil.copy(resource("plans", "quick.toml"), plan)
    for number, revision in enumerate("CD"):
        plan.write_text(f"{plan.read_text('utf-8')}# {revision}\n", "utf-8")
        release_plan(plan, "Grace", f"revision {revision}")
        settings.change({"temperature.part_c": 20.5 + number}, stamp="2026-11-28")
        if not number:
            shutil.copytree(now, older)
    shutil.copytree(memory_folder().parent, folder / "memory")
    return Template(folder / "memory", now.parent, now, older, older)


def _judged_documents(folder: Path) -> Judged:
    """Return whether plan and settings of a folder count, which must be the same of both."""
    try:
        plan = plan_release(folder / "plan.toml")
        settings = SettingsFile(folder / "settings.toml")
        sound = settings.signer().sound
    except OcmmError as error:
        return Judged(False, error.what, error.remedy)
    notes = settings.read().notes
    said = " ".join((plan.summary, *(f"{one.what} {one.remedy}" for one in notes)))
    if plan.released != sound:
        return Judged(None, said, "")
    return Judged(sound, said, said)


def run_older_documents(trials: int, seed: int, folder: Path) -> Found:
    """Put an older plan and older settings back; return the counts of those that are believed."""
    found = Found()
    template = make_documents(folder)
    memories = [one for one in MEMORIES if one not in (_deleted, _all_deleted)]
    for number in range(trials):
        rng = np.random.default_rng((seed, number, 3))
        path = PATHS[number % len(PATHS)]
        memory = memories[(number // len(PATHS)) % len(memories)]
        with _fresh(template, folder, number) as at:
            memory(memory_folder())
            there = path(at.older, at.current, rng)
            found.done[f"older documents, memory {memory.__name__.strip('_')}"] += 1
            with suppress(OcmmError):
                if plan_release(there / "plan.toml").released:
                    found.passed.append(f"plan, {path.__name__}, {memory.__name__}, trial {number}")
            with suppress(OcmmError):
                if SettingsFile(there / "settings.toml").signer().sound:
                    found.passed.append(
                        f"settings, {path.__name__}, {memory.__name__}, trial {number}"
                    )
    return found


def run_adopted(trials: int, seed: int, folder: Path) -> Found:
    """Change jobs, adopt them, and return those that are INTACT afterwards."""
    found, site = Found(), make_site(folder)
    kept = folder / "memory"
    shutil.copytree(memory_folder(), kept)
    kinds, honest = list(EDITS), audit(site.path).rows
    for number in range(trials):
        rng = np.random.default_rng((seed, number, 2))
        kind, memory = kinds[number % len(kinds)], MEMORIES[number // len(kinds) % len(MEMORIES)]
        shutil.rmtree(memory_folder(), ignore_errors=True)
        shutil.copytree(kept, memory_folder())
        site.path.write_bytes(site.content)
        EDITS[kind](site, rng)
        memory(memory_folder())
        changed = _changed(site)
        adopted = _adopt(site.path)
        found.done[f"adopted {adopted}: {kind}"] += 1
        with suppress(OcmmError):
            seen = audit(site.path)
            if seen.intact and (adopted or changed or seen.rows != honest):
                found.passed.append(f"{kind}, {memory.__name__}, trial {number}")
        for one in folder.glob("*.ocmm-*"):
            one.unlink()
    return found


def _changed(site: Site) -> bool:
    try:
        with JobFile.open(site.path, read_only=True) as job:
            return bool(job.verify())
    except OcmmError:
        return True


def _adopt(path: Path) -> bool:
    try:
        with JobFile.open(path) as job:
            job.adopt("Mallory", "please")
    except OcmmError:
        return False
    return True


def _folder_renamed(at: Template, rng: Rng) -> tuple[Path, bool]:
    return at.root.rename(at.root.with_name(f"c{rng.integers(99)}")) / at.current.name, True


def _folder_linked(at: Template, rng: Rng) -> tuple[Path, bool]:
    moved = at.root.rename(at.root.with_name(f"disk{rng.integers(99)}"))
    at.root.symlink_to(moved, target_is_directory=True)
    return at.current, True


def _home_moved(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Copy key and memory to a new home, and look from there."""
    home = at.root.with_name(f"home{rng.integers(99)}")
    for name, sub in (("XDG_DATA_HOME", "data"), ("XDG_STATE_HOME", "state")):
        shutil.copytree(os.environ[name], home / sub)
        os.environ[name] = str(home / sub)
    return at.current, True


def _key_moved(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Bring the key to another user without the memory, and say so by name."""
    home = at.root.with_name(f"home{rng.integers(99)}")
    os.environ["XDG_STATE_HOME"] = str(home / "state")
    start_memory(KeyFolder(), "Ada", "new computer", NOW)
    return at.current, True


def _key_moved_silently(at: Template, rng: Rng) -> tuple[Path, bool]:
    home = at.root.with_name(f"home{rng.integers(99)}")
    os.environ["XDG_STATE_HOME"] = str(home / "state")
    return at.current, False


def _other_computer(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Look from a computer that trusts the station."""
    public = KeyFolder().station_key().public
    home = at.root.with_name(f"home{rng.integers(99)}")
    os.environ["XDG_DATA_HOME"], os.environ["XDG_STATE_HOME"] = str(home / "d"), str(home / "s")
    KeyFolder().trust(public, "Cell 1", "Ada", "compared", NOW)
    return at.current, True


def _backup_restored(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Restore an older backup and answer for it: a verification is measured."""
    del rng
    shutil.rmtree(at.current)
    shutil.copytree(at.older, at.current)
    store = CalibrationStore(at.current)
    store.verify(make_verification(store.active() or make_record()), NOW - timedelta(hours=1))
    return at.current, True


def _backup_restored_silently(at: Template, rng: Rng) -> tuple[Path, bool]:
    del rng
    shutil.rmtree(at.current)
    shutil.copytree(at.older, at.current)
    return at.current, False


def _newest_restored(at: Template, rng: Rng) -> tuple[Path, bool]:
    del rng
    backup = at.older.with_name("newest")
    shutil.copytree(at.current, backup)
    shutil.rmtree(at.current)
    backup.rename(at.current)
    return at.current, True


def _same_name(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Calibrate another rig of the same name in another folder."""
    _history(at.root.with_name("second") / at.current.name, 40, shift=int(rng.integers(1, 99)))
    return at.current, True


def _practised(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Practise with the same cameras."""
    del rng
    _history(at.root.with_name("practice") / at.current.name, 40, by="PRACTICE: Ada")
    return at.current, True


def _upgraded(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Give the memory the form of version 0.1, which was keyed by path."""
    del rng
    old_memory(at.current, memory_folder())
    return at.current, True


def _released_again(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Restore an older backup and answer for it by name."""
    del rng
    shutil.rmtree(at.current)
    shutil.copytree(at.older, at.current)
    release_plan(at.current / "plan.toml", "Grace", "restored")
    SettingsFile(at.current / "settings.toml").confirm("Grace")
    return at.current, True


def _copied(at: Template, rng: Rng) -> tuple[Path, bool]:
    return Path(shutil.copytree(at.current, at.root.with_name(f"usb{rng.integers(99)}"))), True


def _key_moved_with_documents(at: Template, rng: Rng) -> tuple[Path, bool]:
    """Bring key and documents to another user without the memory: they are the last versions."""
    return _key_moved_silently(at, rng)[0], True


DOCUMENT_MOVES: tuple[Move, ...] = (
    _folder_renamed, _folder_linked, _home_moved, _key_moved, _key_moved_with_documents,
    _other_computer, _released_again, _backup_restored_silently, _newest_restored, _copied,
)  # fmt: skip
MOVES: tuple[Move, ...] = (
    _folder_renamed, _folder_linked, _home_moved, _key_moved, _key_moved_silently, _other_computer,
    _backup_restored, _backup_restored_silently, _newest_restored, _same_name, _practised,
    _upgraded,
)  # fmt: skip


def old_memory(current: Path, folder: Path) -> None:
    """Replace the memory by one that version 0.1 wrote of a history."""
    import hashlib

    links = [
        msgspec.json.decode(line)["sha256"]
        for line in (current / "events.jsonl").read_bytes().splitlines()
    ]
    shutil.rmtree(folder)
    folder.mkdir()
    for name in (f"folder {current.resolve()}", f"history {links[0]}"):
        seen = {
            "name": name, "count": len(links), "link": links[-1], "utc": "",
            "place": str(current.resolve()),
        }  # fmt: skip
        digest = hashlib.sha256(name.encode()).hexdigest()[:32]
        (folder / f"{digest}.json").write_bytes(msgspec.json.encode(seen))


def _judged_history(folder: Path) -> Judged:
    said = CalibrationStore(folder).status(NOW)
    return Judged(said.state is State.VALID, said.reason, said.remedy)


def run_honest(trials: int, seed: int, folder: Path, *, documents: bool = False) -> Found:
    """Move files as their owner does; return those that were called a forgery."""
    found = Found()
    template = make_documents(folder) if documents else make_template(folder)
    judge = _judged_documents if documents else _judged_history
    moves = DOCUMENT_MOVES if documents else MOVES
    for number in range(trials):
        rng = np.random.default_rng((seed, number, 1))
        move = moves[number % len(moves)]
        names = ("XDG_DATA_HOME", "XDG_STATE_HOME")
        before = {name: os.environ[name] for name in names}
        try:
            with _fresh(template, folder, number) as at:
                there, valid = move(at, rng)
                said = judge(there)
        finally:
            os.environ.update(before)
        found.done[f"{template.current.name} {move.__name__.strip('_')}"] += 1
        called = [word for word in ACCUSING if word in said.reason]
        if called or said.valid != valid or (not valid and not said.remedy):
            found.accused.append(f"{move.__name__}, trial {number}: {said}")
    return found


def main() -> int:
    """Run all; return whether a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=TRIALS)
    parser.add_argument("--honest", type=int, default=HONEST)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    third, honest = arguments.n // 3, arguments.honest // 2
    runs = (
        (run_attacks, third), (run_older_documents, third),
        (run_adopted, arguments.n - 2 * third), (run_honest, arguments.honest - honest),
        (partial(run_honest, documents=True), honest),
    )  # fmt: skip
    results = []
    for run, trials in runs:
        # A station for each: attacks leave its memory damaged.
        with tempfile.TemporaryDirectory() as name, other_station(Path(name) / "home"):
            (Path(name) / "place").mkdir()
            results.append(run(trials, arguments.seed, Path(name) / "place"))
    for found in results:
        for kind, count in sorted(found.done.items()):
            print(f"{kind:50}{count:8}")
    passed = [one for found in results for one in found.passed]
    accused = [one for found in results for one in found.accused]
    print(f"{'VALID or INTACT':50}{len(passed):8} of {arguments.n} (limit 0)")
    print(f"{'honest moves called a forgery':50}{len(accused):8} of {arguments.honest} (limit 0)")
    for line in (*passed[:10], *accused[:10]):
        print(f"    {line}")
    return int(bool(passed or accused))


if __name__ == "__main__":
    sys.exit(main())
