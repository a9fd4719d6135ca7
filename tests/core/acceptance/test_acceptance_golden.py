"""An acceptance session of version 0.2.0 resumes and yields the same record."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import msgspec
import pytest

from ocmm_core.acceptance import AcceptanceRecord, AcceptanceSession
from tests.core.acceptance.acceptance_site import BEGIN, ROOM, Machine
from tests.core.golden_station import copied_station


@pytest.fixture
def station(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return copied_station("0.2", tmp_path, monkeypatch, "acceptance")


def test_an_interrupted_session_resumes_and_gives_the_same_record(station: Path) -> None:
    session = AcceptanceSession.resume(station / "open.chain")
    view = session.view
    assert (view.done, view.current, view.next_item) == ((9, 2, 0), 1, 2)
    assert view.refusals == ("These spots were used before, in the calibration or in this test.",)
    assert not session.log.torn
    machine = Machine(seed=8, sigma=0.001, now=BEGIN + timedelta(hours=1))
    machine.run(session)
    record = session.finish(machine.now, ROOM)
    golden = msgspec.json.decode((station / "record.json").read_bytes(), type=AcceptanceRecord)
    # The head of the chain as well: each line is the same byte by byte.
    assert record == golden


def test_a_torn_last_line_is_dropped(station: Path) -> None:
    path = station / "open.chain"
    path.write_bytes(path.read_bytes() + b'{"number":17,"previous":"')
    session = AcceptanceSession.resume(path)
    assert session.log.torn
    assert session.view.done == (9, 2, 0)
