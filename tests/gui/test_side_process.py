"""Calculations beside the window: parts, errors, giving up, and what is not given up any more."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.errors import OcmmError
from ocmm_gui.work import SideProcess, Teller
from tests.host import BUSY

pytestmark = pytest.mark.usefixtures("fresh_sides")

TIMEOUT_MS = 60_000


@dataclass(frozen=True, slots=True)
class Counting:
    """Gives parts and steps, then how much it was given."""

    content: bytes

    def __call__(self, tell: Teller) -> int:
        for number in range(3):
            tell(f"Step {number}", number / 3)
            tell.give(number)
        return len(self.content)


@dataclass(frozen=True, slots=True)
class Waiting:
    """Leaves a file among its own ones, and waits; with ``committed`` it cannot be given up."""

    committed: bool
    seconds: float

    def __call__(self, tell: Teller) -> str:
        with tempfile.NamedTemporaryFile(prefix="left-") as left:
            if self.committed:
                tell.commit()
            tell.give(left.name)
            time.sleep(self.seconds)
        return "done"


def failing(tell: Teller) -> None:
    raise ZeroDivisionError("by nothing")


@pytest.fixture
def side(qtbot: QtBot) -> Iterator[SideProcess]:
    made = SideProcess()
    yield made
    made.cancel()


def test_what_is_given_comes_whole_and_what_is_told_in_order(
    qtbot: QtBot, side: SideProcess
) -> None:
    steps: list[str] = []
    parts: list[object] = []
    side.advanced.connect(lambda what, _share: steps.append(what))
    side.came.connect(parts.append)
    begun = time.monotonic()
    with qtbot.waitSignal(side.finished, timeout=TIMEOUT_MS) as answer:
        # More than a pipe takes before the other side reads.
        side.start(Counting(bytes(4_000_000)))
        started = time.monotonic() - begun
    whole = time.monotonic() - begun
    assert answer.args == [4_000_000]
    assert (steps, parts) == (["Step 0", "Step 1", "Step 2"], [0, 1, 2])
    # The window went on long before the process had read what it was given.
    assert started < 0.5 * whole
    assert not side.is_running()


def test_what_nobody_expected_is_told_with_its_name(qtbot: QtBot, side: SideProcess) -> None:
    with qtbot.waitSignal(side.failed, timeout=TIMEOUT_MS) as failed:
        side.start(failing)
    error = failed.args[0]
    assert isinstance(error, OcmmError)
    assert "ZeroDivisionError: by nothing" in error.what


def test_a_calculation_given_up_leaves_no_file(qtbot: QtBot, side: SideProcess) -> None:
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS) as came:
        side.start(Waiting(committed=False, seconds=60.0))
    left = Path(came.args[0])
    assert left.exists()
    with qtbot.assertNotEmitted(side.finished, wait=200):
        assert side.give_up()
        assert not side.is_running()
    qtbot.waitUntil(lambda: not left.parent.exists(), timeout=TIMEOUT_MS)


def test_what_is_done_as_a_whole_is_not_given_up(qtbot: QtBot, side: SideProcess) -> None:
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS):
        side.start(Waiting(committed=True, seconds=0.5))
    with qtbot.waitSignal(side.finished, timeout=TIMEOUT_MS) as finished:
        assert not side.give_up()
        assert side.is_running()
    assert finished.args == ["done"]
    # Whoever closes the window waits for it, but not for ever.
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS):
        side.start(Waiting(committed=True, seconds=60.0))
    begun = time.monotonic()
    side.cancel()
    assert time.monotonic() - begun < BUSY * 2.0
