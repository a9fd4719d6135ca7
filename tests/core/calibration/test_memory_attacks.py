"""Older histories and adopted jobs never pass, and honest moves are never called a forgery.

The long form is ``python -m benchmarks.station_memory``.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks.station_memory import MEMORIES, MOVES, PATHS, run_adopted, run_attacks, run_honest
from benchmarks.tampering import EDITS
from tests.host import on_linux_only
from tests.other_station import other_station

pytestmark = on_linux_only

_LONG = bool(os.environ.get("OCMM_TEST_LONG"))


@pytest.fixture(autouse=True)
def _own_station(tmp_path: Path) -> object:
    with other_station(tmp_path / "home"):
        yield


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "place").mkdir()
    return tmp_path / "place"


def test_no_older_history_is_valid_wherever_it_lies(place: Path) -> None:
    """Every path with every state of the memory: 88 attacks, 880 in the long form."""
    trials = len(PATHS) * len(MEMORIES) * (10 if _LONG else 1)
    found = run_attacks(trials, 1, place)
    assert sum(found.done.values()) == trials
    assert found.passed == []


def test_no_changed_job_is_intact_after_an_adoption(place: Path) -> None:
    """Every change with a whole and an emptied memory: 22 jobs, 121 in the long form."""
    trials = len(EDITS) * (len(MEMORIES) if _LONG else 2)
    found = run_adopted(trials, 1, place)
    assert sum(found.done.values()) == trials
    assert found.passed == []
    # Some are adopted, so that the test is meaningful.
    assert any(kind.startswith("adopted True") for kind in found.done)


def test_honest_moves_are_not_called_a_forgery(place: Path) -> None:
    """Every move twice: 24, 240 in the long form."""
    trials = len(MOVES) * (20 if _LONG else 2)
    found = run_honest(trials, 1, place)
    assert sum(found.done.values()) == trials
    assert found.accused == []
