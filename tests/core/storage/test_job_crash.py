"""No acknowledged point is lost: killed programs, a full disk, a disk that fails, no permission."""

from __future__ import annotations

import inspect
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobFile, JobHead
from tests.host import HANG_S, private_mounts

MakePoint = Callable[[int], MeasuredPoint]

_REPOSITORY = Path(__file__).resolve().parents[3]
_CHILD_IMPORTS = """
import resource, sys
import numpy as np
from ocmm_core.errors import StorageError
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.storage._job_file import JobFile
from ocmm_core.storage._rows import JobHead
HEAD = JobHead("a", "2024-05-06T07:08:09+00:00", *"cdefghi")
"""
_APPEND_FOR_EVER = """
with JobFile.open(sys.argv[1]) as job:
    number = job.next_number()
    while True:
        job.append_point(sample_point(number))
        print(number, flush=True)
        number += 1
"""
_FILL_THE_DISK = """
with JobFile.create(sys.argv[1] + "/full.ocmm", HEAD) as job:
    number = 1
    try:
        while number < 10_000:
            job.append_point(sample_point(number))
            number += 1
    except StorageError as error:
        print(error.code, number)
    open(sys.argv[1] + "/ballast", "w").close()
    job.append_point(sample_point(number))
    stored = [point.number for point in job.points()]
    print(stored == list(range(1, number + 1)), job.verify())
with JobFile.open(sys.argv[1] + "/full.ocmm") as job:
    print(job.next_number() == number + 1, job.verify())
"""
_BREAK_THE_DISK = """
job = JobFile.open(sys.argv[1])
number = job.next_number()
limit = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, limit[1]))
try:
    while True:
        job.append_point(sample_point(number))
        number += 1
except StorageError as error:
    print(error.code, number)
resource.setrlimit(resource.RLIMIT_FSIZE, limit)
try:
    job.append_point(sample_point(number))
except StorageError as error:
    print(error.code, len(job.points()) == number - 1)
with open(sys.argv[2], 'xb') as copy:
    copy.write(job.content())
job.close()
with JobFile.open(sys.argv[2]) as saved:
    saved.append_point(sample_point(number))
    print(len(saved.points()) == number, saved.verify())
"""
_READ_ARCHIVED = """
with JobFile.open(sys.argv[1], read_only=True) as job:
    print(len(job.points()), job.verify())
try:
    JobFile.open(sys.argv[1], read_only=False).append_event("note", "no")
except StorageError as error:
    print(error.code)
try:
    JobFile.create(sys.argv[1] + ".new", HEAD)
except StorageError as error:
    print(error.code)
"""
_MAKE_AND_KILL = """
import os, signal, time
def head_of(uuid): return JobHead(uuid, "2024-05-06T07:08:09+00:00", *"cdefghi")
begin = time.perf_counter()
JobFile.create(sys.argv[1] + "/first.ocmm", head_of("first")).close()
moment = time.perf_counter() - begin
made = none = wrong = 0
for number in range(150):
    path = sys.argv[1] + f"/{number}.ocmm"
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writing, b"1")
        JobFile.create(path, head_of(str(number)))
        time.sleep(60.0)
    os.read(reading, 1)
    time.sleep(moment)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    # It follows the moment in which the name appears, whatever else the computer does.
    moment *= 0.8 if os.path.exists(path) else 1.25
    if not os.path.exists(path):
        none += 1
        JobFile.create(path, head_of(str(number))).close()
        continue
    with JobFile.open(path) as job:
        job.append_point(sample_point(1))
        made += 1
        wrong += job.head != head_of(str(number)) or job.verify() != []
print(made, none, wrong)
"""


def child(make_point: MakePoint, work: str) -> list[str]:
    """Return the command that does ``work`` in a separate program."""
    return [sys.executable, "-c", _CHILD_IMPORTS + inspect.getsource(make_point) + work]


def lines_of(command: list[str]) -> list[str]:
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=HANG_S, cwd=_REPOSITORY, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.slow
def test_every_acknowledged_point_survives_a_kill(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    JobFile.create(path, head).close()
    rng = random.Random(20240506)  # noqa: S311 - moments of a kill, no secret
    acknowledged = 0
    for _ in range(25):
        with subprocess.Popen(
            [*child(make_point, _APPEND_FOR_EVER), str(path)],
            stdout=subprocess.PIPE,
            cwd=_REPOSITORY,
        ) as program:
            assert program.stdout is not None
            heard = [int(program.stdout.readline()) for _ in range(rng.randint(1, 12))]
            # A commit takes a fraction of a millisecond: the kill comes anywhere within a few of
            # them. A longer delay reaches later ones, and the test does not depend on their number.
            time.sleep(rng.uniform(0.0, 0.004))
            program.kill()
            rest = program.stdout.read().split(b"\n")[:-1]
            heard += [int(line) for line in rest]
        assert program.returncode == -signal.SIGKILL
        acknowledged = heard[-1]
        with JobFile.open(path) as job:
            numbers = [point.number for point in job.points()]
            assert numbers[:acknowledged] == list(range(1, acknowledged + 1))
            # At most the one point whose acknowledgement was cut off may be there as well.
            assert len(numbers) <= acknowledged + 1
            assert job.verify() == []
    assert acknowledged >= 25
    with JobFile.open(path) as job:
        for point in job.points():
            assert point.spots.tobytes() == make_point(point.number).spots.tobytes()
            assert point.tip_world.tobytes() == make_point(point.number).tip_world.tobytes()


def test_a_kill_leaves_a_whole_job_or_none(tmp_path: Path, make_point: MakePoint) -> None:
    (line,) = lines_of([*child(make_point, _MAKE_AND_KILL), str(tmp_path)])
    made, none, wrong = map(int, line.split())
    # Kills before and after the moment in which the name appears.
    assert made >= 10
    assert none >= 10
    assert wrong == 0


def in_namespace(prepare: str, command: list[str]) -> list[str]:
    """Return the lines of ``command``, run where ``prepare`` has mounted something for it alone."""
    return lines_of([*private_mounts(), "sh", "-c", f'{prepare} && exec "$@"', "sh", *command])


def test_a_full_disk_loses_nothing_and_can_be_cleared(
    tmp_path: Path, make_point: MakePoint
) -> None:
    prepare = (
        f"mount -t tmpfs -o size=600k tmpfs {tmp_path} && "
        f"head -c 200000 /dev/zero > {tmp_path}/ballast"
    )
    full, repeated, reopened = in_namespace(
        prepare, [*child(make_point, _FILL_THE_DISK), str(tmp_path)]
    )
    code, number = full.split()
    assert code == "job.disk_full"
    assert int(number) > 20
    assert repeated == "True []"
    assert reopened == "True []"


def test_a_disk_that_fails_is_not_written_again_and_a_backup_goes_on(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path, saved = tmp_path / "a.ocmm", tmp_path / "saved.ocmm"
    with JobFile.create(path, head) as job:
        job.append_point(make_point(1))
    command = [*child(make_point, _BREAK_THE_DISK), str(path), str(saved)]
    failed, again, copy = lines_of(command)
    code, number = failed.split()
    assert code == "job.disk"
    assert int(number) > 5
    assert again == "job.disk True"
    assert copy == "True []"
    with JobFile.open(path) as job:
        numbers = [point.number for point in job.points()]
    assert numbers == list(range(1, int(number)))


def test_an_archived_job_can_be_read_by_who_may_not_write(
    tmp_path: Path, head: JobHead, make_point: MakePoint
) -> None:
    path = tmp_path / "a.ocmm"
    with JobFile.create(path, head) as job:
        job.append_point(make_point(1))
    prepare = f"mount --bind {tmp_path} {tmp_path} && mount -o remount,ro,bind {tmp_path}"
    lines = in_namespace(prepare, [*child(make_point, _READ_ARCHIVED), str(path)])
    assert lines == ["1 []", "job.not_writable", "job.not_writable"]
