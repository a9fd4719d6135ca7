"""Damage to the files that a VALID rests on: none may leave VALID, and none may end a program.

Stores of cameras and of a probe with a history (calibrated, failed, put in doubt, verified) are
damaged in one place at a time: bits, bytes, lines, whole files, taken from an earlier version of
the same file, from its neighbour or from another rig, with and without the times and the length
that the file had. Each damage is looked at by a job that begins after it and by one that ran
before. Afterwards the files are restored, and both must say VALID again. What this computer
remembers of the folder is forgotten before each look, so that the folder alone must tell; last,
the whole folder is set back to each earlier state, which only that memory notices.
Run: ``python -m benchmarks.evidence --n 10000``.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from benchmarks.evidence_edits import EDITS, Rng
from benchmarks.evidence_site import EVENTS, Store, View, cameras_in, probe_in
from ocmm_core.calibration.records import NAME as SEAL
from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.errors import OcmmError
from ocmm_core.seals import KeyFolder, start_memory

TRIALS = 10_000
LOOK_LIMIT_S = 0.002
"""Median of a look while a job runs."""

Damage = Mapping[str, bytes | None]
"""What files hold after it, by their names; None for a file that is gone."""


@dataclass(frozen=True, slots=True)
class Bench:
    """Stores to be damaged, and others to take files from."""

    stores: tuple[Store, ...]
    others: tuple[Store, ...]


@dataclass(slots=True)
class Count:
    """What came of the damages.

    Attributes
    ----------
    done
        By kind of damage and kind of file.
    valid
        Damages that left VALID or DUE, in words.
    ended
        Damages that ended in an exception, in words.
    nameless
        Damages of which the sentence names neither the file nor its folder.
    unrestored
        Damages after which the restored files were not VALID.
    looks_s, begins_s
        Processor time of a look while a job runs, and of opening at the beginning of one.
    """

    done: Counter[tuple[str, str]] = field(default_factory=Counter)
    valid: list[str] = field(default_factory=list)
    ended: list[str] = field(default_factory=list)
    nameless: list[str] = field(default_factory=list)
    unrestored: list[str] = field(default_factory=list)
    looks_s: list[float] = field(default_factory=list)
    begins_s: list[float] = field(default_factory=list)


def make_bench(folder: Path) -> Bench:
    """Return stores of two rigs and of two probes."""
    return Bench(
        (cameras_in(folder / "cal", 0), probe_in(folder / "probes", 0)),
        (cameras_in(folder / "other-cal", 7), probe_in(folder / "other-probes", 7)),
    )


MOVES = (
    "deleted", "earlier version", "neighbour in its place", "that of the other rig",
    "folder of the other rig", "history cut, seal deleted", "sessions deleted",
)  # fmt: skip
KINDS = (*(one.__name__ for one in EDITS), *MOVES)


def draw(rng: Rng, kind: str, store: Store, other: Store) -> tuple[str, Damage]:
    """Return a damage of a kind, and its file; drawn again if it changes nothing."""
    while True:
        roles = sorted({store.role(one) for one in store.files})
        role = roles[int(rng.integers(len(roles)))]
        name = str(rng.choice(sorted(one for one in store.files if store.role(one) == role)))
        damage = dict(_drawn(rng, kind, name, store, other))
        changed = {one: new for one, new in damage.items() if new != store.files.get(one)}
        if changed:
            return (name if name in changed else next(iter(changed))), changed


def _drawn(rng: Rng, kind: str, name: str, store: Store, other: Store) -> Damage:
    content = store.files[name]
    edits = {one.__name__: one for one in EDITS}
    if kind in edits:
        return {name: edits[kind](rng, content)}
    if kind == "deleted":
        return {name: None}
    if kind == "earlier version":
        name = str(rng.choice(sorted(store.earlier)))
        versions = store.earlier[name]
        return {name: versions[int(rng.integers(len(versions)))]}
    alike = [one for one in store.files if store.role(one) == store.role(name)]
    if kind == "neighbour in its place":
        return {name: store.files[str(rng.choice(sorted(alike)))]}
    if kind == "that of the other rig":
        there = [one for one in other.files if other.role(one) == store.role(name)]
        return {name: other.files[str(rng.choice(sorted(there)))]}
    if kind == "folder of the other rig":
        return {**dict.fromkeys(store.files), **other.files}
    if kind == "sessions deleted":
        return {one: None for one in store.files if store.role(one) == "session"}
    versions = store.earlier[EVENTS]
    return {EVENTS: versions[int(rng.integers(len(versions)))], SEAL: None}


def put(folder: Path, files: Damage, *, keep_times: bool = False) -> None:
    """Write or delete files; with their times where these are to be kept."""
    for name, content in files.items():
        path = folder / name
        before = path.stat() if path.exists() else None
        if content is None:
            path.unlink(missing_ok=True)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("r+b" if before is not None else "wb") as stream:
            # In place, as an editor or a bad disk does it: the file keeps its inode.
            stream.write(content)
            stream.truncate()
        if keep_times and before is not None:
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def restore(store: Store) -> None:
    """Restore the files of a store."""
    for path in [one for one in store.folder.rglob("*") if one.is_file()]:
        if path.relative_to(store.folder).as_posix() not in store.files:
            path.unlink()
    current = {
        name: (store.folder / name).read_bytes() if (store.folder / name).exists() else None
        for name in store.files
    }
    put(store.folder, {name: old for name, old in store.files.items() if current[name] != old})


def forget() -> None:
    """Clear this computer's memory, by name, so that no missing memory is reported."""
    shutil.rmtree(Path(os.environ["XDG_STATE_HOME"]), ignore_errors=True)
    start_memory(KeyFolder(), "benchmark", "only damage counts", datetime(9999, 1, 1, tzinfo=UTC))


def run(trials: int, seed: int, folder: Path) -> Count:
    """Return what came of ``trials`` damages; the state of this computer must be in ``folder``."""
    bench, count = make_bench(folder), Count()
    rng = np.random.default_rng(seed)
    running = {}
    for store in bench.stores:
        running[store.kind] = store.begin()
        _require(running[store.kind]().word is CalibrationStatus.VALID)
    for trial in range(trials):
        number = trial % 2
        store, other = bench.stores[number], bench.others[number]
        kind = KINDS[(trial // 2) % len(KINDS)]
        name, damage = draw(rng, kind, store, other)
        count.done[kind, store.role(name)] += 1
        put(store.folder, damage, keep_times=bool(rng.integers(2)))
        what = f"{store.kind}: {kind}, {name}, trial {trial}"
        forget()
        _look(count, store, what, "running", running[store.kind])
        started = time.process_time()
        _look(count, store, what, "beginning", lambda s=store: s.begin()())  # type: ignore[misc] # bound now
        count.begins_s.append(time.process_time() - started)
        restore(store)
        try:
            started = time.process_time()
            word = running[store.kind]().word
            count.looks_s.append(time.process_time() - started)
            again = store.begin()().word if trial % 20 < 2 else CalibrationStatus.VALID
        except (OcmmError, OSError) as error:
            count.ended.append(f"{what}, restored: {error!r}")
            continue
        if (word, again) != (CalibrationStatus.VALID, CalibrationStatus.VALID):
            count.unrestored.append(f"{what}: {word} and {again}")
            running[store.kind] = store.begin()
    return count


def _look(count: Count, store: Store, what: str, when: str, look: Callable[[], View]) -> None:
    try:
        view = look()
    except Exception as error:
        count.ended.append(f"{what}, {when}: {error!r}")
        return
    if view.blocker is None:
        count.valid.append(f"{what}, {when}: {view.word}")
    elif str(store.folder) not in view.blocker.what and f"{MOVES[4]}, " not in what:
        # For the folder of another rig, both rigs are named.
        count.nameless.append(f"{what}, {when}: {view.blocker}")


def set_back(folder: Path) -> tuple[int, int, int]:
    """Return states that a whole folder was set back to, and how many of them left VALID.

    Returns
    -------
    tuple
        States; VALID with the memory of this computer; VALID without it.
    """
    states = noticed = unnoticed = 0
    for store in make_bench(folder).stores:
        _require(store.begin()().word is CalibrationStatus.VALID)
        for events, seal in zip(store.earlier[EVENTS], store.earlier[SEAL], strict=True):
            states += 1
            put(store.folder, {EVENTS: events, SEAL: seal})
            noticed += store.begin()().blocker is None
            kept = Path(os.environ["XDG_STATE_HOME"])
            kept.rename(kept.with_name("kept"))
            unnoticed += store.begin()().blocker is None
            shutil.rmtree(kept, ignore_errors=True)
            kept.with_name("kept").rename(kept)
        restore(store)
    return states, noticed, unnoticed


def _require(condition: bool) -> None:
    if not condition:
        raise AssertionError("The stores are not VALID to begin with.")


def report(count: Count) -> bool:
    """Print the table; return whether all limits are kept."""
    roles = ("history", "seal", "record", "session")
    print(f"{'damage':28}" + "".join(f"{role:>10}" for role in roles))
    for kind in KINDS:
        print(f"{kind:28}" + "".join(f"{count.done[kind, role]:10}" for role in roles))
    total = sum(count.done.values())
    for title, found in (
        ("left VALID or DUE", count.valid),
        ("ended in an exception", count.ended),
        ("sentence without a place", count.nameless),
        ("not VALID after restoring", count.unrestored),
    ):
        print(f"{title:28}{len(found):10} of {total} (limit 0)")
        for one in found[:5]:
            print(f"    {one}")
    look = float(np.median(count.looks_s))
    print(f"{'a look while a job runs':28}{1e3 * look:10.2f} ms (limit {1e3 * LOOK_LIMIT_S:g} ms)")
    print(f"{'opening with a full check':28}{1e3 * float(np.median(count.begins_s)):10.2f} ms")
    bad = count.valid or count.ended or count.nameless or count.unrestored
    return not bad and look <= LOOK_LIMIT_S


def main() -> int:
    """Print the tables; 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=TRIALS)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["XDG_STATE_HOME"] = str(folder / "state")
        good = report(run(arguments.n, arguments.seed, folder / "damaged"))
        states, noticed, unnoticed = set_back(folder / "set-back")
    print(
        f"{'whole folder set back':28}{noticed:10} of {states} left VALID with the memory of this "
        f"computer (limit 0), {unnoticed} with the memory removed (limit 0)"
    )
    return int(not good or noticed > 0 or unnoticed > 0)


if __name__ == "__main__":
    sys.exit(main())
