"""Changed jobs and rolled-back histories: every change must be noticed, no honest job accused.

Jobs with points, undone points and events are changed by an attacker with the file but not the key
of the station: a byte flipped, the file cut, two files exchanged, a row edited with the whole chain
recomputed, signatures left out, copied from an earlier step or made with another key, the end
removed, an older copy restored, the format of an earlier version. The program that recorded the job
then opens it; a change counts as noticed if `JobFile.verify` reports it or opening raises an error.
It counts as unnoticed if neither happens and the content differs: SQLite ignores some bytes, and
changing those changes nothing. Histories of calibrations are rolled back, recreated elsewhere and
read with the clock turned back; `benchmarks.evidence` damages their files. Honest jobs in between
must verify without findings; `benchmarks.kill` counts the faults of jobs after kills.
Run: ``python -m benchmarks.tampering --n 10000``.
"""

from __future__ import annotations

import argparse
import shutil
import sqlite3
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path

import numpy as np

from benchmarks.evidence_site import NOW, cameras_in
from ocmm_bench.campaign import other_station
from ocmm_core.calibration.records import CalibrationStore, State
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import AUDITED, JobFile, digest_row, make_head

TRIALS = 10_000
ENDED = "ended by"
Rng = np.random.Generator


@dataclass(frozen=True, slots=True)
class Site:
    """Two finished jobs, as they are and as the first one was at an earlier step."""

    folder: Path
    path: Path
    content: bytes
    other: bytes
    older: tuple[bytes, ...]
    holds: tuple[object, ...]


def make_site(folder: Path) -> Site:
    """Return jobs of this station; they are read back before they count."""
    rng = np.random.default_rng(1)
    path, older = folder / "JOB-001.ocmm", []
    with _begun(path) as job:
        for number in range(1, 13):
            job.append_point(_point(number, rng))
            if number % 4 == 0:
                job.change(annul={number - 1: "a burr"})
                job.append_event("note", f"after point {number}")
                (folder / f"{number}.bak").write_bytes(job.content())
                older.append((folder / f"{number}.bak").read_bytes())
    other = folder / "other.ocmm"
    with _begun(other) as job:
        for number in range(1, 13):
            job.append_point(_point(number, rng))
    content = path.read_bytes()
    site = Site(folder, path, content, other.read_bytes(), tuple(older[:-1]), ())
    noticed, holds = look(path)
    if noticed:
        raise SystemExit(f"The job is not free of doubts: {noticed}")
    return replace(site, holds=holds)


def _begun(path: Path) -> JobFile:
    head = make_head(
        plan=resource("plans", "quick.toml"), rig=resource("rigs", "recommended.toml"),
        probe=resource("probes", "standard.toml"), operator="me", part="P", serial="1",
    )  # fmt: skip
    return JobFile.create(path, head)


def _point(number: int, rng: Rng) -> MeasuredPoint:
    return MeasuredPoint(
        number=number, feature="BED", time_s=float(number), first_frame=number, last_frame=number,
        n_frames=1, tip_world=rng.normal(size=3), random_covariance=np.eye(3) * 1e-6,
        direction=np.array([0.0, 0.0, 1.0]), tip_radius=3.0,
        rotation_world_from_probe=np.eye(3), spots=rng.normal(size=(2, 5, 2)), chi2_per_dof=1.0,
        approach="trail",
    )  # fmt: skip


def look(path: Path) -> tuple[str, tuple[object, ...]]:
    """Return the findings about a job, empty without any, and its content."""
    try:
        with JobFile.open(path) as job:
            faults = job.verify()
            holds = (
                job.head,
                tuple((p.number, p.tip_world.tobytes(), p.spots.tobytes()) for p in job.points()),
                tuple((p.number, why) for p, why in job.annulled()),
                tuple(job.events()),
            )
    except OcmmError as error:
        return error.what, ()
    except Exception as error:  # a traceback in front of a user: noticed, and never allowed
        return f"{ENDED} {error!r}", ()
    return (faults[0] if faults else ""), holds


def _byte(site: Site, rng: Rng) -> None:
    content = bytearray(site.content)
    place = int(rng.integers(len(content)))
    content[place] ^= int(rng.integers(1, 256))
    site.path.write_bytes(bytes(content))


def _cut(site: Site, rng: Rng) -> None:
    site.path.write_bytes(site.content[: int(rng.integers(len(site.content)))])


def _page(site: Site, rng: Rng) -> None:
    """Take a page of the file from the other job, or from the job as it was before."""
    source = (site.other, *site.older)[int(rng.integers(1 + len(site.older)))]
    pages = min(len(source), len(site.content)) // 4096
    at = 4096 * int(rng.integers(pages))
    site.path.write_bytes(site.content[:at] + source[at : at + 4096] + site.content[at + 4096 :])


def _exchanged(site: Site, rng: Rng) -> None:
    """Put the points of another job under the head of this one, with the old or a new chain."""
    spare = site.folder / "spare.ocmm"
    spare.write_bytes(site.content)
    site.path.write_bytes(site.other)
    _edit(
        site,
        [
            f"ATTACH '{spare}' AS spare",
            "DELETE FROM main.head",
            "INSERT INTO main.head SELECT * FROM spare.head",
            "DETACH spare",
        ],
        chain=bool(rng.integers(2)),
    )


def _set_back(site: Site, rng: Rng) -> None:
    site.path.write_bytes(site.older[int(rng.integers(len(site.older)))])


def _end_removed(site: Site, rng: Rng) -> None:
    first = int(rng.integers(2, 18))
    _edit(
        site,
        [
            f"DELETE FROM {table} WHERE {key} IN "  # noqa: S608 - constants of this module
            f"(SELECT key FROM audit WHERE subject = '{table}' AND sequence >= {first})"
            for table, key in (("event", "id"), ("annulment", "number"), ("observation", "number"))
        ]
        + [f"DELETE FROM {table} WHERE sequence >= {first}" for table in ("seal", "audit")],  # noqa: S608
    )


def _unsigned(site: Site, rng: Rng) -> None:
    _edit(site, ["DELETE FROM seal", *_narrower(rng)], chain=True)


def _downgraded(site: Site, rng: Rng) -> None:
    _edit(
        site,
        [*_narrower(rng), "DROP TABLE seal", "DROP TABLE part", "PRAGMA user_version = 2"],
        chain=True,
    )  # fmt: skip


def _chain_anew(site: Site, rng: Rng) -> None:
    """Change stored data and compute the whole chain again; the signatures stay."""
    _edit(site, list(_narrower(rng)), chain=True)


def _signature_moved(site: Site, rng: Rng) -> None:
    step = int(rng.integers(1, 10))
    _edit(
        site,
        [
            *_narrower(rng),
            "UPDATE seal SET signature = (SELECT signature FROM seal ORDER BY sequence "  # noqa: S608
            f"LIMIT 1 OFFSET {step}) WHERE sequence = (SELECT max(sequence) FROM seal)",
        ],
        chain=True,
    )


def _strangers_key(site: Site, rng: Rng) -> None:
    """Write the whole job again with another key, under the same identity."""
    home = site.folder / "stranger"
    site.path.unlink()
    with other_station(home), _begun(site.path) as job:
        for number in range(1, 13):
            job.append_point(_point(number, rng))
    _edit(site, ["UPDATE head SET operator = 'me'"])


EDITS: dict[str, Callable[[Site, Rng], None]] = {
    "a byte": _byte,
    "cut short": _cut,
    "a page of another file": _page,
    "exchanged for another job": _exchanged,
    "older copy put back": _set_back,
    "end removed": _end_removed,
    "signatures left out": _unsigned,
    "format of an earlier version": _downgraded,
    "chain computed anew": _chain_anew,
    "signature of another step": _signature_moved,
    "written anew with another key": _strangers_key,
}


def _narrower(rng: Rng) -> list[str]:
    """Return statements that make a bad part a good one."""
    return [
        [
            "UPDATE head SET plan_text = replace(plan_text, '0.08', '0.88')",
            f"UPDATE observation SET tip_radius = 2.9 WHERE number = {int(rng.integers(1, 13))}",  # noqa: S608
            "DELETE FROM annulment WHERE number = 3",
            "UPDATE event SET text = 'nothing happened' WHERE id = 1",
        ][int(rng.integers(4))]
    ]


def _edit(site: Site, statements: list[str], *, chain: bool = False) -> None:
    if site.path.read_bytes()[:4] != b"SQLi" or not site.path.exists():
        site.path.write_bytes(site.content)
    db = sqlite3.connect(site.path, isolation_level=None)
    try:
        names = db.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for name, _ in names:
            db.execute(f"DROP TRIGGER {name}")
        for statement in statements:
            db.execute(statement)
        if chain:
            _link_anew(db)
        # As they were: a file without them would look like another one.
        for _, sql in names:
            with suppress(sqlite3.Error):
                db.execute(sql)
    finally:
        db.close()


def _link_anew(db: sqlite3.Connection) -> None:
    """Compute every hash of the audit from the stored data, as an attacker with the program can."""
    rows = db.execute("SELECT sequence, time_utc, subject, key FROM audit ORDER BY sequence")
    previous, number = "0" * 64, 0
    for sequence, utc, subject, key in rows.fetchall():
        columns = AUDITED[subject]
        stored = db.execute(
            f"SELECT {','.join(columns)} FROM {subject} WHERE {columns[0]} = ?",  # noqa: S608
            (key,),
        ).fetchone()
        db.execute("DELETE FROM audit WHERE sequence = ?", (sequence,))
        if stored is None:
            continue
        number += 1
        link = (number, utc, subject, key, digest_row(stored), previous)
        previous = digest_row(link)
        db.execute("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?)", (*link, previous))


@dataclass(slots=True)
class Count:
    """Changes by kind, those without effect, unnoticed or with a traceback; honest jobs accused."""

    done: Counter[str] = field(default_factory=Counter)
    nothing: Counter[str] = field(default_factory=Counter)
    unnoticed: list[str] = field(default_factory=list)
    ended: list[str] = field(default_factory=list)
    accused: int = 0
    honest: int = 0


def run(trials: int, seed: int, folder: Path) -> Count:
    """Change jobs and check each."""
    site, count = make_site(folder), Count()
    kinds = list(EDITS)
    for number in range(trials):
        rng = np.random.default_rng((seed, number))
        kind = kinds[number % len(kinds)]
        site.path.write_bytes(site.content)
        EDITS[kind](site, rng)
        count.done[kind] += 1
        noticed, holds = look(site.path)
        if not noticed and holds == site.holds:
            count.nothing[kind] += 1
        elif not noticed:
            count.unnoticed.append(f"{kind}, trial {number}")
        elif noticed.startswith(ENDED):
            count.ended.append(f"{kind}, trial {number}: {noticed}")
        for beside in folder.glob("*.bak"):
            beside.unlink()
        if number % 10 == 9:
            site.path.write_bytes(site.content)
            count.honest += 1
            count.accused += bool(look(site.path)[0])
    return count


def run_histories(trials: int, seed: int, folder: Path) -> tuple[Counter[str], list[str], int]:
    """Restore old histories, rewrite them and turn the clock; return the passes as VALID."""
    done: Counter[str] = Counter()
    passed: list[str] = []
    accused = 0
    for number in range(trials):
        rng = np.random.default_rng((seed, number, 1))
        here = folder / f"history-{number}"
        kind = ("older copy", "older copy elsewhere", "made elsewhere", "clock turned back")[
            number % 4
        ]
        now = NOW
        if kind == "made elsewhere":
            with other_station(folder / "stranger"):
                store = cameras_in(here, 0).folder
        else:
            store = cameras_in(here, 0).folder
            older = here / "older"
            shutil.copytree(store, older)
            opened = CalibrationStore(store)
            accused += opened.status(NOW).state is not State.VALID
            if kind == "clock turned back":
                opened.status(NOW + timedelta(days=int(rng.integers(400, 4000))))
                now = NOW + timedelta(days=float(rng.uniform(0.0, 20.0)))
            else:
                opened.suspect("engineer", "A camera was hit.", None, NOW)
                if kind == "older copy":
                    shutil.rmtree(store)
                    shutil.copytree(older, store)
                else:
                    store = older
        done[kind] += 1
        if CalibrationStore(store).status(now).state.usable:
            passed.append(f"{kind}, trial {number}")
        shutil.rmtree(here)
    return done, passed, accused


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=TRIALS)
    parser.add_argument("--seed", type=int, default=1)
    parsed = parser.parse_args(arguments)
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as name, other_station(Path(name) / "home"):
        jobs = Path(name) / "jobs"
        jobs.mkdir()
        count = run(parsed.n, parsed.seed, jobs)
        histories, passed, accused = run_histories(max(parsed.n // 25, 4), parsed.seed, Path(name))
    print(f"{'jobs':34}{'changed':>10}{'no change':>12}{'unnoticed':>12}")
    for kind, done in count.done.items():
        missed = sum(one.startswith(f"{kind},") for one in count.unnoticed)
        print(f"  {kind:32}{done:10}{count.nothing[kind]:12}{missed:12}")
    total = sum(count.done.values())
    print(f"  {'all':32}{total:10}{sum(count.nothing.values()):12}{len(count.unnoticed):12}")
    for kind, done in histories.items():
        missed = sum(one.startswith(f"{kind},") for one in passed)
        print(f"  history, {kind:23}{done:10}{'':12}{missed:12}")
    print(
        f"honest: {count.accused} of {count.honest} jobs and {accused} of "
        f"{sum(histories.values())} histories accused"
    )
    for words in (*count.unnoticed[:20], *passed[:20]):
        print(f"  unnoticed: {words}")
    print(f"tracebacks: {len(count.ended)} of {total}")
    for words in count.ended[:20]:
        print(f"  {words}")
    print(f"{time.perf_counter() - begun:.0f} s, seed {parsed.seed}")
    return 1 if count.unnoticed or count.ended or passed or count.accused or accused else 0


if __name__ == "__main__":
    sys.exit(main())
