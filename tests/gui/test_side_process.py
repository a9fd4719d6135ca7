"""Side processes of the window: parts, errors, cancellation, and completed ones."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.errors import OcmmError
from ocmm_gui.work import SideProcess, Teller
from tests.host import BUSY, HANG_MS

pytestmark = pytest.mark.usefixtures("fresh_sides")

TIMEOUT_MS = HANG_MS


@dataclass(frozen=True, slots=True)
class Gate:
    """Is read by a process once a file exists."""

    file: str

    def __reduce__(self) -> tuple[Callable[[str], str], tuple[str]]:
        return opened, (self.file,)


def opened(file: str) -> str:
    """Wait for a file, and return its name."""
    while not Path(file).exists():
        time.sleep(0.01)
    return file


@dataclass(frozen=True, slots=True)
class Counting:
    """Yields parts and steps, then the size of its input."""

    gate: Gate
    content: bytes

    def __call__(self, tell: Teller) -> int:
        for number in range(3):
            tell(f"Step {number}", number / 3)
            tell.send(number)
        return len(self.content)


@dataclass(frozen=True, slots=True)
class Waiting:
    """Leaves a file among its own ones, and waits; with ``committed`` it cannot be given up."""

    committed: bool
    until: str
    """A file that ends the wait."""

    def __call__(self, tell: Teller) -> str:
        with tempfile.NamedTemporaryFile(prefix="left-") as left:
            if self.committed:
                tell.commit()
            tell.send(left.name)
            while not Path(self.until).exists():
                time.sleep(0.01)
        return "done"


def failing(tell: Teller) -> None:
    raise ZeroDivisionError("by nothing")


@pytest.fixture
def side(qtbot: QtBot) -> Iterator[SideProcess]:
    made = SideProcess()
    yield made
    made.cancel()


def test_what_is_given_comes_whole_and_what_is_told_in_order(
    qtbot: QtBot, side: SideProcess, tmp_path: Path
) -> None:
    steps: list[str] = []
    parts: list[object] = []
    side.advanced.connect(lambda what, _share: steps.append(what))
    side.came.connect(parts.append)
    with qtbot.waitSignal(side.finished, timeout=TIMEOUT_MS) as answer:
        # More than a pipe takes before the other side reads, which waits for the file: a start
        # that waited for the other side would not end.
        side.start(Counting(Gate(str(tmp_path / "gate")), bytes(4_000_000)))
        (tmp_path / "gate").touch()
    assert answer.args == [4_000_000]
    assert (steps, parts) == (["Step 0", "Step 1", "Step 2"], [0, 1, 2])
    assert not side.is_running()


def test_what_nobody_expected_is_told_with_its_name(qtbot: QtBot, side: SideProcess) -> None:
    with qtbot.waitSignal(side.failed, timeout=TIMEOUT_MS) as failed:
        side.start(failing)
    error = failed.args[0]
    assert isinstance(error, OcmmError)
    assert "ZeroDivisionError: by nothing" in error.what


def test_a_calculation_given_up_leaves_no_file(
    qtbot: QtBot, side: SideProcess, tmp_path: Path
) -> None:
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS) as came:
        side.start(Waiting(committed=False, until=str(tmp_path / "never")))
    left = Path(came.args[0])
    assert left.exists()
    with qtbot.assertNotEmitted(side.finished, wait=200):
        assert side.give_up()
        assert not side.is_running()
    qtbot.waitUntil(lambda: not left.parent.exists(), timeout=TIMEOUT_MS)


def test_what_is_done_as_a_whole_is_not_given_up(
    qtbot: QtBot, side: SideProcess, tmp_path: Path
) -> None:
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS):
        side.start(Waiting(committed=True, until=str(tmp_path / "end")))
    with qtbot.waitSignal(side.finished, timeout=TIMEOUT_MS) as finished:
        assert not side.give_up()
        assert side.is_running()
        (tmp_path / "end").touch()
    assert finished.args == ["done"]
    # Whoever closes the window waits for it, but not for ever.
    with qtbot.waitSignal(side.came, timeout=TIMEOUT_MS):
        side.start(Waiting(committed=True, until=str(tmp_path / "never")))
    begun = time.monotonic()
    side.cancel()
    assert time.monotonic() - begun < BUSY * 2.0
