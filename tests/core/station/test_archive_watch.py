"""A job of a running station is in the outbox when it is finished, and when the station closes."""

from __future__ import annotations

import time
from pathlib import Path

from ocmm_core.archive.outbox import ItemState, Outbox
from ocmm_core.archive.records import extract_job
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.station.archiving import ArchiveWatch, archive_place
from tests.host import HANG_S


def station(folder: Path) -> BuiltStation:
    return build_station(
        StationRequest(plan=resource("plans", "quick.toml"), out=folder, frame_rate_hz=500, seed=1)
    )


def test_a_finished_job_goes_into_the_outbox_by_itself(tmp_path: Path) -> None:
    built = station(tmp_path / "jobs")
    watch = ArchiveWatch(built.station, tmp_path / "outbox")
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
        until = time.monotonic() + HANG_S
        with Outbox(tmp_path / "outbox") as outbox:
            while not outbox.count(ItemState.WAITING) and time.monotonic() < until:
                time.sleep(0.05)
            (item,) = outbox.waiting()
            row = extract_job(outbox.content(item), item.name, "S").record.job
            assert (row.state, row.fault, row.simulated) == ("finished", "", True)
    finally:
        built.station.close()
        watch.close()
    assert built.station.faults.beside == ()


def test_a_job_that_is_left_goes_in_when_the_station_closes_and_an_empty_one_does_not(
    tmp_path: Path,
) -> None:
    built = station(tmp_path / "jobs")
    watch = ArchiveWatch(built.station, tmp_path / "outbox")
    built.station.close()
    watch.close()
    watch.close()
    with Outbox(tmp_path / "outbox") as outbox:
        assert outbox.count(ItemState.WAITING) == 0


def test_an_outbox_that_cannot_be_written_is_told_and_measuring_goes_on(tmp_path: Path) -> None:
    (tmp_path / "outbox").write_text("a file in the place of the folder")
    built = station(tmp_path / "jobs")
    watch = ArchiveWatch(built.station, tmp_path / "outbox")
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
    finally:
        built.station.close()
        watch.close()
    assert [fault.error.code for fault in built.station.faults.beside] == ["outbox.failed"]
    assert built.station.faults.measuring is None


def test_the_place_follows_the_settings_and_may_be_off(tmp_path: Path) -> None:
    assert archive_place("off") is None
    local = archive_place("local", outbox=tmp_path)
    assert local is not None
    assert local.address == ""
    given = archive_place(str(tmp_path / "a.sqlite"))
    assert given is not None
    assert given.address.endswith("a.sqlite")
