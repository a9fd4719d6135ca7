"""A job of a running station is in the outbox when it is finished, and when the station closes."""

from __future__ import annotations

import socket
import time
from dataclasses import replace
from pathlib import Path

from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.settings import SettingsStore
from ocmm_shop.archive.outbox import ArchivePlace, HandOverProcess, ItemState, Outbox, sweep
from ocmm_shop.archive.records import extract_job
from ocmm_shop.archiving import ArchiveWatch, archive_place
from tests.host import HANG_S, needs_package


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


def test_measuring_does_not_wait_for_a_server_that_says_nothing(tmp_path: Path) -> None:
    needs_package("psycopg", "extra `shop`")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"postgresql://me@127.0.0.1:{silent.getsockname()[1]}/ocmm"
        process = HandOverProcess(ArchivePlace(address, "S", tmp_path / "outbox"))
        process.start()
        built = station(tmp_path / "jobs")
        watch = ArchiveWatch(built.station, tmp_path / "outbox")
        try:
            built.station.start()
            assert built.station.wait_finished(HANG_S)
        finally:
            built.station.close()
            watch.close()
            process.close()
    assert built.station.faults.beside == ()
    with Outbox(tmp_path / "outbox") as outbox:
        assert outbox.count(ItemState.WAITING) == 1
        # It is put in as far as it went: nothing is left to sweep.
        assert sweep(outbox) == 0


def test_a_job_that_is_measured_is_noted_and_found_when_its_program_was_killed(
    tmp_path: Path,
) -> None:
    built = station(tmp_path / "jobs")
    watch = ArchiveWatch(built.station, tmp_path / "outbox")
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
        until = time.monotonic() + HANG_S
        notes = tmp_path / "outbox" / "measuring"
        while not (notes.is_dir() and list(notes.iterdir())) and time.monotonic() < until:
            time.sleep(0.05)
        (note,) = notes.iterdir()
        assert note.read_bytes() == str(built.station.job.path.absolute()).encode()
    finally:
        built.station.close()
        watch.close()
    assert list(notes.iterdir()) == []


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


def test_the_password_of_the_settings_is_for_the_login_of_the_settings(tmp_path: Path) -> None:
    settings = replace(
        SettingsStore.of_this_user().load().settings,
        archive_address="postgresql://station3@db.shop:5432/ocmm",
        archive_password=tmp_path / "p",
    )
    for address, used in (
        (None, True),
        ("postgresql://station3@db.shop/ocmm2", True),
        ("postgresql://ocmm_owner@db.shop/ocmm", False),
        ("postgresql://station3@other.shop/ocmm", False),
        ("postgresql://station3@DB.shop:5432/ocmm", True),
        ("postgresql:///ocmm?host=db.shop&user=station3", True),
        # Another server on that computer; and letters that are written otherwise.
        ("postgresql://station3@db.shop:5433/ocmm", False),
        ("postgresql://station3@db.shop/ocmm?port=5433", False),
        ("postgresql://Station3@db.shop/ocmm", False),
        ("postgresql://st%61tion3@db.shop/ocmm", True),
        ("postgresql://db.shop/ocmm", False),
    ):
        place = archive_place(address, settings, tmp_path)
        assert place is not None
        assert (place.password is not None) == used, address


def test_a_password_without_a_login_goes_to_none(tmp_path: Path) -> None:
    """As on a station that had a server and now keeps its jobs in a file."""
    for own in ("local", "", str(tmp_path / "a.sqlite"), "off", "postgresql://station3@db.shop"):
        settings = replace(
            SettingsStore.of_this_user().load().settings,
            archive_address=own,
            archive_password=tmp_path / "p",
        )
        place = archive_place("postgresql://station3@db.shop/ocmm", settings, tmp_path)
        assert place is not None
        assert place.password is None, own
