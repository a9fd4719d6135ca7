"""The station is FAILED when a history, the recording or the job loses its name, even if idle."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.calibration.records import CalibrationStore, store_folder
from ocmm_core.composition import BuiltStation, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.named_file import rescue_folders
from ocmm_core.storage import JobFile
from ocmm_shop.archive.outbox import ItemState, Outbox, sweep
from ocmm_shop.archiving import ArchiveWatch
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.waiting import wait_until


@pytest.fixture
def built(tmp_path: Path) -> Iterator[BuiltStation]:
    """Return a station, not started, with a history of its calibration and a recording."""
    store = CalibrationStore(store_folder(tmp_path / "calibrations", "recommended"))
    store.accept(make_record(), "technician", "new", MADE)
    store.verify(make_verification(make_record()), MADE)
    made = build_station(
        StationRequest(
            plan=resource("plans", "quick.toml"),
            out=tmp_path / "out",
            calibrations=tmp_path / "calibrations",
            uncalibrated=True,
            record=tmp_path / "a.ocmr",
            frame_rate_hz=500,
        )
    )
    yield made
    made.station.close()


def _told(built: BuiltStation) -> str:
    faults = built.station.faults
    wait_until(lambda: faults.measuring is not None)
    error = faults.why_failed()
    assert error is not None
    return f"{error.what} {error.remedy}"


@pytest.mark.parametrize("loss", ["removed", "emptied", "folder removed", "folder moved"])
def test_a_lost_history_fails_the_station(built: BuiltStation, tmp_path: Path, loss: str) -> None:
    built.station.start()
    folder = store_folder(tmp_path / "calibrations", "recommended")
    chain, seal = folder / "events.jsonl", folder / "events.seal.json"
    before = chain.read_bytes(), seal.read_bytes()
    if loss == "removed":
        chain.unlink()
    elif loss == "emptied":
        chain.write_bytes(b"")
    elif loss == "folder removed":
        shutil.rmtree(folder)
    else:
        folder.rename(tmp_path / "away")
    assert "2 entries before are saved in" in _told(built)
    newest = [
        max(rescue_folders()[-1].glob(name), key=lambda path: path.stat().st_mtime_ns)
        for name in ("events-rescued-*.jsonl", "events.seal-rescued-*.json")
    ]
    assert (newest[0].read_bytes(), newest[1].read_bytes()) == before


def test_an_appended_or_restored_history_is_no_loss(built: BuiltStation, tmp_path: Path) -> None:
    built.station.start()
    folder = store_folder(tmp_path / "calibrations", "recommended")
    other = CalibrationStore(folder)
    now = MADE + timedelta(hours=1)
    other.verify(make_verification(make_record()), now)
    copy = tmp_path / "copy.jsonl"
    shutil.copy(folder / "events.jsonl", copy)
    copy.replace(folder / "events.jsonl")
    store = built.station.instruments.calibration_in_use.store
    assert store is not None
    assert store.check_name() is None
    other.verify(make_verification(make_record()), now + timedelta(hours=1))
    assert store.check_name() is None
    assert built.station.faults.measuring is None


def _at_third_point(built: BuiltStation, act: Callable[[], object]) -> None:
    taken: list[MeasuredPoint] = []

    def count(point: MeasuredPoint) -> None:
        taken.append(point)
        if len(taken) == 3:
            act()

    built.station.events.point_taken.connect(count)
    built.station.start()


def test_a_lost_recording_fails_the_station(built: BuiltStation, tmp_path: Path) -> None:
    path, before = tmp_path / "a.ocmr", list[bytes]()

    def remove() -> None:
        before.append(path.read_bytes())
        path.unlink()

    _at_third_point(built, remove)
    assert "a.ocmr: it was removed" in _told(built)
    built.station.close()
    saved = max(rescue_folders()[-1].glob("a-*.ocmr"), key=lambda path: path.stat().st_mtime_ns)
    assert saved.read_bytes().startswith(before[0])
    replay = ReplaySource(saved)
    assert len(replay.recording)
    replay.close()


def test_the_name_of_a_lost_job_is_not_archived(built: BuiltStation, tmp_path: Path) -> None:
    watch = ArchiveWatch(built.station, tmp_path / "outbox")
    foreign = tmp_path / "foreign.ocmm"

    def replace() -> None:
        foreign.write_bytes(JobFile.read(built.job_path).content())
        foreign.replace(built.job_path)

    _at_third_point(built, replace)
    assert "replaced" in _told(built)
    built.station.close()
    watch.close()
    with Outbox(tmp_path / "outbox") as outbox:
        assert sweep(outbox) == 0
        assert outbox.count(ItemState.WAITING) == 0
