"""Scale every sleep of the tests: ``OCMM_TEST_SLEEPS=0.5 ./run test``, or 2.

A test that passes with one length of its sleeps alone depends on the speed of the computer. Scaled
are `time.sleep` in files of the tests, `qtbot.wait` and `QTest.qWait`, in the process of pytest
and its forks. Sleeps of the product, waits for an event, and programs that a test starts keep
their length.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

SLEEPS = "OCMM_TEST_SLEEPS"
_TESTS = str(Path(__file__).parent)


def scale_sleeps() -> None:
    """Replace the sleeps of this process if the environment contains a factor."""
    factor = float(os.environ.get(SLEEPS) or 1.0)
    if not 0.0 < factor < 100.0:
        raise ValueError(f"{SLEEPS} is {factor}: give a factor above 0 and below 100")
    if factor == 1.0:
        return
    sleep = time.sleep

    def scaled(seconds: float) -> None:
        own = sys._getframe(1).f_code.co_filename.startswith(_TESTS)  # noqa: SLF001 - no other way
        sleep(factor * seconds if own else seconds)

    time.sleep = scaled  # type: ignore[assignment] # tests give seconds
    from PySide6.QtTest import QTest
    from pytestqt.qtbot import QtBot

    wait, wait_in_test = QtBot.wait, QTest.qWait

    QtBot.wait = lambda self, ms: wait(self, round(factor * ms))  # type: ignore[method-assign] # the only way
    QTest.qWait = staticmethod(lambda ms: wait_in_test(round(factor * ms)))  # type: ignore[method-assign] # as above
