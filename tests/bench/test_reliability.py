"""The reliability campaign: a sample of each lane, faults that it must find, and resumption."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ocmm_bench.campaign._clock import clock
from ocmm_bench.campaign._faults import cuts, faults
from ocmm_bench.campaign._faulty_disk import build, why_not_here, with_faults
from ocmm_bench.campaign._hostile_runs import CommandResult, Forgery
from ocmm_bench.campaign._kills import SoakSamples, kills, soak
from ocmm_bench.campaign._reliability import print_results
from ocmm_bench.campaign._trials import LaneResult, NotRunError, Trial, bound, read_state, run_lane
from ocmm_bench.campaign._work import WORKS, append_points, lost_points
from ocmm_bench.campaign._writers import writers
from ocmm_cli.terminal import PlainConsole
from ocmm_core.errors import InputError
from tests.host import HANG_S, not_run, on_linux_only

pytestmark = on_linux_only

_REPOSITORY = Path(__file__).resolve().parents[2]
_ON_A_FAULTY_DISK = """
import errno, json, os, sys
from pathlib import Path
from ocmm_bench.campaign._work import WORKS
from ocmm_bench.campaign._faulty_disk import FaultyDisk
from ocmm_core.errors import StorageError
disk, top = FaultyDisk(), Path(sys.argv[1])
"""
_SYNC_AGAIN = """
disk.fail(top, "fsync", 1, errno.EIO, stay=False)
stream = (top / "a").open("wb")
for _ in range(2):
    try:
        os.fsync(stream.fileno())
        print("synced")
    except OSError as error:
        print(errno.errorcode[error.errno])
stream.close()
print(disk.hits(), disk.synced_again())
"""
_FAIL_EVERY_SYNC = """
for nth in range(1, 8):
    folder = top / str(nth)
    folder.mkdir()
    acknowledged, code = [], ""
    disk.fail(folder, "fdatasync", nth, errno.EIO, stay=False)
    try:
        WORKS["job"].do(folder, acknowledged.append)
    except StorageError as error:
        code = error.code
    hits, again = disk.hits(), disk.synced_again()
    disk.mend()
    lost = WORKS["job"].lost(folder, acknowledged)
    print(json.dumps([hits, again, lost, len(acknowledged), code]))
"""

_RENAME_NO_MORE = """
for nth in range(4, 7):
    folder = top / str(nth)
    folder.mkdir()
    acknowledged = []
    disk.fail(folder, "rename", nth, errno.EIO, stay=True)
    try:
        WORKS["report"].do(folder, acknowledged.append)
    except StorageError as error:
        print(error.code, acknowledged, {path.read_text() for path in folder.iterdir()})
    disk.mend()
"""


def on_a_faulty_disk(folder: Path, program: str) -> list[str]:
    """Return the lines of a program that fails below ``folder`` as it wants."""
    lacking = why_not_here()
    if lacking:
        not_run(f"no failing disk on this host: {lacking}")
    (folder / "library").mkdir()
    (folder / "disk").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", _ON_A_FAULTY_DISK + program, str(folder / "disk")],
        env=with_faults(build(folder / "library")),
        capture_output=True, text=True, timeout=HANG_S, cwd=_REPOSITORY, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_second_sync_of_a_descriptor_would_be_seen(tmp_path: Path) -> None:
    assert on_a_faulty_disk(tmp_path, _SYNC_AGAIN) == ["EIO", "synced", "1 1"]


def test_a_job_never_syncs_again_what_failed_and_loses_nothing(tmp_path: Path) -> None:
    # "Once" is the worst disk: the sync that comes next would seem to go well.
    rows = [json.loads(line) for line in on_a_faulty_disk(tmp_path, _FAIL_EVERY_SYNC)]
    assert len(rows) == 7
    assert [row[0] for row in rows].count(1) >= 6
    assert {(again, lost) for _, again, lost, _, _ in rows} == {(0, 0)}
    assert {code for *_, count, code in rows if count < 3} == {"job.disk"}


def test_a_report_is_put_back_by_a_disk_that_renames_no_more(tmp_path: Path) -> None:
    lines = on_a_faulty_disk(tmp_path, _RENAME_NO_MORE)
    assert lines == ["export.not_writable [1] {'1\\n'}"] * 3


def test_some_faults_lose_nothing_and_are_told() -> None:
    if why_not_here():
        not_run(f"no failing disk on this host: {why_not_here()}")
    trials = list(faults(3, 60, frozenset({0, 1})))
    assert [trial.number for trial in trials] == list(range(2, 60))
    assert [trial for trial in trials if trial.found] == []
    assert sum(trial.acknowledged for trial in trials) > 20


@pytest.mark.slow
def test_some_kills_of_a_whole_job_lose_nothing_and_leave_nothing(
    repeats: Callable[..., int],
) -> None:
    runs = repeats(3, 6)
    trials = list(kills(5, runs, frozenset()))
    assert len(trials) == runs
    # A ring of another program that was killed just now would be none of ours.
    found = [{**trial.found, "rings left": 0} for trial in trials if trial.found]
    assert [counts for counts in found if any(counts.values())] == []
    # How many depends on the load of this computer: kills come at their time, points at theirs.
    assert sum(trial.acknowledged for trial in trials) > 0


def test_some_power_cuts_lose_nothing() -> None:
    try:
        trials = list(cuts(2, 6, frozenset()))
    except NotRunError as error:
        not_run(f"no power cuts on this host: {error}")
    assert [trial.found for trial in trials] == [{}] * 6
    assert sum(trial.acknowledged for trial in trials) > 0


def test_a_copy_of_another_disk_is_no_power_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        list(cuts(2, 1, frozenset()))
    except NotRunError as error:
        not_run(f"no power cuts on this host: {error}")

    def copy(_source: Path, target: Path) -> None:
        with target.open("wb") as stream:
            stream.truncate(24 << 20)
        subprocess.run(["mkfs.ext4", "-q", "-F", str(target)], check=True)

    monkeypatch.setattr("ocmm_bench.campaign._faults.shutil.copyfile", copy)
    with pytest.raises(NotRunError, match="do not hold what was synced"):
        list(cuts(2, 1, frozenset()))


def test_two_writers_store_every_point_and_event_once() -> None:
    # A job, a store of calibrations and one of a probe.
    found = list(writers(1, 3, frozenset()))
    assert found == [Trial("writers", 1, at, many, {}) for at, many in enumerate((100, 200, 200))]


def test_an_event_that_another_program_writes_over_would_be_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Without a lock, and without a check whether the file has grown meanwhile.
    monkeypatch.setattr("ocmm_core.calibration.records._chain_seal._lock", lambda *_, **__: None)
    monkeypatch.setattr("ocmm_core.chain_file.HOST.lock", lambda *_, **__: None)
    (trial,) = writers(1, 2, frozenset({0}))
    assert trial.found


def test_some_jumps_of_the_clock_are_told_and_accuse_nobody() -> None:
    if why_not_here():
        not_run(f"no clock of its own on this host: {why_not_here()}")
    # Two stores of calibrations, two of probes, a job; the others are left out.
    wanted = (0, 1, 3, 4, 6)
    trials = list(clock(4, 7, frozenset(range(7)) - frozenset(wanted)))
    assert trials == [Trial("clock", 4, number, 12, {}) for number in wanted]


@pytest.mark.slow
def test_a_job_is_measured_while_the_clock_jumps() -> None:
    if why_not_here():
        not_run(f"no clock of its own on this host: {why_not_here()}")
    (trial,) = clock(4, 10, frozenset(range(9)))
    assert trial.found == {}
    assert trial.acknowledged > 10


def test_a_clock_that_nobody_watches_would_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    if why_not_here():
        not_run(f"no clock of its own on this host: {why_not_here()}")
    broken = "import ocmm_core.calibration.records as r; r.RecordStore.seen_utc = ''; "
    monkeypatch.setattr("ocmm_bench.campaign._clock.PRELUDE", broken)
    found = Counter[str]()
    for trial in clock(4, 4, frozenset()):
        found.update(trial.found)
    assert found["steps back not told"] > 0
    assert found["expired became valid"] > 0


def test_a_soak_of_two_jobs_grows_by_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    # The full rate takes minutes on a busy computer; the program is the same.
    monkeypatch.setattr("ocmm_bench.campaign._kills.SOAK_RATE_HZ", 500)
    trials = list(soak(1, 2, frozenset()))
    assert [trial.found for trial in trials] == [{}, {}]
    assert trials[0].acknowledged == trials[1].acknowledged > 0


def test_what_grows_would_be_found() -> None:
    held = SoakSamples()
    kept = []
    for _ in range(3):
        kept.append(os.open(os.devnull, os.O_RDONLY))
        held.sample(0.0)
    for descriptor in kept:
        os.close(descriptor)
    assert held.found()["descriptors more"] == 1
    rng = np.random.default_rng(1)
    times = 600.0 + 60.0 * np.arange(61)
    # An hour: 1 MiB/h is allowed, 5 are not; a tenth of a MiB of noise is neither.
    for slope, many in ((0.9, 0), (5.0, 1)):
        values = 300.0 + slope * times / 3600.0 + rng.normal(0.0, 0.1, len(times))
        grown = SoakSamples(list(times), list(values), [])
        assert abs(grown.growth()[0] - slope) < 0.2
        assert grown.found() == {"memory above 1 MiB/h": many}
    # Frames before the end of the warm-up do not count.
    assert SoakSamples([0.0, 300.0], [100.0, 300.0], []).found() == {"memory above 1 MiB/h": 0}


@pytest.mark.slow
def test_some_hostile_files_are_refused_with_a_sentence(
    tmp_path: Path, repeats: Callable[..., int]
) -> None:
    state, runs = tmp_path / "state.jsonl", repeats(2, 4)
    done = command("hostile", runs, state)
    assert done.returncode == 0, done.stdout + done.stderr
    trials = read_state(state)
    assert [trial.number for trial in trials] == list(range(runs))
    assert sum(trial.acknowledged for trial in trials) > 0


def test_a_hostile_file_that_does_something_would_be_found() -> None:
    kind = Forgery("any", lambda good, path: None)
    said = "ocmm: This is no file of ours."
    answers = {
        "": CommandResult(2, 0.1, 0.1, 90.0, said),
        "traceback": CommandResult(3, 0.1, 0.1, 90.0, said),
        "hang": CommandResult(2, 8.0, 9.0, 90.0, said),
        "memory": CommandResult(2, 0.1, 0.1, 600.0, said),
        "accepted": CommandResult(0, 0.1, 0.1, 90.0, ""),
        "no sentence": CommandResult(2, 0.1, 0.1, 90.0, ""),
    }
    assert [answer.fault(kind, 1.0) for answer in answers.values()] == list(answers)


def test_a_lost_and_a_changed_point_would_be_found(tmp_path: Path) -> None:
    path = tmp_path / "a.ocmm"
    acknowledged: list[int] = []
    append_points(path, acknowledged.append, 3)
    assert lost_points(path, acknowledged) == 0
    assert lost_points(path, [*acknowledged, 4]) == 1
    assert lost_points(tmp_path / "none.ocmm", acknowledged) == 3


@pytest.mark.parametrize("name", ["history", "report", "recording", "settings"])
def test_what_was_not_stored_would_be_found(tmp_path: Path, name: str) -> None:
    acknowledged: list[int] = []
    WORKS[name].do(tmp_path, acknowledged.append)
    assert WORKS[name].lost(tmp_path, acknowledged) == 0
    later = [*acknowledged, acknowledged[-1] + 1]
    assert WORKS[name].lost(tmp_path, later) == 1


def lane(_seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Give a trial for every number that is left; every third finds something."""
    for number in range(runs):
        if number not in done:
            found = {"audit faults": 2} if number % 3 == 2 else {}
            yield Trial("kills", 1, number, 10, found, "here" if found else "")


def test_a_run_goes_on_from_its_state(tmp_path: Path) -> None:
    state = tmp_path / "state.jsonl"
    forever = time.monotonic() + 3600.0
    told: list[int] = []
    first = run_lane("kills", lane, 1, 4, state, time.monotonic() - 1.0, told.append)
    # No time is left after one trial.
    assert len(first.trials) == 1
    run_lane("kills", lane, 1, 4, state, forever, told.append)
    with state.open("ab") as stream:
        stream.write(b'{"lane": "kil')
    whole = run_lane("kills", lane, 1, 6, state, forever, told.append)
    assert sorted(trial.number for trial in whole.trials) == list(range(6))
    assert told == [1, 2, 3, 4, 5, 6]
    assert len(state.read_bytes().splitlines()) == 6
    assert run_lane("kills", lane, 2, 1, state, forever, told.append).trials[0].number == 0
    assert whole.failed
    assert whole.count("audit faults") == 4
    assert whole.acknowledged == 60
    state.write_bytes(b"no state\n")
    with pytest.raises(InputError, match="not the state"):
        run_lane("kills", lane, 1, 4, state, forever, told.append)


def test_the_table_has_a_bound_beside_each_zero(capsys: pytest.CaptureFixture[str]) -> None:
    trials = tuple(lane(1, 300, frozenset()))
    results = [LaneResult("kills", trials), LaneResult("cuts", (), "needs root")]
    print_results(results, PlainConsole(width=120))
    text = " ".join(capsys.readouterr().out.split())
    assert "kills 300 3000 acknowledged points lost 0 0.01 jobs half made 0 0.01" in text
    assert "audit faults 200 reopened" in text
    assert "cuts NOT RUN needs root" in text
    assert "kills 2: audit faults. here" in text
    assert "... and 90 more." in text
    assert bound(0) == bound(2) == 1.0


def command(name: str, runs: int, state: Path) -> subprocess.CompletedProcess[str]:
    """Run a lane as a user does, in a separate program."""
    return subprocess.run(
        [
            sys.executable, "-m", "ocmm_cli", "selftest", "reliability", "--lane", name,
            "--runs", str(runs), "--state", str(state),
        ],
        env={**os.environ, "COLUMNS": "120"},
        capture_output=True, text=True, timeout=HANG_S, cwd=_REPOSITORY, check=False,
    )  # fmt: skip


def test_the_command_ends_with_0_where_nothing_was_found(tmp_path: Path) -> None:
    done = command("writers", 1, tmp_path / "state.jsonl")
    assert done.returncode == 0, done.stderr
    assert "items twice" in done.stdout
    assert len((tmp_path / "state.jsonl").read_bytes().splitlines()) == 1
