"""Many simultaneous stations, each a separate process: nothing lost, nothing doubled."""

from __future__ import annotations

import json
import os
import shutil
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from ocmm_shop.archive.outbox import Courier, ItemState, Outbox
from tests.host import HANG_S, amount
from tests.shop.archive.conftest import Place
from tests.shop.archive.outbox_campaign import count, quick_extract

STATIONS = amount(12, 100)
"""A server admits about 97; some of 100 must retry."""


def number_of(station: int, job: int) -> int:
    return 1000 * (station + 1) + job


def put(folder: Path, station: int, *jobs: int) -> None:
    with Outbox(folder / str(station)) as outbox:
        for job in jobs:
            number = number_of(station, job)
            outbox.put_content(b"%d" % number, folder / f"{number}.ocmm")


def at_once(
    folder: Path, place: Place, stations: Sequence[int], named: Callable[[int], str],
    tries: int = 1000,
) -> list[dict[str, object]]:  # fmt: skip
    """Let each station hand over its queue, all at one moment; return the message of each."""
    go_read, go_write = os.pipe()
    lines = []
    children = []
    for station in stations:
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(go_write)
            _hand_over(folder / str(station), place, named(station), go_read, write, tries)
        os.close(write)
        children.append(child)
        lines.append(read)
    os.close(go_read)
    os.close(go_write)
    said = []
    for child, line in zip(children, lines, strict=True):
        with os.fdopen(line) as stream:
            said.append(json.loads(stream.read()))
        assert os.waitpid(child, 0)[1] == 0
    return said


def _hand_over(
    folder: Path, place: Place, name: str, go: int, write: int, tries: int
) -> None:  # fmt: skip
    """Wait for the moment, hand over until nothing waits, and say how it went; never returns."""
    try:
        with Outbox(folder) as outbox:
            # Each is a separate computer.
            outbox.machine = f"machine of {folder.name}"
            one = Courier(outbox, place.open, name, quick_extract)
            with os.fdopen(go, "rb") as stream:
                stream.read()
            begun, code, refusals = time.monotonic(), "", 0
            for _ in range(tries):
                handed = one.send_waiting()
                code = "" if handed.error is None else handed.error.code
                refusals += bool(code)
                if not code or time.monotonic() - begun > HANG_S:
                    break
                time.sleep(0.05)
            one.close()
            said = {"s": time.monotonic() - begun, "code": code, "refusals": refusals}
        os.write(write, json.dumps(said).encode())
        os._exit(0)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(1)


def saved(place: Place, folder: Path) -> Callable[[], None]:
    """Save an archive; return what puts it back as it was."""
    if place.server is None:
        backup = folder / "last week.sqlite"
        shutil.copy(place.address, backup)

        def copy_back() -> None:
            for leftover in ("-wal", "-shm"):
                Path(f"{place.address}{leftover}").unlink(missing_ok=True)
            shutil.copy(backup, place.address)

        return copy_back
    server, database = place.server, place.database
    server.sql("postgres", f"CREATE DATABASE {database}_saved TEMPLATE {database}")

    def rename_back() -> None:
        server.sql(
            "postgres",
            f"DROP DATABASE {database} WITH (FORCE)",
            f"ALTER DATABASE {database}_saved RENAME TO {database}",
        )

    return rename_back


def test_all_at_once_and_again_after_the_archive_went_back_a_week(
    place: Place, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    stations = range(STATIONS)

    def named(station: int) -> str:
        return f"Station {station}"

    def all_there(jobs: int) -> None:
        with place.open() as archive:
            numbers, rows, results, files = count(archive)
        expected = {number_of(one, job) for one in stations for job in range(jobs)}
        assert numbers == expected
        assert (rows, results, files) == (len(expected), 3 * len(expected), len(expected))

    times = []
    for one in stations:
        put(tmp_path, one, 0, 1)
    said = at_once(tmp_path, place, stations, named)
    times.append(max(float(str(one["s"])) for one in said))
    assert {one["code"] for one in said} == {""}
    all_there(2)
    put_back = saved(place, tmp_path)
    for one in stations:
        put(tmp_path, one, 2)
    at_once(tmp_path, place, stations, named)
    all_there(3)
    for one in stations:
        put(tmp_path, one, 3, 4)
    put_back()
    all_there(2)
    said = at_once(tmp_path, place, stations, named)
    times.append(max(float(str(one["s"])) for one in said))
    assert {one["code"] for one in said} == {""}
    all_there(5)
    for one in stations:
        with Outbox(tmp_path / str(one)) as outbox:
            assert outbox.count(ItemState.SENT) == 5
    record_property(
        place.store,
        f"{STATIONS} stations at once: {2 * STATIONS} jobs within {times[0]:.2f} s, "
        f"{3 * STATIONS} after the archive went back within {times[1]:.2f} s; 0 lost, 0 doubled",
    )


def test_of_two_stations_with_one_name_at_once_one_waits_and_loses_nothing(
    place: Place, tmp_path: Path
) -> None:
    for one in (0, 1):
        put(tmp_path, one, 0, 1)
    said = at_once(tmp_path, place, (0, 1), lambda station: "Hall 3", tries=3)
    codes = [one["code"] for one in said]
    assert sorted(map(str, codes)) == ["", "archive.station"]
    first, second = codes.index(""), codes.index("archive.station")
    with place.open() as archive:
        assert count(archive)[0] == {number_of(first, job) for job in (0, 1)}
    with Outbox(tmp_path / str(second)) as outbox:
        assert outbox.count(ItemState.WAITING) == 2
    assert at_once(tmp_path, place, (second,), lambda station: "Hall 4")[0]["code"] == ""
    with place.open() as archive:
        numbers, rows, results, files = count(archive)
    assert len(numbers) == rows == files == 4
    assert results == 12
